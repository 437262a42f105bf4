//! Searches for the best final time of a landing.
//!
//! [`FreeTimeProblem`] is a landing whose horizon of `N` intervals may be stretched between an earliest and a latest
//! end. Everything that depends on the end (length of an interval, thrust and mass in it, drift of the target) follows
//! from the [`Motor`] and the final time. So the search minimises the merit (cost plus penalties of broken conditions) over one
//! number.
//!
//! Each final time is a landing problem of its own, solved by [`solve_into`](super::solve_into). By the envelope
//! theorem the derivative of the optimal merit by the final time is that of the Lagrangian at the solution
//! ([`stages::Workspace::lagrangian`]; Bryson and Ho, *Applied Optimal Control*, 1975, section 2.7, have it as the
//! Hamiltonian at the end). The search is a secant on that derivative, kept between the ends and between points already
//! known to be worse:
//!
//! * a warm search starts at the end of the earlier solution;
//! * a cold search starts at the best point of a coarse grid. If the earliest end lands and later ends cost more, the
//!   earliest end is the result.
//!
//! The end is never before the thrust falls through the weight (`falls_through_weight_s`), or the vehicle would lift
//! off again after contact. The number of solves is capped; there is no clock.

use super::{LANDING_MISS, Problem, Solution, SolveStatus, WarmStart, Workspace, solve_into};
use serde::Serialize;

/// Grid of a cold search, over the allowed ends.
const GRID: usize = 5;

/// First step of a search without known curvature, and the longest step of any search, s.
const FIRST_STEP_S: f64 = 0.05;
const LONGEST_STEP_S: f64 = 0.3;

/// The search ends when the next step is shorter than this, s.
const TIME_TOLERANCE_S: f64 = 1e-4;

/// Half the span of the central difference of the Lagrangian, s.
const DIFFERENCE_S: f64 = 1e-4;

/// Resolution of the search for the thrust's fall through the weight: points of the scan, then halvings.
const SCAN_S: f64 = 0.02;
const HALVINGS: u32 = 16;

/// Future thrust and mass; times are from now.
pub trait Motor {
    /// Mean thrust between two times, N.
    fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64;

    /// Mean mass of the vehicle between two times, kg.
    fn mean_mass_kg(&self, from_s: f64, to_s: f64) -> f64;
}

/// A landing with a free final time.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeTimeProblem {
    /// The landing; its `step_s`, `thrust_n` and `mass_kg` are ignored, because they follow from the final time.
    pub landing: Problem,
    /// Number of intervals for every final time.
    pub intervals: usize,
    /// Earliest final time from now, s, above zero; the thrust's fall through the weight may move it later.
    pub earliest_s: f64,
    /// Latest final time from now, s.
    pub latest_s: f64,
    /// Velocity of the target along x, m/s: minus the wind, in the frame that moves with it. The landing's target is
    /// its present position.
    pub target_drift_m_s: f64,
    /// Largest number of problems solved in one search, at least 1. Each has its own cap of iterations.
    pub max_solves: u32,
}

/// The outcome of a search: a landing and its final time.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FreeTimeSolution {
    /// The landing; its iterations are those of the whole search.
    pub solution: Solution,
    /// Its final time from the start of the problem, s.
    pub final_time_s: f64,
    /// The earliest allowed final time, s.
    pub earliest_s: f64,
    /// Derivative of the optimal merit by the final time, 1/s: zero between the ends, positive at the earliest.
    pub merit_slope: f64,
    /// Problems solved.
    pub solves: u32,
}

/// Buffers of a search, kept so that the next search does not allocate. The result does not depend on them.
#[derive(Debug, Clone, Default)]
pub struct FreeTimeWorkspace {
    inner: Workspace,
    posed: Option<Problem>,
    warm: WarmStart,
    trial: FreeTimeSolution,
}

impl FreeTimeWorkspace {
    /// Allows the coming searches so many passes together: [`stages::Workspace::allow`].
    pub fn allow(&mut self, passes: Option<usize>) {
        self.inner.allow(passes);
    }

    /// Passes made since then.
    pub fn passes(&self) -> usize {
        self.inner.passes()
    }

    /// Whether nothing is left of what was allowed.
    pub fn is_spent(&self) -> bool {
        self.inner.is_spent()
    }
}

/// Solves for path and final time.
///
/// The search is warm if there is an earlier solution, which began `elapsed_s` ago; otherwise it is cold.
pub fn solve_free_time(
    problem: &FreeTimeProblem,
    motor: &impl Motor,
    earlier: Option<(&FreeTimeSolution, f64)>,
) -> FreeTimeSolution {
    let mut best = FreeTimeSolution::default();
    solve_free_time_into(problem, motor, earlier, &mut FreeTimeWorkspace::default(), &mut best);
    best
}

/// [`solve_free_time`] without allocation, if workspace and solution were used for a problem of this length before.
pub fn solve_free_time_into(
    problem: &FreeTimeProblem,
    motor: &impl Motor,
    earlier: Option<(&FreeTimeSolution, f64)>,
    workspace: &mut FreeTimeWorkspace,
    best: &mut FreeTimeSolution,
) {
    best.solution.clear();
    best.solves = 0;
    let usable = problem.earliest_s > 0.0
        && problem.latest_s >= problem.earliest_s
        && problem.latest_s.is_finite()
        && problem.target_drift_m_s.is_finite()
        && problem.intervals > 0;
    if !usable {
        best.solution.status = SolveStatus::BadInput;
        return;
    }
    let gravity_m_s2 = problem.landing.model.params.gravity_m_s2;
    let span = (problem.earliest_s, problem.latest_s);
    let earliest_s = falls_through_weight_s(motor, gravity_m_s2, span);
    let mut search = Search { problem, motor, earliest_s, workspace, solves: 0, iterations: 0 };
    match earlier.filter(|(solution, elapsed_s)| solution.is_usable() && elapsed_s.is_finite()) {
        Some((solution, elapsed_s)) => {
            // A solution at the earliest end stays at the earliest end, even if that has moved.
            let at_earliest = solution.final_time_s <= solution.earliest_s;
            let final_time_s = if at_earliest { earliest_s } else { solution.final_time_s - elapsed_s };
            search.solve(final_time_s, Some((&solution.solution, elapsed_s)), best);
        }
        None => search.survey(best),
    }
    search.refine(best);
    // A search with one solve does not use this buffer, so make room here.
    search.workspace.trial.solution.make_room(&best.solution);
    best.solves = search.solves;
    best.earliest_s = earliest_s;
    best.solution.iterations = search.iterations;
}

/// When the thrust falls through the weight for the last time within a span, s from now: the beginning of the span if
/// the thrust is below the weight throughout, its end if the thrust is still above there.
pub fn falls_through_weight_s(
    motor: &impl Motor,
    gravity_m_s2: f64,
    (earliest_s, latest_s): (f64, f64),
) -> f64 {
    const INSTANT_S: f64 = 1e-3;
    let lifts = |at_s: f64| {
        let until_s = at_s + INSTANT_S;
        motor.mean_thrust_n(at_s, until_s) > gravity_m_s2 * motor.mean_mass_kg(at_s, until_s)
    };
    let mut below_s = latest_s;
    let mut above_s = latest_s;
    while !lifts(above_s) {
        if above_s <= earliest_s {
            return earliest_s;
        }
        below_s = above_s;
        above_s = (above_s - SCAN_S).max(earliest_s);
    }
    for _ in 0..HALVINGS {
        let middle_s = 0.5 * (above_s + below_s);
        if lifts(middle_s) {
            above_s = middle_s;
        } else {
            below_s = middle_s;
        }
    }
    below_s
}

impl FreeTimeSolution {
    /// Whether the path meets its conditions to a millimetre (or the same number of rad, m/s or rad/s).
    pub fn lands(&self) -> bool {
        self.solution.status == SolveStatus::Converged && self.solution.condition_miss <= LANDING_MISS
    }

    /// Cost plus the penalty of missed conditions; infinite if nothing was solved.
    fn merit(&self) -> f64 {
        if self.solution.inputs_rad.is_empty() { f64::INFINITY } else { self.solution.merit }
    }

    /// Whether another search can start from it.
    fn is_usable(&self) -> bool {
        !self.solution.inputs_rad.is_empty() && self.final_time_s.is_finite()
    }
}

struct Search<'a, M> {
    problem: &'a FreeTimeProblem,
    motor: &'a M,
    earliest_s: f64,
    workspace: &'a mut FreeTimeWorkspace,
    solves: u32,
    iterations: usize,
}

impl<M: Motor> Search<'_, M> {
    fn left(&self) -> bool {
        self.solves < self.problem.max_solves.max(1) && !self.workspace.is_spent()
    }

    /// The best final time of a coarse grid; each is solved cold.
    fn survey(&mut self, best: &mut FreeTimeSolution) {
        let mut trial = core::mem::take(&mut self.workspace.trial);
        for index in 0..GRID {
            let share = index as f64 / (GRID - 1) as f64;
            let span_s = self.problem.latest_s - self.earliest_s;
            self.solve(self.earliest_s + share * span_s, None, &mut trial);
            if index == 0 || trial.merit() < best.merit() {
                core::mem::swap(best, &mut trial);
            }
            let settled = index == 0 && best.lands() && best.merit_slope >= 0.0;
            if settled || span_s <= 0.0 || !self.left() {
                break;
            }
        }
        self.workspace.trial = trial;
    }

    /// Moves the final time to the point where the merit's slope is zero.
    fn refine(&mut self, best: &mut FreeTimeSolution) {
        let mut trial = core::mem::take(&mut self.workspace.trial);
        let (mut least_s, mut most_s) = (self.earliest_s, self.problem.latest_s);
        let mut curvature = None;
        while self.left() && best.merit_slope.is_finite() {
            let slope = best.merit_slope;
            let from_s = best.final_time_s;
            let step_s = match curvature {
                Some(curvature) => -slope / curvature,
                None if slope < 0.0 => FIRST_STEP_S,
                None => -FIRST_STEP_S,
            };
            let wanted_s = from_s + step_s.clamp(-LONGEST_STEP_S, LONGEST_STEP_S);
            let mut to_s = wanted_s.clamp(least_s, most_s);
            // If the step reaches a point that is known to be worse and is not an end, go only halfway.
            let known_below = wanted_s < least_s && least_s > self.earliest_s;
            let known_above = wanted_s > most_s && most_s < self.problem.latest_s;
            if known_below || known_above {
                to_s = 0.5 * (from_s + to_s);
            }
            if (to_s - from_s).abs() <= TIME_TOLERANCE_S {
                break;
            }
            self.solve(to_s, Some((&best.solution, 0.0)), &mut trial);
            let secant = (trial.merit_slope - slope) / (to_s - from_s);
            curvature = Some(secant).filter(|secant| *secant > 0.0 && secant.is_finite());
            let (worse, better) = if trial.merit() < best.merit() {
                core::mem::swap(best, &mut trial);
                (from_s, to_s)
            } else {
                (to_s, from_s)
            };
            if worse < better {
                least_s = worse;
            } else {
                most_s = worse;
            }
        }
        self.workspace.trial = trial;
    }

    /// Solves for one final time, cold or from a solution that began some time ago.
    fn solve(&mut self, final_time_s: f64, from: Option<(&Solution, f64)>, into: &mut FreeTimeSolution) {
        let final_time_s = final_time_s.clamp(self.earliest_s, self.problem.latest_s);
        let workspace = &mut *self.workspace;
        let mut posed = workspace.posed.take().unwrap_or_else(|| self.problem.landing.clone());
        let (thrust_n, mass_kg) = (core::mem::take(&mut posed.thrust_n), core::mem::take(&mut posed.mass_kg));
        posed = Problem { thrust_n, mass_kg, ..self.problem.landing.clone() };
        pose(self.problem, self.motor, final_time_s, &mut posed);
        let warm = from.map(|(solution, elapsed_s)| {
            solution.resample_into(elapsed_s, posed.step_s, posed.intervals(), &mut workspace.warm);
            &workspace.warm
        });
        solve_into(&posed, warm, &mut workspace.inner, &mut into.solution);
        if from.is_none() {
            // The next search may be warm, and then needs room.
            into.solution.resample_into(0.0, posed.step_s, posed.intervals(), &mut workspace.warm);
        }
        into.final_time_s = final_time_s;
        let mut lagrangian = |at_s: f64| {
            pose(self.problem, self.motor, at_s, &mut posed);
            workspace.inner.lagrangian(&posed, &into.solution)
        };
        let ahead = lagrangian(final_time_s + DIFFERENCE_S);
        let behind = lagrangian(final_time_s - DIFFERENCE_S);
        into.merit_slope = (ahead - behind) / (2.0 * DIFFERENCE_S);
        workspace.posed = Some(posed);
        self.solves += 1;
        self.iterations += into.solution.iterations;
    }
}

/// Fills in the values that follow from the final time.
pub fn pose(problem: &FreeTimeProblem, motor: &impl Motor, final_time_s: f64, posed: &mut Problem) {
    let step_s = final_time_s / problem.intervals as f64;
    let between = |k: usize| (k as f64 * step_s, (k + 1) as f64 * step_s);
    posed.step_s = step_s;
    posed.target.x_m = problem.landing.target.x_m + problem.target_drift_m_s * final_time_s;
    posed.thrust_n.clear();
    posed.mass_kg.clear();
    for (from_s, to_s) in (0..problem.intervals).map(between) {
        posed.thrust_n.push(motor.mean_thrust_n(from_s, to_s));
        posed.mass_kg.push(motor.mean_mass_kg(from_s, to_s));
    }
}
