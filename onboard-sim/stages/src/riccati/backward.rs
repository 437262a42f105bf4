//! The backward sweeps.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use core::array::from_fn;

use pulp::Simd;

use super::Sweep;
use crate::intervals::{Interval, Intervals};
use crate::iterate::Iterate;
use crate::model::Model;
use crate::stage::{Feedback, Stage, slope_before};
use crate::value::Value;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Sweep<M, NX, NU> {
    /// [`backward`](Self::backward) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(crate) fn eliminate<S: Simd>(&mut self, simd: S, iterate: &Iterate<M, NX, NU>) -> bool {
        let count = self.inputs.len();
        let mut value = <M::Intervals as Intervals<NX, NU>>::Value::ZERO;
        value.add(&self.curvatures[count]);
        self.values[count] = value;
        let mut slope = self.slopes[count];

        for k in (0..count).rev() {
            let (curvature, input_slope) = &self.input_terms[k];
            let stage = Stage {
                defect: iterate.defect(k),
                share: self.share,
                state_terms: (&self.curvatures[k], &self.slopes[k]),
                input_terms: (curvature, input_slope),
            };
            let (before, after) = self.values.split_at_mut(k + 1);
            let interval = iterate.intervals.interval(k);
            let Some(feedback) = interval.eliminate(simd, &stage, &after[0], &mut before[k], &mut slope)
            else {
                return false;
            };
            self.feedbacks[k] = feedback;
        }
        true
    }

    /// [`backward_again`](Self::backward_again) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(crate) fn eliminate_again(&mut self, iterate: &Iterate<M, NX, NU>) {
        let count = self.inputs.len();
        let mut slope = self.slopes[count];
        for k in (0..count).rev() {
            let interval = iterate.intervals.interval(k);
            let residual = iterate.defect(k);
            let mut g = slope;
            self.values[k + 1].add_times(&residual, &mut g);
            let (pulled_x, pulled_u) = interval.pull(&g);
            // The correction for the dynamics' change since then, because their first derivatives are the old ones,
            // too.
            let costate = &iterate.costates[k + 1];
            let (now_x, now_u) = iterate.intervals.pulled(k, costate);
            let (old_x, old_u) = interval.pull(costate);
            let slopes = &mut self.slopes[k];
            for i in M::Intervals::INTEGRALS..NX {
                slopes[i] += now_x[i] - old_x[i];
            }
            let own_slope = &mut self.input_terms[k].1;
            for i in 0..NU {
                own_slope[i] += now_u[i] - old_u[i];
            }
            let Feedback { factor, reduced, offset, .. } = &mut self.feedbacks[k];
            let push = factor.scale(&factor.reduce(from_fn(|i| [own_slope[i] + pulled_u[i]])));
            *offset = factor.restore(push).map(|[value]| value);
            slope = slope_before(slopes, &pulled_x, reduced, &push);
        }
    }
}
