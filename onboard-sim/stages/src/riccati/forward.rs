//! The forward sweep.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use core::array::from_fn;

use super::Sweep;
use crate::curvature::Curvature;
use crate::intervals::{Interval, Intervals};
use crate::iterate::Iterate;
use crate::model::Model;
use crate::stage::Feedback;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Sweep<M, NX, NU> {
    /// [`forward`](Self::forward) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(crate) fn substitute(&mut self, iterate: &Iterate<M, NX, NU>) {
        let count = self.inputs.len();
        let mut dx = [0.0; NX];
        self.states[0] = dx;
        for k in 0..count {
            let Feedback { gain, offset, .. } = &self.feedbacks[k];
            let du = from_fn(|i| -(offset[i] + dot(&gain[i], &dx)));
            let moved = iterate.intervals.interval(k).push(&dx, &du);
            let residual = iterate.defect(k);
            dx = from_fn(|i| moved[i] + residual[i]);
            self.inputs[k] = du;
            self.states[k + 1] = dx;
        }

        let bent = self.curvatures[count].times(&dx);
        let mut costate = from_fn(|i| self.slopes[count][i] + bent[i]);
        self.costates[count] = costate;
        for k in (1..count).rev() {
            let interval = iterate.intervals.interval(k);
            let (dx, du) = (&self.states[k], &self.inputs[k]);
            let (mut before, _) = interval.pull(&costate);
            let (turned, _) = interval.curve(self.share, dx, du);
            for i in M::Intervals::INTEGRALS..NX {
                before[i] += turned[i];
            }
            let bent = self.curvatures[k].times(dx);
            costate = from_fn(|i| before[i] + self.slopes[k][i] + bent[i]);
            self.costates[k] = costate;
        }
    }

    /// The change of the states by the defects alone, without a change of the inputs.
    pub(crate) fn drift(&self, iterate: &Iterate<M, NX, NU>, drifts: &mut [[f64; NX]]) {
        let mut dx = [0.0; NX];
        for (k, drift) in drifts.iter_mut().enumerate() {
            *drift = dx;
            if k == self.inputs.len() {
                break;
            }
            let moved = iterate.intervals.interval(k).push(&dx, &[0.0; NU]);
            let residual = iterate.defect(k);
            dx = from_fn(|i| moved[i] + residual[i]);
        }
    }

    /// The optimality residuals of the inputs of interval `k` after the step: only rounding, unless the sweeps are
    /// wrong.
    #[cfg(test)]
    pub(crate) fn input_residual(&self, iterate: &Iterate<M, NX, NU>, k: usize) -> [f64; NU] {
        let interval = iterate.intervals.interval(k);
        let (_, turned) = interval.curve(self.share, &self.states[k], &self.inputs[k]);
        let (_, pulled) = interval.pull(&self.costates[k + 1]);
        let (curvature, slope) = &self.input_terms[k];
        let bent = curvature.times(&self.inputs[k]);
        from_fn(|i| bent[i] + slope[i] + turned[i] + pulled[i])
    }
}

/// The sum of the products, added up in pairs.
#[inline(always)]
fn dot<const N: usize>(one: &[f64; N], other: &[f64; N]) -> f64 {
    let product = |i: usize| one[i] * other[i];
    let mut sum = if N > 1 { product(0) + product(1) } else { product(0) };
    let mut i = 2;
    while i + 1 < N {
        sum += product(i) + product(i + 1);
        i += 2;
    }
    if i < N {
        sum += product(i);
    }
    sum
}
