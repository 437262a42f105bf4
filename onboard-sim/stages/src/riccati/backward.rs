//! The backward sweeps.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use core::array::from_fn;

use super::{Factor, Feedback, Sweep};
use crate::curvature::Curvature;
use crate::intervals::{Hessian, Interval, Intervals};
use crate::iterate::Iterate;
use crate::model::Model;

/// Smallest curvature by an input that counts as positive, relative to the input's own terms.
const LEAST_CURVATURE: f64 = 1e-11;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Sweep<M, NX, NU> {
    /// [`backward`](Self::backward) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(crate) fn eliminate(&mut self, iterate: &Iterate<M, NX, NU>) -> bool {
        let count = self.inputs.len();
        let mut p = [[0.0; NX]; NX];
        self.curvatures[count].add_to(&mut p);
        let mut slope = self.slopes[count];

        for k in (0..count).rev() {
            let interval = iterate.intervals.interval(k);
            let residual = iterate.defect(k);
            self.values[k] = p;
            let mut g = slope;
            for j in 0..NX {
                for i in 0..NX {
                    g[i] += p[j][i] * residual[j];
                }
            }
            let (pulled_x, pulled_u) = interval.pull(&g);
            let Hessian { xx: mut next, ux, mut uu } = interval.square(&p, self.share);
            let (own_curvature, own_slope) = &self.input_terms[k];
            own_curvature.add_to(&mut uu);
            let least = from_fn(|i| LEAST_CURVATURE * (1.0 + own_curvature.diagonal(i)));
            let Some(factor) = Factor::of(uu, &least) else {
                return false;
            };
            let reduced = factor.reduce(ux);
            let scaled = factor.scale(&reduced);
            let push = factor.scale(&factor.reduce(from_fn(|i| [own_slope[i] + pulled_u[i]])));
            let offset = factor.restore(push).map(|[value]| value);
            self.feedbacks[k] = Feedback { gain: factor.restore(scaled), offset, reduced, factor };
            if k == 0 {
                break;
            }

            for (scaled, reduced) in scaled.iter().zip(&reduced) {
                for i in 0..NX {
                    for j in 0..NX {
                        next[i][j] -= scaled[i] * reduced[j];
                    }
                }
            }
            self.curvatures[k].add_to(&mut next);
            p = next;
            slope = before(&self.slopes[k], &pulled_x, &reduced, &push);
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
            for (row, gap) in self.values[k].iter().zip(&residual) {
                for (sum, entry) in g.iter_mut().zip(row) {
                    *sum += entry * gap;
                }
            }
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
            slope = before(slopes, &pulled_x, reduced, &push);
        }
    }
}

/// Slope of the value function before an interval, with its inputs eliminated.
#[inline(always)]
fn before<const NX: usize, const NU: usize>(
    slopes: &[f64; NX],
    pulled: &[f64; NX],
    reduced: &[[f64; NX]; NU],
    push: &[[f64; 1]; NU],
) -> [f64; NX] {
    let mut slope = from_fn(|i| slopes[i] + pulled[i]);
    for (row, [push]) in reduced.iter().zip(push) {
        for (entry, value) in slope.iter_mut().zip(row) {
            *entry -= value * push;
        }
    }
    slope
}
