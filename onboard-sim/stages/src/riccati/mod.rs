//! The Newton step by one backward and one forward sweep over the stages.
//!
//! ```text
//! minimise    sum over the nodes of (dx' W_k dx / 2 + s_k' dx) + (curvature and input terms of every interval)
//! subject to  dx_{k+1} = A_k dx_k + B_k du_k + r_k,   dx_0 = 0
//! ```
//!
//! The value function of the stages from `k` on is `dx' P dx / 2 + p' dx`. It contains the conditions with the
//! stiffness of their barrier. So `P` loses digits across the conditions, but only the curvature along them is needed.
//! The costates come from their own recursion, which does not use `P`.
//!
//! The system has the right inertia exactly if `B' P B` plus the inputs' own curvature is positive definite at every
//! stage ([`Factor`](crate::Factor)).
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

mod backward;
mod forward;

use alloc::vec::Vec;

use pulp::{Arch, Simd, WithSimd};

use crate::curvature::Curvature;
use crate::intervals::Intervals;
use crate::iterate::Iterate;
use crate::model::Model;
use crate::stage::Feedback;
use crate::value::Value;

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
    values: Vec<<M::Intervals as Intervals<NX, NU>>::Value>,
    /// Change of each state.
    pub(crate) states: Vec<[f64; NX]>,
    /// Change of each interval's inputs.
    pub(crate) inputs: Vec<[f64; NU]>,
    /// The costates after the step.
    pub(crate) costates: Vec<[f64; NX]>,
    /// Fraction of the dynamics' curvature in the step.
    share: f64,
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Default for Sweep<M, NX, NU> {
    fn default() -> Self {
        Self {
            curvatures: Vec::new(),
            slopes: Vec::new(),
            input_terms: Vec::new(),
            feedbacks: Vec::new(),
            values: Vec::new(),
            states: Vec::new(),
            inputs: Vec::new(),
            costates: Vec::new(),
            share: 0.0,
        }
    }
}

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
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        match SWEEP {
            BACKWARD => return self.sweep.eliminate(simd, self.iterate),
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
        self.values.resize(intervals + 1, Value::ZERO);
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

    /// The backward sweep with a fraction of the dynamics' curvature; returns whether the inertia is right.
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
