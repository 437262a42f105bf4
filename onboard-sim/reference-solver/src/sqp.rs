//! The main loop: Newton on the optimality conditions, globalised by a line search on the exact penalty.

use super::condense::Linearised;
use super::convexify::convexified;
use super::line_search::{Iterate, line_search};
use super::polish::{ActiveSet, Place, Role, polished};
use super::qp::{Qp, QpRow, QpSolution};
use nmpc::dynamics::PlanarState;
use nmpc::problem::{Condition, Problem};
use nmpc::{Solution, SolveStatus, WarmStart};

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
        price: iterate.merit,
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
    let price = problem.solver.terminal_penalty;
    let feasibility = conditions
        .iter()
        .zip(&linear.values)
        .zip(multipliers)
        .map(|((condition, value), multiplier)| match Role::of(condition.equality, *multiplier, price) {
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
    let price = problem.solver.terminal_penalty;
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
        price,
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
        included.iter().map(|row| Role::of(conditions[*row].equality, multipliers[*row], price)).collect();
    let guess = ActiveSet { places, roles };
    let solution = if let Some(solution) = polished(&newton, guess.clone()) {
        solution
    } else {
        let (hessian, gradient) = convexified(&exact, linear, conditions, multipliers, &pinned, price)?;
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
