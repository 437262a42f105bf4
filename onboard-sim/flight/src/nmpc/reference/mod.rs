//! The reference solver: slow, generic, independent of the fast one in all but the equations of motion.
//!
//! Sequential quadratic programming with exact second derivatives. The states are not variables: they are rolled out
//! from the inputs, so every iterate is a flyable path. One iteration:
//!
//! 1. `rollout`: states and cost of the inputs, RK4, one step an interval.
//! 2. `sensitivity`: tangents of every interval, and adjoint-weighted second derivatives over its RK4 stages.
//! 3. `condense`: both condensed onto the inputs: gradient, Hessian, one row an end or path condition.
//! 4. `convexify`: the Hessian made positive definite without changing the Newton step, where that is possible.
//! 5. `polish`: the quadratic subproblem, conditions elastic, solved exactly from the last active set; where that
//!    set is too far off, `qp` finds it with Clarabel.
//! 6. `line_search` on cost plus exact penalty, with a second-order correction.
//!
//! `sqp` is the loop around them, with the optimality residual. It allocates, and takes tens of milliseconds where
//! the other takes tenths of one.

mod condense;
mod convexify;
mod guess;
mod line_search;
mod polish;
mod qp;
mod sensitivity;
mod sqp;

use super::{Problem, Solution, WarmStart};

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
