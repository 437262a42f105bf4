//! The quadratic part of the value function, split where its vectors are.
#![expect(clippy::inline_always, reason = "inlined into the sweeps, to be compiled for their vectors")]

use stages::{Curvature, Value};

use super::lanes::Lanes;

/// A symmetric matrix over the states: for each state its entries by x, by z, and by theta, u, w and q.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    pub(super) x: [f64; 6],
    pub(super) z: [f64; 6],
    pub(super) rest: [Lanes; 6],
}

impl Split {
    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> [f64; 6] {
        let [theta, u, w, q] = self.rest[i].0;
        [self.x[i], self.z[i], theta, u, w, q]
    }
}

impl Value<6> for Split {
    const ZERO: Self = Self { x: [0.0; 6], z: [0.0; 6], rest: [Lanes::ZERO; 6] };

    #[inline(always)]
    fn add<C: Curvature<6>>(&mut self, curvature: &C) {
        let mut whole = core::array::from_fn(|i| self.row(i));
        curvature.add_to(&mut whole);
        for (i, [x, z, rest @ ..]) in whole.into_iter().enumerate() {
            (self.x[i], self.z[i], self.rest[i]) = (x, z, Lanes(rest));
        }
    }

    #[inline(always)]
    fn add_times(&self, vector: &[f64; 6], sum: &mut [f64; 6]) {
        for (i, value) in vector.iter().enumerate() {
            for (entry, column) in sum.iter_mut().zip(&self.row(i)) {
                *entry += column * value;
            }
        }
    }
}
