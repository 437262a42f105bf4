//! The quadratic part of the value function of the backward sweep.
#![expect(clippy::inline_always, reason = "inlined into the sweeps, to be compiled for their vectors")]

use core::fmt::Debug;

use crate::curvature::Curvature;

/// A symmetric matrix over the states, in the order in which a model's [`eliminate`](crate::Interval::eliminate) reads it
/// fastest. `[[f64; N]; N]` is it row by row.
pub trait Value<const NX: usize>: Copy + Debug {
    const ZERO: Self;

    /// Adds a second derivative of the cost.
    fn add<C: Curvature<NX>>(&mut self, curvature: &C);

    /// Adds the product with a vector to `sum`.
    fn add_times(&self, vector: &[f64; NX], sum: &mut [f64; NX]);
}

impl<const NX: usize> Value<NX> for [[f64; NX]; NX] {
    const ZERO: Self = [[0.0; NX]; NX];

    #[inline(always)]
    fn add<C: Curvature<NX>>(&mut self, curvature: &C) {
        curvature.add_to(self);
    }

    #[inline(always)]
    fn add_times(&self, vector: &[f64; NX], sum: &mut [f64; NX]) {
        for (row, value) in self.iter().zip(vector) {
            for (entry, column) in sum.iter_mut().zip(row) {
                *entry += column * value;
            }
        }
    }
}
