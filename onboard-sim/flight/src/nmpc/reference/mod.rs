//! The reference solver: condensed sequential quadratic programming.

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
    match warm.filter(|start| start.inputs_rad.len() == problem.intervals()) {
        Some(start) => sqp::solve_from(problem, start),
        None => cold(problem),
    }
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
