//! The start of a solve: cold, from an earlier solution, or again with a larger barrier.

use crate::barrier::{Elastic, Limits};
use crate::condition::Condition;
use crate::iterate::Iterate;
use crate::model::Model;

/// An earlier solution, shifted to the present. Inputs alone are enough; they are then rolled out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start<'a, const NX: usize, const NU: usize> {
    /// The states, one more than inputs; empty if unknown.
    pub states: &'a [[f64; NX]],
    /// The inputs of each interval. Another number than that of the intervals makes a cold solve.
    pub inputs: &'a [[f64; NU]],
    /// Multiplier of the dynamics into each node, one more than inputs, the first unused; empty if unknown.
    pub costates: &'a [[f64; NX]],
    /// Multipliers of the lower and upper limit of each interval's inputs; empty if unknown.
    pub limit_multipliers: &'a [[[f64; 2]; NU]],
    /// Multiplier of each condition; those left out are zero.
    pub condition_multipliers: &'a [f64],
}

/// A cold start from the model's guess. Costates are zero, so the first Hessian is that of Gauss and Newton.
pub(crate) fn cold<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    conditions: &[Condition],
    index: usize,
    barrier: f64,
    start: &mut Iterate<M, NX, NU>,
) {
    model.guess(index, &mut start.states, &mut start.inputs);
    start.costates.fill([0.0; NX]);
    start.centre_limits(model, barrier);
    let price = model.settings().price;
    for (elastic, condition) in start.elastics.iter_mut().zip(conditions) {
        *elastic = Elastic::central(condition.value(&start.states), condition.equality, price, barrier);
    }
}

/// A start from an earlier solution, shifted to the present. All states except the first stay the same. So the
/// difference between the expected and the present state becomes one defect, and no limit or condition jumps. If
/// states, costates or limit multipliers are missing or not finite, the inputs are rolled out. Returns whether all were
/// there.
pub(crate) fn warm<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    conditions: &[Condition],
    warm: &Start<NX, NU>,
    barrier: f64,
    start: &mut Iterate<M, NX, NU>,
) -> bool {
    let ranges = model.input_ranges();
    let price = model.settings().price;
    let count = model.intervals();
    start.states[0] = model.initial();
    for (inputs, from) in start.inputs.iter_mut().zip(warm.inputs) {
        for i in 0..NU {
            inputs[i] = ranges[i].within(if from[i].is_finite() { from[i] } else { 0.0 });
        }
    }
    let complete = warm.states.len() == count + 1
        && warm.costates.len() == count + 1
        && warm.limit_multipliers.len() == count
        && warm.states.as_flattened().iter().all(|value| value.is_finite())
        && warm.costates.as_flattened().iter().all(|value| value.is_finite())
        && warm.limit_multipliers.iter().flatten().flatten().all(|value| value.is_finite() && *value > 0.0);
    if complete {
        start.states[1..].copy_from_slice(&warm.states[1..]);
        start.costates.copy_from_slice(warm.costates);
        for (limits, multipliers) in start.limits.iter_mut().zip(warm.limit_multipliers) {
            *limits = multipliers.map(|[lower, upper]| Limits { lower, upper });
        }
    } else {
        start.roll_out(model);
        start.costates.fill([0.0; NX]);
        start.centre_limits(model, barrier);
    }
    let known = warm.condition_multipliers.iter().chain(core::iter::repeat(&0.0));
    let known = known.map(|value| if value.is_finite() { *value } else { 0.0 });
    for ((elastic, condition), multiplier) in start.elastics.iter_mut().zip(conditions).zip(known) {
        let value = condition.value(&start.states);
        *elastic = Elastic::warm(value, multiplier, condition.equality, price, barrier);
    }
    complete
}

/// The same states with slacks and multipliers raised to a larger barrier, because too many limits and conditions
/// change sides for the old one.
pub(crate) fn raise<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    conditions: &[Condition],
    barrier: f64,
    start: &mut Iterate<M, NX, NU>,
) {
    let ranges = model.input_ranges();
    for (inputs, limits) in start.inputs.iter_mut().zip(&mut start.limits) {
        for i in 0..NU {
            inputs[i] = limits[i].raise(inputs[i], &ranges[i], barrier);
        }
    }
    for (elastic, condition) in start.elastics.iter_mut().zip(conditions) {
        *elastic = elastic.raised(condition.value(&start.states), barrier);
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Iterate<M, NX, NU> {
    /// Puts the limits' multipliers on the central path.
    fn centre_limits(&mut self, model: &M, barrier: f64) {
        let ranges = model.input_ranges();
        for (limits, input) in self.limits.iter_mut().zip(&self.inputs) {
            for i in 0..NU {
                limits[i] = Limits::central(input[i], &ranges[i], barrier);
            }
        }
    }
}
