//! The Newton step by one backward and one forward sweep over the stages.
//!
//! ```text
//! minimise    sum over the nodes of (dx' W_k dx / 2 + s_k' dx)
//!             + (curvature and input terms of every interval)
//! subject to  dx_{k+1} = A_k dx_k + B_k du_k + r_k,   dx_0 = 0
//! ```
//!
//! The value function of the stages from `k` on is `dx' P dx / 2 + p' dx`. It contains the
//! conditions with the stiffness of their barrier. So `P` loses digits across the conditions, but
//! only the curvature along them is needed. The costates come from their own recursion, which does
//! not use `P`.
//!
//! The system has the right inertia exactly if `B' P B` plus the inputs' curvature is positive
//! definite at every stage ([`Factor`](crate::Factor)).
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

use alloc::vec::Vec;
use core::array::from_fn;
use pulp::{Arch, Simd, WithSimd};

use crate::intervals::{Curvature, Feedback, Interval, Intervals, Stage, add_times, slope_before};
use crate::iterate::Iterate;
use crate::model::Model;

/// The Newton step and its data.
#[derive(Debug, Clone)]
pub(crate) struct Sweep<M: Model<NX, NU>, const NX: usize, const NU: usize> {
    /// Second derivative of the objective at each node.
    pub(crate) curvatures: Vec<M::StateCurvature>,
    /// First derivative of the objective at each node.
    pub(crate) slopes: Vec<[f64; NX]>,
    /// Second and first derivative of the objective by each interval's inputs.
    pub(crate) input_terms: Vec<(M::InputCurvature, [f64; NU])>,
    feedbacks: Vec<Feedback<NX, NU>>,
    /// `P` of each node.
    values: Vec<[[f64; NX]; NX]>,
    /// Change of each state.
    pub(crate) states: Vec<[f64; NX]>,
    /// Change of each interval's inputs.
    pub(crate) inputs: Vec<[f64; NU]>,
    /// The costates after the step.
    pub(crate) costates: Vec<[f64; NX]>,
    /// Fraction of the dynamics' curvature in the step.
    share: f64,
}

empty!(Sweep { curvatures, slopes, input_terms, feedbacks, values, states, inputs, costates, share });

/// One of the sweeps, in the widest vectors that the machine has.
struct Wide<'a, M: Model<NX, NU>, const NX: usize, const NU: usize, const SWEEP: u8> {
    sweep: &'a mut Sweep<M, NX, NU>,
    iterate: &'a Iterate<M, NX, NU>,
}

const BACKWARD: u8 = 0;
const BACKWARD_AGAIN: u8 = 1;
const FORWARD: u8 = 2;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize, const SWEEP: u8> WithSimd
    for Wide<'_, M, NX, NU, SWEEP>
{
    /// Whether the inertia is right.
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        match SWEEP {
            BACKWARD => return self.sweep.eliminate(self.iterate),
            BACKWARD_AGAIN => self.sweep.eliminate_again(self.iterate),
            _ => self.sweep.substitute(self.iterate),
        }
        true
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Sweep<M, NX, NU> {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(crate) fn resize(&mut self, intervals: usize) {
        self.curvatures.resize(intervals + 1, M::StateCurvature::ZERO);
        self.slopes.resize(intervals + 1, [0.0; NX]);
        self.input_terms.resize(intervals, (M::InputCurvature::ZERO, [0.0; NU]));
        self.feedbacks.resize(intervals, Feedback::ZERO);
        self.values.resize(intervals + 1, [[0.0; NX]; NX]);
        self.states.resize(intervals + 1, [0.0; NX]);
        self.inputs.resize(intervals, [0.0; NU]);
        self.costates.resize(intervals + 1, [0.0; NX]);
    }

    /// Sets the derivatives of the objective to those of the cost.
    pub(crate) fn set_cost(&mut self, model: &M, iterate: &Iterate<M, NX, NU>) {
        for (node, state) in iterate.states.iter().enumerate() {
            self.curvatures[node] = model.state_curvature(node, state);
            self.slopes[node] = model.state_slope(node, state);
        }
        for (k, input) in iterate.inputs.iter().enumerate() {
            self.input_terms[k] = (model.input_curvature(k, input), model.input_slope(k, input));
        }
    }

    /// The backward sweep with a fraction of the dynamics' curvature; returns whether the inertia
    /// is right.
    pub(crate) fn backward(&mut self, iterate: &Iterate<M, NX, NU>, share: f64) -> bool {
        self.share = share;
        Arch::new().dispatch(Wide::<_, _, _, BACKWARD> { sweep: self, iterate })
    }

    /// The backward sweep for new slopes and defects with the second derivatives of the last sweep.
    pub(crate) fn backward_again(&mut self, iterate: &Iterate<M, NX, NU>) {
        Arch::new().dispatch(Wide::<_, _, _, BACKWARD_AGAIN> { sweep: self, iterate });
    }

    /// The forward sweep: states, inputs, and then the costates, backwards again.
    pub(crate) fn forward(&mut self, iterate: &Iterate<M, NX, NU>) {
        Arch::new().dispatch(Wide::<_, _, _, FORWARD> { sweep: self, iterate });
    }
}

// The backward sweeps.

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Sweep<M, NX, NU> {
    /// [`backward`](Self::backward) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(crate) fn eliminate(&mut self, iterate: &Iterate<M, NX, NU>) -> bool {
        let count = self.inputs.len();
        self.values[count] = [[0.0; NX]; NX];
        self.curvatures[count].add_to(&mut self.values[count]);
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
            let Some(feedback) = interval.eliminate(&stage, &after[0], &mut before[k], &mut slope) else {
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
            add_times(&self.values[k + 1], &residual, &mut g);
            let (pulled_x, pulled_u) = interval.pull(&g);
            // The correction for the dynamics' change since then, because their first derivatives
            // are the old ones, too.
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

// The forward sweep.

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

#[cfg(test)]
mod tests;
