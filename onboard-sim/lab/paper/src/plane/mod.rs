//! Solves the landing paper's optimal-control problem, which lies in a vertical plane.
//!
//! [`solve`] takes a [`Problem`] and, if there is one, a [`WarmStart`]. It always returns a [`Solution`], whose
//! [`SolveStatus`] says how the solve ended. [`solve_into`] is the same without allocation.
//!
//! * [`problem`]: the problem and its conditions, as data, and a lower bound of the touchdown speed, which shows starts
//!   that cannot be landed.
//! * [`dynamics`]: the planar equations of motion, their integrator and their exact derivatives.
//! * [`rollout`]: states and cost of given inputs.
//! * `intervals`: the dynamics of all intervals with exact first and second derivatives, in vector registers.
//! * `workspace`: the problem as the solver reads it, the solver's buffers, and the conversion of a solution into a start
//!   for a problem with other nodes. The solver is the crate [`stages`], whose page has the formulation, the steps and the
//!   references.
//!
//! Gauss-Newton Hessians do not work here: the multiplier of the end height is large, so the curvature of the dynamics
//! counts, and full Gauss-Newton steps diverge from tilted starts.

pub mod dynamics;
mod intervals;
pub mod problem;
pub mod rollout;
mod workspace;

pub use self::problem::best_touchdown_speed_m_s;
pub use problem::{FinalBox, Problem, SolverLimits};
pub use workspace::Workspace;


use crate::plane::dynamics::PlanarState;

/// Largest miss of an end or path condition of a path that lands, m, rad, m/s or rad/s.
pub const LANDING_MISS: f64 = 1e-3;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolveStatus {
    /// No problem was solved.
    #[default]
    NotRun,
    /// The optimality conditions hold to the tolerance.
    Converged,
    /// The iteration cap ended the solve; the best iterate is returned.
    IterationLimit,
    /// No step improved the best iterate any more before the tolerance was reached.
    Stalled,
    /// The quadratic subproblem could not be solved; the best iterate is returned.
    SubproblemFailed,
    /// Even upright under full thrust the vehicle hits the ground faster than a landing allows, so nothing was solved.
    NotLandable,
    /// The problem or the start is not finite; nothing was solved.
    BadInput,
}

impl SolveStatus {
    /// The name in telemetry and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotRun => "not run",
            Self::Converged => "converged",
            Self::IterationLimit => "iteration limit",
            Self::Stalled => "stalled",
            Self::SubproblemFailed => "subproblem failed",
            Self::NotLandable => "not landable",
            Self::BadInput => "bad input",
        }
    }
}

/// A start: an earlier solution, shifted to the present. Inputs alone are enough; they are then rolled out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WarmStart {
    /// The states, one more than inputs; empty if unknown.
    pub states: Vec<PlanarState>,
    /// Multiplier of the dynamics into each node, one more than inputs, the first unused; empty if unknown.
    pub costates: Vec<[f64; 6]>,
    /// Multipliers of each input's lower and upper limit; empty if unknown.
    pub limit_multipliers: Vec<[f64; 2]>,
    /// Gimbal angle of each interval, rad.
    pub inputs_rad: Vec<f64>,
    /// Multiplier of each condition at the end, in the order of [`Problem::conditions`].
    pub end_multipliers: Vec<f64>,
    /// Multiplier of the floor at each node before the end; empty without a floor.
    pub floor_multipliers: Vec<f64>,
}

/// The outcome of a solve.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solution {
    /// How it ended.
    pub status: SolveStatus,
    /// Newton iterations, over all starting points tried.
    pub iterations: usize,
    /// Linear systems factorised over all iterations; for the reference solver, iterations of its subproblems.
    pub qp_iterations: u32,
    /// Running cost (Eq. 28 of the landing paper), without penalties.
    pub cost: f64,
    /// Running cost plus the penalty of every broken condition.
    pub merit: f64,
    /// Length of an interval, s.
    pub step_s: f64,
    /// Largest component of the Lagrangian's gradient by states and inputs.
    pub kkt_stationarity: f64,
    /// Largest defect of the dynamics (m, rad, m/s or rad/s) or product of a slack and its multiplier (cost).
    pub kkt_feasibility: f64,
    /// Largest miss of a condition by the path, m, rad, m/s or rad/s.
    pub condition_miss: f64,
    /// Lower bound of the touchdown speed from the start, m/s.
    pub best_touchdown_speed_m_s: f64,
    /// The states, one more than inputs.
    pub states: Vec<PlanarState>,
    /// Multiplier of the dynamics into each node, one more than inputs; the first is not used.
    pub costates: Vec<[f64; 6]>,
    /// Multipliers of each input's lower and upper limit.
    pub limit_multipliers: Vec<[f64; 2]>,
    /// Gimbal angle of each interval, rad.
    pub inputs_rad: Vec<f64>,
    /// Multiplier of each condition at the end, in the order of [`Problem::conditions`].
    pub end_multipliers: Vec<f64>,
    /// Multiplier of the floor at each node before the end; empty without a floor.
    pub floor_multipliers: Vec<f64>,
}

impl Solution {
    /// The multiplier of the end height, cost per metre.
    pub fn terminal_multiplier(&self) -> f64 {
        self.end_multipliers.first().copied().unwrap_or(0.0)
    }

    /// This solution as a start for the same problem `steps` intervals later.
    pub fn shifted(&self, steps: usize) -> WarmStart {
        let mut warm = WarmStart::default();
        self.shift_into(steps, &mut warm);
        warm
    }

    /// [`shifted`](Self::shifted) without allocation, if the warm start was this long before.
    pub fn shift_into(&self, steps: usize, warm: &mut WarmStart) {
        fn refill<T: Copy>(values: &mut Vec<T>, from: &[T], steps: usize) {
            values.clear();
            values.extend_from_slice(from.get(steps..).unwrap_or_default());
        }
        refill(&mut warm.states, &self.states, steps);
        refill(&mut warm.costates, &self.costates, steps);
        refill(&mut warm.limit_multipliers, &self.limit_multipliers, steps);
        refill(&mut warm.inputs_rad, &self.inputs_rad, steps);
        refill(&mut warm.end_multipliers, &self.end_multipliers, 0);
        refill(&mut warm.floor_multipliers, &self.floor_multipliers, steps);
    }

    /// Clears the solution and keeps its capacity.
    fn clear(&mut self) {
        let Self {
            states, costates, limit_multipliers, inputs_rad, end_multipliers, floor_multipliers, ..
        } = core::mem::take(self);
        *self = Self {
            states,
            costates,
            limit_multipliers,
            inputs_rad,
            end_multipliers,
            floor_multipliers,
            ..Self::default()
        };
        self.states.clear();
        self.costates.clear();
        self.limit_multipliers.clear();
        self.inputs_rad.clear();
        self.end_multipliers.clear();
        self.floor_multipliers.clear();
    }
}

/// Solves the landing problem.
///
/// The solve starts from the warm start if its length fits. Otherwise it starts from two bent guesses and keeps the
/// better result: the problem has mirrored and multi-swing local minima, and the straight path between them is a
/// saddle.
pub fn solve(problem: &Problem, warm: Option<&WarmStart>) -> Solution {
    let mut solution = Solution::default();
    solve_into(problem, warm, &mut Workspace::default(), &mut solution);
    solution
}

/// [`solve`] without allocation, if workspace and solution were used for a problem of this length before.
pub fn solve_into(
    problem: &Problem,
    warm: Option<&WarmStart>,
    workspace: &mut Workspace,
    solution: &mut Solution,
) {
    solution.clear();
    if !problem.is_finite() {
        solution.status = SolveStatus::BadInput;
        return;
    }
    let best_touchdown_speed_m_s = best_touchdown_speed_m_s(problem);
    if best_touchdown_speed_m_s > problem.touchdown_speed_max_m_s {
        solution.status = SolveStatus::NotLandable;
    } else if problem.intervals() == 0 {
        solution.status = SolveStatus::Converged;
        solution.states.push(problem.initial);
    } else {
        workspace.solve(problem, warm, solution);
    }
    solution.step_s = problem.step_s;
    solution.best_touchdown_speed_m_s = best_touchdown_speed_m_s;
}
