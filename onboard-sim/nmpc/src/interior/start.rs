//! The start of a solve: cold, from an earlier solution, or again with a larger barrier.

use core::f64::consts::PI;

use super::barrier::{Elastic, Limits};
use super::iterate::Iterate;
use crate::problem::Condition;
use crate::{Problem, WarmStart};

/// A cold start: states on the straight line from the start to the target, the pitch bent by
/// `amplitude sin(m pi k / N)`. The vehicle tilts one way and then the other, which wastes surplus thrust and ends
/// upright. The path need not be flyable. Inputs and costates are zero, so the first Hessian is that of Gauss and
/// Newton.
pub(super) fn cold(
    problem: &Problem,
    conditions: &[Condition],
    amplitude_rad: f64,
    barrier: f64,
    start: &mut Iterate,
) {
    let count = problem.intervals();
    let half_waves = f64::from(problem.solver.guess_half_waves);
    let from = problem.initial.to_array();
    let to = problem.target.to_array();
    for (k, state) in start.states.iter_mut().enumerate() {
        let share = k as f64 / count as f64;
        *state = core::array::from_fn(|i| from[i] + share * (to[i] - from[i]));
        if k > 0 {
            state[2] += amplitude_rad * libm::sin(half_waves * PI * share);
        }
    }
    start.inputs_rad.fill(0.0);
    start.costates.fill([0.0; 6]);
    start.limits.fill(Limits::central(0.0, problem.gimbal_limit_rad, barrier));
    let price = problem.solver.terminal_penalty;
    for (elastic, condition) in start.elastics.iter_mut().zip(conditions) {
        *elastic = Elastic::central(condition.value(&start.states), condition.equality, price, barrier);
    }
}

/// A start from an earlier solution, shifted to the present. All states except the first stay the same. So the
/// difference between the expected and the present state becomes one defect, and no limit or condition jumps. If
/// states, costates or limit multipliers are missing or not finite, the inputs are rolled out. Returns whether all were
/// there.
pub(super) fn warm(
    problem: &Problem,
    conditions: &[Condition],
    warm: &WarmStart,
    barrier: f64,
    start: &mut Iterate,
) -> bool {
    let limit = problem.gimbal_limit_rad;
    let price = problem.solver.terminal_penalty;
    let count = problem.intervals();
    start.states[0] = problem.initial.to_array();
    for (input, from) in start.inputs_rad.iter_mut().zip(&warm.inputs_rad) {
        *input = if from.is_finite() { within(*from, limit) } else { 0.0 };
    }
    let complete = warm.states.len() == count + 1
        && warm.costates.len() == count + 1
        && warm.limit_multipliers.len() == count
        && warm.states.iter().all(crate::dynamics::PlanarState::is_finite)
        && warm.costates.iter().flatten().all(|value| value.is_finite())
        && warm.limit_multipliers.iter().flatten().all(|value| value.is_finite() && *value > 0.0);
    if complete {
        for (state, from) in start.states.iter_mut().zip(&warm.states).skip(1) {
            *state = from.to_array();
        }
        start.costates.copy_from_slice(&warm.costates);
        for (limits, [lower, upper]) in start.limits.iter_mut().zip(&warm.limit_multipliers) {
            *limits = Limits { lower: *lower, upper: *upper };
        }
    } else {
        start.roll_out(problem);
        start.costates.fill([0.0; 6]);
        for (limits, input) in start.limits.iter_mut().zip(&start.inputs_rad) {
            *limits = Limits::central(*input, limit, barrier);
        }
    }
    // A horizon too short for all settled nodes has fewer conditions at its end than the earlier solution had.
    let none = core::iter::repeat(&0.0);
    let ends = warm.end_multipliers.iter().chain(none.clone()).take(problem.end_conditions_len());
    let known = ends.chain(warm.floor_multipliers.iter().chain(none));
    let known = known.map(|value| if value.is_finite() { *value } else { 0.0 });
    for ((elastic, condition), multiplier) in start.elastics.iter_mut().zip(conditions).zip(known) {
        let value = condition.value(&start.states);
        *elastic = Elastic::warm(value, multiplier, condition.equality, price, barrier);
    }
    complete
}

/// The same states with slacks and multipliers raised to a larger barrier, because too many limits and conditions
/// change sides for the old one.
pub(super) fn raise(problem: &Problem, conditions: &[Condition], barrier: f64, start: &mut Iterate) {
    let limit = problem.gimbal_limit_rad;
    for (input, limits) in start.inputs_rad.iter_mut().zip(&mut start.limits) {
        *input = limits.raise(*input, limit, barrier);
    }
    for (elastic, condition) in start.elastics.iter_mut().zip(conditions) {
        *elastic = elastic.raised(condition.value(&start.states), barrier);
    }
}

/// An input strictly within its limits.
fn within(input_rad: f64, limit_rad: f64) -> f64 {
    const HAIR: f64 = 1e-14;
    let largest = limit_rad * (1.0 - HAIR);
    input_rad.clamp(-largest, largest)
}
