//! The triangular factors `L D L'` of a symmetric matrix with a row for each input.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use core::array::from_fn;

/// `L D L'`, with ones on the diagonal of `L`. With one input it is the number itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor<const N: usize> {
    /// `L` below its diagonal.
    lower: [[f64; N]; N],
    /// The inverse of `D`.
    inverse: [f64; N],
}

impl<const N: usize> Factor<N> {
    pub(crate) const ZERO: Self = Self { lower: [[0.0; N]; N], inverse: [0.0; N] };

    /// The inverse of `D`.
    #[inline(always)]
    pub fn inverse(&self) -> &[f64; N] {
        &self.inverse
    }

    /// Factorises a matrix, if every entry of `D` exceeds its `least`.
    #[inline(always)]
    pub(crate) fn of(mut matrix: [[f64; N]; N], least: &[f64; N]) -> Option<Self> {
        let mut factor = Self::ZERO;
        for j in 0..N {
            let pivot = matrix[j][j];
            let positive = pivot > least[j];
            if !positive {
                return None;
            }
            factor.inverse[j] = 1.0 / pivot;
            let column = matrix.map(|row| row[j]);
            for i in j + 1..N {
                let share = column[i] * factor.inverse[j];
                factor.lower[i][j] = share;
                for (entry, value) in matrix[i].iter_mut().zip(&column).skip(j + 1) {
                    *entry -= share * value;
                }
            }
        }
        Some(factor)
    }

    /// The inverse of `L`, times `rows`.
    #[inline(always)]
    pub(crate) fn reduce<const W: usize>(&self, mut rows: [[f64; W]; N]) -> [[f64; W]; N] {
        for i in 1..N {
            for j in 0..i {
                rows[i] = from_fn(|w| rows[i][w] - self.lower[i][j] * rows[j][w]);
            }
        }
        rows
    }

    /// The inverse of `D`, times `rows`.
    #[inline(always)]
    pub(crate) fn scale<const W: usize>(&self, rows: &[[f64; W]; N]) -> [[f64; W]; N] {
        from_fn(|i| rows[i].map(|value| value * self.inverse[i]))
    }

    /// The inverse of `L'`, times `rows`.
    #[inline(always)]
    pub(crate) fn restore<const W: usize>(&self, mut rows: [[f64; W]; N]) -> [[f64; W]; N] {
        for i in (0..N).rev() {
            for j in i + 1..N {
                rows[i] = from_fn(|w| rows[i][w] - self.lower[j][i] * rows[j][w]);
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    use super::*;

    type Matrix = SMatrix<f64, 4, 4>;

    fn matrix() -> impl Strategy<Value = Matrix> {
        prop::array::uniform16(-1.0..1.0_f64).prop_map(|entries| Matrix::from_row_slice(&entries))
    }

    fn rows(matrix: &Matrix) -> [[f64; 4]; 4] {
        from_fn(|i| from_fn(|j| matrix[(i, j)]))
    }

    proptest! {
        #[test]
        fn val_nalgebra_solves_with_positive_definite_matrices(root in matrix(), right in matrix()) {
            let positive = root * root.transpose() + Matrix::identity() * 0.1;
            let factor = Factor::of(rows(&positive), &[0.0; 4]).unwrap();
            let solved = factor.restore(factor.scale(&factor.reduce(rows(&right))));
            let expected = rows(&positive.cholesky().unwrap().solve(&right));
            for (one, other) in solved.as_flattened().iter().zip(expected.as_flattened()) {
                prop_assert!((one - other).abs() < 1e-10 * (1.0 + other.abs()), "{one} {other}");
            }
        }

        #[test]
        fn val_nalgebra_eigenvalues_tell_which_matrices_are_refused(root in matrix()) {
            let symmetric = root + root.transpose();
            let least = symmetric.symmetric_eigenvalues().min();
            prop_assume!(least.abs() > 1e-9);
            prop_assert_eq!(Factor::of(rows(&symmetric), &[0.0; 4]).is_some(), least > 0.0);
        }
    }

    #[test]
    fn a_matrix_of_nan_is_refused() {
        assert_eq!(Factor::of([[f64::NAN]], &[0.0]), None);
    }
}
