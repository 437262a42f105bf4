//! Second derivatives of the cost: only the diagonal, or the whole matrix.
#![expect(clippy::inline_always, reason = "fixed-size kernels of a few dozen instructions")]

use core::array::from_fn;
use core::fmt::Debug;

/// The second derivative of a cost by `N` variables. `[f64; N]` is a diagonal, `[[f64; N]; N]` a whole symmetric
/// matrix.
pub trait Curvature<const N: usize>: Copy + Debug {
    const ZERO: Self;

    /// An entry of the diagonal.
    fn diagonal(&self, i: usize) -> f64;

    /// Adds to an entry of the diagonal.
    fn add_to_diagonal(&mut self, i: usize, value: f64);

    /// Adds all entries to a matrix.
    fn add_to(&self, sum: &mut [[f64; N]; N]);

    /// The product with a vector.
    fn times(&self, vector: &[f64; N]) -> [f64; N];
}

impl<const N: usize> Curvature<N> for [f64; N] {
    const ZERO: Self = [0.0; N];

    #[inline(always)]
    fn diagonal(&self, i: usize) -> f64 {
        self[i]
    }

    #[inline(always)]
    fn add_to_diagonal(&mut self, i: usize, value: f64) {
        self[i] += value;
    }

    #[inline(always)]
    fn add_to(&self, sum: &mut [[f64; N]; N]) {
        for i in 0..N {
            sum[i][i] += self[i];
        }
    }

    #[inline(always)]
    fn times(&self, vector: &[f64; N]) -> [f64; N] {
        from_fn(|i| self[i] * vector[i])
    }
}

impl<const N: usize> Curvature<N> for [[f64; N]; N] {
    const ZERO: Self = [[0.0; N]; N];

    #[inline(always)]
    fn diagonal(&self, i: usize) -> f64 {
        self[i][i]
    }

    #[inline(always)]
    fn add_to_diagonal(&mut self, i: usize, value: f64) {
        self[i][i] += value;
    }

    #[inline(always)]
    fn add_to(&self, sum: &mut [[f64; N]; N]) {
        for (row, own) in sum.iter_mut().zip(self) {
            for (entry, value) in row.iter_mut().zip(own) {
                *entry += value;
            }
        }
    }

    #[inline(always)]
    fn times(&self, vector: &[f64; N]) -> [f64; N] {
        from_fn(|i| self[i].iter().zip(vector).map(|(entry, value)| entry * value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagonal_acts_like_the_whole_matrix_with_it() {
        let (mut diagonal, mut whole) = ([2.0, -3.0], [[2.0, 0.0], [0.0, -3.0]]);
        diagonal.add_to_diagonal(1, 0.5);
        whole.add_to_diagonal(1, 0.5);
        let (mut one, mut other) = ([[1.0; 2]; 2], [[1.0; 2]; 2]);
        diagonal.add_to(&mut one);
        whole.add_to(&mut other);
        let numbers =
            |sum: [[f64; 2]; 2], product: [f64; 2], entry: f64| vec![sum[0], sum[1], product, [entry; 2]];
        assert_eq!(
            numbers(one, diagonal.times(&[1.0, 4.0]), diagonal.diagonal(1)),
            numbers(other, whole.times(&[1.0, 4.0]), whole.diagonal(1))
        );
    }
}
