//! Intervals as full matrices, for models without a structure that merits separate code; and the
//! factors of a symmetric matrix.
#![expect(clippy::inline_always, reason = "inlined into the sweeps, to be compiled for their vectors")]

use alloc::vec::Vec;
use core::array::from_fn;

use crate::intervals::{Curvature, Feedback, Hessian, Interval, Intervals, Stage, add_times};

/// One interval. [`Model::evaluate`](crate::Model::evaluate) fills in `end`, `pulled_x` and
/// `pulled_u`, and the other fields if derivatives are requested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dense<const NX: usize, const NU: usize> {
    /// `F`.
    pub end: [f64; NX],
    /// `A' lambda`.
    pub pulled_x: [f64; NX],
    /// `B' lambda`.
    pub pulled_u: [f64; NU],
    /// Derivative of `F` (rows) by the state.
    pub a: [[f64; NX]; NX],
    /// Derivative of `F` (rows) by the input.
    pub b: [[f64; NU]; NX],
    /// Second derivative of `lambda' F`.
    pub curvature: Hessian<NX, NU>,
}

impl<const NX: usize, const NU: usize> Dense<NX, NU> {
    const ZERO: Self = Self {
        end: [0.0; NX],
        pulled_x: [0.0; NX],
        pulled_u: [0.0; NU],
        a: [[0.0; NX]; NX],
        b: [[0.0; NU]; NX],
        curvature: Hessian { xx: [[0.0; NX]; NX], ux: [[0.0; NX]; NU], uu: [[0.0; NU]; NU] },
    };

    /// `(A, B)' P (A, B)` for a symmetric `P`, plus a share of the curvature.
    #[inline(always)]
    fn square(&self, p: &[[f64; NX]; NX], share: f64) -> Hessian<NX, NU> {
        let (mut pa, mut pb) = ([[0.0; NX]; NX], [[0.0; NU]; NX]);
        for i in 0..NX {
            (pa[i], pb[i]) = (&self).pull(&p[i]);
        }
        let mut square = self.curvature;
        for row in square.xx.iter_mut().chain(&mut square.ux) {
            for entry in row {
                *entry *= share;
            }
        }
        for entry in square.uu.as_flattened_mut() {
            *entry *= share;
        }
        for k in 0..NX {
            for i in 0..NX {
                add_multiple(&mut square.xx[i], self.a[k][i], &pa[k]);
            }
            for i in 0..NU {
                add_multiple(&mut square.ux[i], self.b[k][i], &pa[k]);
                add_multiple(&mut square.uu[i], self.b[k][i], &pb[k]);
            }
        }
        square
    }
}

/// All intervals of a horizon.
#[derive(Debug, Clone, Default)]
pub struct DenseIntervals<const NX: usize, const NU: usize>(pub Vec<Dense<NX, NU>>);

impl<const NX: usize, const NU: usize> Intervals<NX, NU> for DenseIntervals<NX, NU> {
    type Interval<'a> = &'a Dense<NX, NU>;

    fn resize(&mut self, intervals: usize) {
        self.0.resize(intervals, Dense::ZERO);
    }

    #[inline(always)]
    fn end(&self, k: usize) -> [f64; NX] {
        self.0[k].end
    }

    #[inline(always)]
    fn pulled(&self, k: usize, _: &[f64; NX]) -> ([f64; NX], [f64; NU]) {
        (self.0[k].pulled_x, self.0[k].pulled_u)
    }

    #[inline(always)]
    fn interval(&self, k: usize) -> &Dense<NX, NU> {
        &self.0[k]
    }
}

impl<const NX: usize, const NU: usize> Interval<NX, NU> for &Dense<NX, NU> {
    #[inline(always)]
    fn pull(&self, g: &[f64; NX]) -> ([f64; NX], [f64; NU]) {
        (combine(g, &self.a), combine(g, &self.b))
    }

    #[inline(always)]
    fn push(&self, dx: &[f64; NX], du: &[f64; NU]) -> [f64; NX] {
        from_fn(|i| dot(&self.a[i], dx) + dot(&self.b[i], du))
    }

    #[inline(always)]
    fn eliminate<C: Curvature<NX>, R: Curvature<NU>>(
        &self,
        stage: &Stage<C, R, NX, NU>,
        after: &[[f64; NX]; NX],
        before: &mut [[f64; NX]; NX],
        slope: &mut [f64; NX],
    ) -> Option<Feedback<NX, NU>> {
        add_times(after, &stage.defect, slope);
        let pulled = self.pull(slope);
        let Hessian { xx, ux, uu } = self.square(after, stage.share);
        *before = xx;
        stage.without_inputs(before, ux, uu, &pulled, slope)
    }

    #[inline(always)]
    fn curve(&self, share: f64, dx: &[f64; NX], du: &[f64; NU]) -> ([f64; NX], [f64; NU]) {
        let Hessian { xx, ux, uu } = &self.curvature;
        let crossed: [f64; NX] = combine(du, ux);
        let by_state = from_fn(|i| share * (dot(&xx[i], dx) + crossed[i]));
        let by_input = from_fn(|i| share * (dot(&ux[i], dx) + dot(&uu[i], du)));
        (by_state, by_input)
    }
}

#[inline(always)]
fn dot<const N: usize>(one: &[f64; N], other: &[f64; N]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// Adds a multiple of a row.
#[inline(always)]
pub fn add_multiple<const N: usize>(sum: &mut [f64; N], factor: f64, row: &[f64; N]) {
    for (entry, value) in sum.iter_mut().zip(row) {
        *entry += factor * value;
    }
}

/// The sum of rows, each times its factor.
#[inline(always)]
fn combine<const M: usize, const N: usize>(factors: &[f64; M], rows: &[[f64; N]; M]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (factor, row) in factors.iter().zip(rows) {
        add_multiple(&mut sum, *factor, row);
    }
    sum
}

// The triangular factors `L D L'` of a symmetric matrix with a row for each input.

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
                let row = rows[j];
                add_multiple(&mut rows[i], -self.lower[i][j], &row);
            }
        }
        rows
    }

    /// The inverse of `D`, times `rows`.
    #[inline(always)]
    pub(crate) fn scale<const W: usize>(&self, rows: &[[f64; W]; N]) -> [[f64; W]; N] {
        let mut scaled = *rows;
        for (row, inverse) in scaled.iter_mut().zip(&self.inverse) {
            for entry in row {
                *entry *= inverse;
            }
        }
        scaled
    }

    /// The inverse of `L'`, times `rows`.
    #[inline(always)]
    pub(crate) fn restore<const W: usize>(&self, mut rows: [[f64; W]; N]) -> [[f64; W]; N] {
        for i in (0..N).rev() {
            for j in i + 1..N {
                let row = rows[j];
                add_multiple(&mut rows[i], -self.lower[j][i], &row);
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;
    use proptest::prelude::*;

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
        fn val_nalgebra_eigenvalues_decide_which_matrices_are_rejected(root in matrix()) {
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
