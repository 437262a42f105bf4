//! The main loop: Newton on the optimality conditions from bent initial guesses, globalised by a line search on the exact
//! penalty.

use core::f64::consts::PI;

use nalgebra::{Cholesky, DMatrix, DVector};
use nmpc::dynamics::PlanarState;
use nmpc::problem::Condition;
use nmpc::rollout::Trajectory;
use nmpc::{Problem, Solution, SolveStatus, WarmStart};

use super::linearised::Linearised;
use super::subproblem::{ActiveSet, Place, Qp, QpRow, QpSolution, Role, convexified, polished};

/// A new iterate must have a lower merit than the worst of this many iterates. A full Newton step along a curved
/// condition raises the penalty briefly, and its refusal would cost many short steps.
const MEMORY: usize = 4;

/// A subproblem leaves out inequalities that hold by more than this (SI, radians).
const WINDOW: f64 = 3.0;

/// Residuals of the optimality conditions.
#[derive(Clone, Copy)]
struct Residual {
    stationarity: f64,
    feasibility: f64,
}

/// Solves from given inputs and multipliers; missing multipliers count as zero.
pub(super) fn solve_from(problem: &Problem, warm: &WarmStart) -> Solution {
    let conditions = problem.conditions();
    let ends = problem.end_conditions_len();
    let limit = problem.gimbal_limit_rad;
    let start = warm
        .inputs_rad
        .iter()
        .map(|gimbal_rad| if gimbal_rad.is_finite() { gimbal_rad.clamp(-limit, limit) } else { 0.0 })
        .collect();
    let mut current = Iterate::of(problem, &conditions, start);
    let mut multipliers = fitted(&warm.end_multipliers, ends);
    multipliers.extend(fitted(&warm.floor_multipliers, conditions.len() - ends));
    let mut recent = vec![current.merit];
    let mut best: Option<(f64, Solution)> = None;
    let mut qp_iterations = 0;
    let mut iterations = 0;

    let status = loop {
        if !current.merit.is_finite() {
            break SolveStatus::BadInput;
        }
        let linear = Linearised::about(problem, &conditions, &current.trajectory, &current.inputs_rad);
        let residual = residual(problem, &conditions, &linear, &multipliers, &current.inputs_rad);
        let tolerance = problem.solver.kkt_tolerance;
        let converged = residual.stationarity <= tolerance && residual.feasibility <= tolerance;
        if converged || best.as_ref().is_none_or(|(merit, _)| current.merit < *merit) {
            best = Some((current.merit, solution_of(&conditions, ends, &current, &multipliers, residual)));
        }
        if converged {
            break SolveStatus::Converged;
        }
        if iterations >= problem.solver.max_iterations {
            break SolveStatus::IterationLimit;
        }
        iterations += 1;

        let Some(step) = subproblem(problem, &conditions, &linear, &multipliers, &current.inputs_rad) else {
            break SolveStatus::SubproblemFailed;
        };
        qp_iterations += step.iterations;
        let reference = recent.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let Some((next, fraction)) = line_search(problem, &conditions, &linear, &current, &step, reference)
        else {
            break SolveStatus::Stalled;
        };
        for (multiplier, target) in multipliers.iter_mut().zip(&step.multipliers) {
            *multiplier += fraction * (target - *multiplier);
        }
        current = next;
        recent.push(current.merit);
        if recent.len() > MEMORY {
            recent.remove(0);
        }
    };
    match best {
        Some((_, best)) => Solution { status, iterations, qp_iterations, ..best },
        None => Solution { status, ..Solution::default() },
    }
}

/// Finite multipliers of the wanted number.
fn fitted(multipliers: &[f64], count: usize) -> Vec<f64> {
    (0..count)
        .map(|row| multipliers.get(row).copied().filter(|value| value.is_finite()).unwrap_or(0.0))
        .collect()
}

fn solution_of(
    conditions: &[Condition],
    ends: usize,
    iterate: &Iterate,
    multipliers: &[f64],
    residual: Residual,
) -> Solution {
    let (end_multipliers, floor_multipliers) = multipliers.split_at(ends);
    Solution {
        cost: iterate.trajectory.cost,
        merit: iterate.merit,
        kkt_stationarity: residual.stationarity,
        kkt_feasibility: residual.feasibility,
        condition_miss: iterate.trajectory.worst_violation(conditions),
        states: iterate.trajectory.states.iter().map(|state| PlanarState::from_array(*state)).collect(),
        inputs_rad: iterate.inputs_rad.clone(),
        end_multipliers: end_multipliers.to_vec(),
        floor_multipliers: floor_multipliers.to_vec(),
        ..Solution::default()
    }
}

/// How far an iterate and its multipliers are from optimal.
fn residual(
    problem: &Problem,
    conditions: &[Condition],
    linear: &Linearised,
    multipliers: &[f64],
    inputs_rad: &[f64],
) -> Residual {
    let limit = problem.gimbal_limit_rad;
    let stationarity = linear
        .lagrangian_gradient(multipliers)
        .iter()
        .zip(inputs_rad)
        .map(|(slope, input)| if pushes_out(*slope, *input, limit) { 0.0 } else { slope.abs() })
        .fold(0.0, f64::max);
    let penalty = problem.solver.terminal_penalty;
    let feasibility = conditions
        .iter()
        .zip(&linear.values)
        .zip(multipliers)
        .map(|((condition, value), multiplier)| match Role::of(condition.equality, *multiplier, penalty) {
            Role::Held => value.abs(),
            Role::Slack => (-value).max(0.0),
            Role::Broken(sign) => (sign * value).max(0.0),
        })
        .fold(0.0, f64::max);
    Residual { stationarity, feasibility }
}

/// The Newton step and the multipliers after it, one for each condition.
fn subproblem(
    problem: &Problem,
    conditions: &[Condition],
    linear: &Linearised,
    multipliers: &[f64],
    inputs_rad: &[f64],
) -> Option<QpSolution> {
    let penalty = problem.solver.terminal_penalty;
    let limit = problem.gimbal_limit_rad;
    let included: Vec<usize> = (0..conditions.len())
        .filter(|row| conditions[*row].equality || linear.values[*row] < WINDOW || multipliers[*row] > 0.0)
        .collect();
    let rows: Vec<QpRow> = included
        .iter()
        .map(|row| QpRow {
            value: linear.values[*row],
            gradient: linear.rows.row(*row).iter().copied().collect(),
            equality: conditions[*row].equality,
        })
        .collect();
    let exact = linear.lagrangian_hessian(problem, conditions, multipliers);
    let pinned: Vec<bool> = linear
        .lagrangian_gradient(multipliers)
        .iter()
        .zip(inputs_rad)
        .map(|(slope, input)| pushes_out(*slope, *input, limit))
        .collect();
    let lower: Vec<f64> = inputs_rad.iter().map(|input| -limit - input).collect();
    let upper: Vec<f64> = inputs_rad.iter().map(|input| limit - input).collect();
    let newton = Qp {
        hessian: &exact,
        gradient: &linear.gradient,
        lower: &lower,
        upper: &upper,
        rows: &rows,
        penalty,
        max_iterations: problem.solver.qp_max_iterations,
    };
    let places = pinned
        .iter()
        .zip(inputs_rad)
        .map(|(pinned, input)| match pinned {
            false => Place::Free,
            true if *input > 0.0 => Place::Upper,
            true => Place::Lower,
        })
        .collect();
    let roles =
        included.iter().map(|row| Role::of(conditions[*row].equality, multipliers[*row], penalty)).collect();
    let guess = ActiveSet { places, roles };
    let solution = if let Some(solution) = polished(&newton, guess.clone()) {
        solution
    } else {
        let (hessian, gradient) = convexified(&exact, linear, conditions, multipliers, &pinned, penalty)?;
        let convex = Qp { hessian: &hessian, gradient: &gradient, ..newton };
        if let Some(solution) = polished(&convex, guess) {
            solution
        } else {
            let rough = convex.solve()?;
            let iterations = rough.iterations;
            let shown = ActiveSet::of(&convex, &rough);
            let polished =
                polished(&newton, shown.clone()).or_else(|| polished(&convex, shown)).unwrap_or(rough);
            QpSolution { iterations, ..polished }
        }
    };
    let mut all = vec![0.0; conditions.len()];
    for (row, multiplier) in included.iter().zip(&solution.multipliers) {
        all[*row] = *multiplier;
    }
    Some(QpSolution { multipliers: all, ..solution })
}

/// Whether a slope only pushes an input against its limit.
fn pushes_out(slope: f64, input_rad: f64, limit_rad: f64) -> bool {
    (input_rad >= limit_rad && slope < 0.0) || (input_rad <= -limit_rad && slope > 0.0)
}

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
    /// Cost plus the penalty of every broken condition.
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
    let penalty = problem.solver.terminal_penalty;
    let limit = problem.gimbal_limit_rad;
    let held: Vec<usize> = (0..conditions.len())
        .filter(|row| {
            let multiplier = multipliers[*row].abs();
            multiplier < penalty && (conditions[*row].equality || multiplier > 0.0)
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

/// Inputs whose path follows the pitch `pi/2 + amplitude sin(m pi t / T)`: the vehicle tilts one way and then the
/// other, which wastes surplus thrust and ends upright.
///
/// A law with two equal real poles flies this pitch history as a moving reference, so the guess is a flyable path from any
/// start: under thrust the pitch is a double integrator of the gimbal angle.
pub(super) fn bent(problem: &Problem, amplitude_rad: f64) -> Vec<f64> {
    let params = &problem.model.params;
    let pole = libm::exp(-GUESS_DECAY_RATE_PER_S * problem.step_s);
    let pitch_gain_per_s2 = (1.0 - pole) * (1.0 - pole) / (problem.step_s * problem.step_s);
    let rate_gain_per_s = (1.0 - pole) * (3.0 + pole) / (2.0 * problem.step_s);
    let arm_per_inertia = params.thrust_arm_m / params.pitch_inertia_kg_m2;
    let sine_limit = libm::sin(problem.gimbal_limit_rad);
    let count = problem.intervals();
    let half_waves = f64::from(problem.solver.guess_half_waves);
    let reference = |k: usize| {
        let phase = half_waves * PI * k as f64 / count as f64;
        let rate = half_waves * PI / (count as f64 * problem.step_s);
        (problem.target.theta_rad + amplitude_rad * libm::sin(phase), amplitude_rad * rate * libm::cos(phase))
    };
    let mut state = problem.initial;
    let mut inputs_rad = Vec::with_capacity(count);
    for (k, thrust_n) in problem.thrust_n.iter().enumerate() {
        let (theta_rad, q_rad_s) = reference(k);
        let wanted_rad_s2 =
            -pitch_gain_per_s2 * (state.theta_rad - theta_rad) - rate_gain_per_s * (state.q_rad_s - q_rad_s);
        // q' = -T sin(delta) arm / I; the sine's limit is the gimbal's.
        let sine = -wanted_rad_s2 / (thrust_n * arm_per_inertia);
        let gimbal_rad = if sine.is_finite() { libm::asin(sine.clamp(-sine_limit, sine_limit)) } else { 0.0 };
        state = problem.model_at(k).rk4_step(&state, gimbal_rad, *thrust_n, problem.step_s);
        inputs_rad.push(gimbal_rad);
    }
    inputs_rad
}

/// Fast enough to follow the reference within a few samples, slow enough to stay off the gimbal limit.
const GUESS_DECAY_RATE_PER_S: f64 = 4.0;
