//! This crate solves the landing problem a second time, to check the fast solver of [`nmpc`].
//!
//! It is slow and generic, and shares only the equations of motion with the fast solver. It uses sequential quadratic
//! programming with exact second derivatives. The states are not variables: they are rolled out from the inputs, so
//! every iterate is a flyable path. One iteration:
//!
//! 1. [`nmpc::rollout`]: states and cost of the inputs, with one RK4 step per interval.
//! 2. `sensitivity`: tangents of every interval, and adjoint-weighted second derivatives over its RK4 stages.
//! 3. `condense`: condenses both onto the inputs, which gives gradient, Hessian and one row per end or path condition.
//! 4. `convexify`: makes the Hessian positive definite, if possible without changing the Newton step.
//! 5. `polish`: solves the quadratic subproblem with elastic conditions exactly, from the last active set. If that set
//!    is too far from the right one, `qp` finds it with Clarabel.
//! 6. `line_search`: searches along the step on cost plus exact penalty, with a second-order correction.
//!
//! `guess` makes the initial inputs, and `sqp` is the loop around the steps, with the optimality residual. A solve
//! allocates, and takes tens of milliseconds where the fast solver takes tenths of a millisecond.

mod condense;
mod convexify;
mod guess;
mod line_search;
mod polish;
mod qp;
mod sensitivity;
mod sqp;

use nmpc::{Problem, Solution, WarmStart};

/// Solves the landing problem.
pub fn solve(problem: &Problem, warm: Option<&WarmStart>) -> Solution {
    let solution = match warm.filter(|start| start.inputs_rad.len() == problem.intervals()) {
        Some(start) => sqp::solve_from(problem, start),
        None => cold(problem),
    };
    Solution { step_s: problem.step_s, ..solution }
}

fn cold(problem: &Problem) -> Solution {
    let amplitude_rad = problem.solver.guess_amplitude_rad;
    let [left, right] = [amplitude_rad, -amplitude_rad].map(|amplitude_rad| {
        let inputs_rad = guess::bent(problem, amplitude_rad);
        sqp::solve_from(problem, &WarmStart { inputs_rad, ..WarmStart::default() })
    });
    let iterations = left.iterations + right.iterations;
    let qp_iterations = left.qp_iterations + right.qp_iterations;
    let price = |solution: &Solution| {
        let priced = solution.cost + problem.solver.terminal_penalty * solution.condition_miss;
        if priced.is_finite() { priced } else { f64::INFINITY }
    };
    let better = if price(&right) < price(&left) { right } else { left };
    Solution { iterations, qp_iterations, ..better }
}

#[cfg(test)]
mod tests;
