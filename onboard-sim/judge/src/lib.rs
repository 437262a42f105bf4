//! This crate solves the landing in space a second time, to judge the plans that flew.
//!
//! It shares with the solver that flies ([`ocp::landing::solve`]) the data of a problem, and no
//! function: dynamics, cost and conditions (`landing`) are written again from their documentation,
//! and their derivatives are those of hyper-dual numbers. The method is another one (`sqp`):
//! sequential quadratic programming, whose subproblems Clarabel solves. It takes about a second
//! where the flying solver takes a millisecond.
//!
//! As in flight a condition on a state is an exact penalty at the price
//! [`terminal_penalty`](ocp::landing::SolverLimits), so a problem without a landing has an answer
//! as well, and of two plans the one with the lower [`Score::merit`] is better.

mod landing;
mod sqp;

use std::f64::consts::PI;

use ocp::landing::{INPUTS, Problem, STATES, State};

use self::landing::{Node, Range, after, cost_at, ranges};
use self::sqp::Search;

/// A plan by the judge's dynamics and conditions. NaN throughout if the plan has another number of
/// intervals, or flies on values that are not finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// The running cost.
    pub cost: f64,
    /// The cost, and the price of all misses.
    pub merit: f64,
    /// Largest miss of a condition, in its unit (m, m/s, rad, rad/s, or the fins' share).
    pub miss: f64,
    /// Which condition misses most, and its node; `None` if all hold.
    pub worst: Option<(&'static str, usize)>,
    /// Largest difference between a state and the end of the interval before it (m, m/s, rad or
    /// rad/s).
    pub defect: f64,
}

/// The judge's plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Whether nothing better lies near it; if not, it is only the best that was found.
    pub converged: bool,
    /// Subproblems solved, from all starts.
    pub iterations: usize,
    pub score: Score,
    /// States at the nodes, one more than intervals.
    pub states: Vec<State>,
    /// Gimbal angles, rad, and share of the fins, one for each interval.
    pub inputs: Vec<[f64; INPUTS]>,
}

/// The judge's guesses: turns of the lean, and the offset of its initial direction from the
/// problem's, rad.
const GUESSES: [(f64, f64); 5] = [(1.0, 0.0), (-1.0, 0.0), (1.0, PI), (-1.0, PI), (0.0, 0.0)];

/// Solves a landing from the judge's guesses, and from a plan if there is one; the best is the
/// answer. A plan with another number of intervals is not used. The final time is that of the
/// problem. The score is NaN if the problem has no intervals, or numbers that are not finite.
pub fn solve(problem: &Problem, start: Option<(&[State], &[[f64; INPUTS]])>) -> Judgement {
    let search = Search::of(problem);
    let given = start.and_then(|(states, inputs)| nodes(problem, states, inputs));
    let guesses = GUESSES.iter().filter(|_| !problem.pushes.is_empty()).map(|guess| search.guess(*guess));
    let starts = given.into_iter().chain(guesses);
    let mut iterations = 0;
    let mut best: Option<(bool, Score, Vec<Node>)> = None;
    for start in starts {
        let end = search.descend(start);
        iterations += end.iterations;
        if end.nodes.is_empty() {
            continue;
        }
        let score = scored(problem, &search.ranges, &end.nodes);
        if best.as_ref().is_none_or(|(_, best, _)| score.merit < best.merit) {
            best = Some((end.converged, score, end.nodes));
        }
    }
    let (converged, score, nodes) = best.unwrap_or((false, Score::NONE, Vec::new()));
    let state = |node: &Node| std::array::from_fn(|i| node[i]);
    let input = |node: &Node| std::array::from_fn(|i| node[STATES + i]);
    Judgement {
        converged,
        iterations,
        score,
        states: nodes.iter().map(state).collect(),
        inputs: nodes.iter().take(problem.pushes.len()).map(input).collect(),
    }
}

/// Judges a given plan.
pub fn score(problem: &Problem, states: &[State], inputs: &[[f64; INPUTS]]) -> Score {
    nodes(problem, states, inputs).map_or(Score::NONE, |nodes| scored(problem, &ranges(problem), &nodes))
}

impl Score {
    const NONE: Self =
        Self { cost: f64::NAN, merit: f64::NAN, miss: f64::NAN, worst: None, defect: f64::NAN };
}

/// The nodes of a plan, if it has the problem's intervals.
fn nodes(problem: &Problem, states: &[State], inputs: &[[f64; INPUTS]]) -> Option<Vec<Node>> {
    let intervals = problem.pushes.len();
    let fits = intervals > 0 && inputs.len() == intervals && states.len() == intervals + 1;
    let inputs = inputs.iter().chain([&[0.0; INPUTS]]);
    let node = |(x, u): (&State, &[f64; INPUTS])| Node::from_iterator(x.iter().chain(u).copied());
    fits.then(|| states.iter().zip(inputs).map(node).collect())
}

fn scored(problem: &Problem, ranges: &[Range], nodes: &[Node]) -> Score {
    let mut score = Score { cost: 0.0, merit: 0.0, miss: 0.0, worst: None, defect: 0.0 };
    for (k, node) in nodes.iter().enumerate() {
        let (weight, free) = cost_at(problem, k);
        let away = node - free;
        score.cost += 0.5 * weight.dot(&away.component_mul(&away));
        let from = match k.checked_sub(1) {
            Some(before) => after(problem, before, nodes[before].as_ref()),
            None => problem.initial,
        };
        for (from, here) in from.iter().zip(node) {
            let gap = (from - here).abs();
            if !gap.is_finite() {
                return Score::NONE;
            }
            score.defect = score.defect.max(gap);
        }
    }
    score.merit = score.cost;
    for range in ranges {
        let miss = range.violation(nodes[range.node][range.component]);
        score.merit += problem.solver.terminal_penalty * miss;
        if miss > score.miss {
            (score.miss, score.worst) = (miss, Some((range.what, range.node)));
        }
    }
    score
}

#[cfg(test)]
mod tests;
