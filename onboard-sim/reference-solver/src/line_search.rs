//! Finds the next iterate along a step.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::condense::Linearised;
use super::qp::QpSolution;
use nmpc::problem::{Condition, Problem};
use nmpc::rollout::Trajectory;

/// Fraction of the predicted decrease that a step must reach.
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Shortest fraction of a step that is tried.
const SHORTEST_STEP: f64 = 1.0 / 4096.0;

/// A full step this small (rad) is taken without a test: the merit's rounding error is larger than its possible
/// decrease.
const TINY_STEP_RAD: f64 = 1e-7;

/// Relative rounding error of the merit that a comparison allows.
const MERIT_ROUNDING: f64 = 1e-12;

/// An iterate: inputs and their path.
pub(super) struct Iterate {
    pub(super) inputs_rad: Vec<f64>,
    pub(super) trajectory: Trajectory,
    /// Cost plus the price of every broken condition.
    pub(super) merit: f64,
}

impl Iterate {
    pub(super) fn of(problem: &Problem, conditions: &[Condition], inputs_rad: Vec<f64>) -> Self {
        let trajectory = Trajectory::of(problem, &inputs_rad);
        let merit = trajectory.merit(conditions, problem.solver.terminal_penalty);
        Self { inputs_rad, trajectory, merit }
    }
}

/// The next iterate along the step and the fraction taken, or `None` if no fraction brings the merit far enough below
/// `reference`.
pub(super) fn line_search(
    problem: &Problem,
    conditions: &[Condition],
    linear: &Linearised,
    current: &Iterate,
    step: &QpSolution,
    reference: f64,
) -> Option<(Iterate, f64)> {
    let limit = problem.gimbal_limit_rad;
    let predicted = predicted_change(problem, conditions, linear, &step.step).min(0.0);
    let forgiven = MERIT_ROUNDING * reference.abs();
    let largest = step.step.iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
    let mut fraction = 1.0;
    while fraction >= SHORTEST_STEP {
        let inputs_rad = current
            .inputs_rad
            .iter()
            .zip(&step.step)
            .map(|(input, component)| snapped(input + fraction * component, limit))
            .collect();
        let candidate = Iterate::of(problem, conditions, inputs_rad);
        let wanted = reference + SUFFICIENT_DECREASE * fraction * predicted + forgiven;
        let full = fraction >= 1.0;
        if candidate.merit <= wanted || (full && largest <= TINY_STEP_RAD && candidate.merit.is_finite()) {
            return Some((candidate, fraction));
        }
        if full {
            let corrected = corrected(problem, conditions, linear, &candidate, &step.multipliers);
            if let Some(corrected) = corrected.filter(|corrected| corrected.merit <= wanted) {
                return Some((corrected, fraction));
            }
        }
        fraction *= 0.5;
    }
    None
}

/// A full step's candidate, moved back onto the curved conditions that it left (second-order correction), by the
/// smallest change of the free inputs that meets them to first order.
fn corrected(
    problem: &Problem,
    conditions: &[Condition],
    linear: &Linearised,
    candidate: &Iterate,
    multipliers: &[f64],
) -> Option<Iterate> {
    let price = problem.solver.terminal_penalty;
    let limit = problem.gimbal_limit_rad;
    let held: Vec<usize> = (0..conditions.len())
        .filter(|row| {
            let multiplier = multipliers[*row].abs();
            multiplier < price && (conditions[*row].equality || multiplier > 0.0)
        })
        .collect();
    let free: Vec<usize> =
        (0..candidate.inputs_rad.len()).filter(|j| candidate.inputs_rad[*j].abs() < limit).collect();
    let rows = DMatrix::from_fn(held.len(), free.len(), |i, j| linear.rows[(held[i], free[j])]);
    let missed = DVector::from_fn(held.len(), |i, _| conditions[held[i]].value(&candidate.trajectory.states));
    let change = -rows.transpose() * Cholesky::new(&rows * rows.transpose())?.solve(&missed);
    let mut inputs_rad = candidate.inputs_rad.clone();
    for (j, change) in free.iter().zip(change.iter()) {
        inputs_rad[*j] = snapped(inputs_rad[*j] + change, limit);
    }
    Some(Iterate::of(problem, conditions, inputs_rad))
}

/// Change of the merit along a whole step, to first order in the cost and the conditions.
fn predicted_change(problem: &Problem, conditions: &[Condition], linear: &Linearised, step: &[f64]) -> f64 {
    let cost: f64 = linear.gradient.iter().zip(step).map(|(slope, component)| slope * component).sum();
    let broken: f64 = conditions
        .iter()
        .enumerate()
        .map(|(index, condition)| {
            let value = linear.values[index];
            let moved: f64 =
                linear.rows.row(index).iter().zip(step).map(|(slope, component)| slope * component).sum();
            condition.violation(value + moved) - condition.violation(value)
        })
        .sum();
    cost + problem.solver.terminal_penalty * broken
}

/// An input within the limit, and exactly on it when an interior-point step ends just inside.
fn snapped(input_rad: f64, limit_rad: f64) -> f64 {
    const HAIR_RAD: f64 = 1e-8;
    if input_rad > limit_rad - HAIR_RAD {
        limit_rad
    } else if input_rad < HAIR_RAD - limit_rad {
        -limit_rad
    } else {
        input_rad
    }
}
