//! Solves the landing paper's optimal-control problem, which lies in a vertical plane.
//!
//! [`solve`] takes a [`Problem`] and, if there is one, a [`Start`]. It always returns a
//! [`Solution`], whose [`Status`] says how the solve ended.
//!
//! * [`problem`]: the problem and its conditions, as data and as the solver reads it, and a lower
//!   bound of the touchdown speed, which shows starts that cannot be landed.
//! * [`dynamics`]: the planar equations of motion and their integrator.
//! * `intervals`: the dynamics of all intervals with exact first and second derivatives.
//!
//! The solver is the crate [`ocp`], whose page has the formulation, the steps and the references.
//! Gauss-Newton Hessians do not work here: the multiplier of the end height is large, so the
//! curvature of the dynamics counts, and full Gauss-Newton steps diverge from tilted starts.

pub mod dynamics;
mod intervals;
pub mod problem;
#[cfg(test)]
mod tests;

pub use self::problem::{FinalBox, Problem, SolverLimits, best_touchdown_speed_m_s};
pub use ocp::{Outcome, Start, Status};

use crate::plane::dynamics::PlanarState;

/// Largest miss of an end condition of a path that lands, m, rad, m/s or rad/s.
pub const LANDING_MISS: f64 = 1e-3;

/// The buffers of a solve. The result does not depend on them.
pub type Workspace = ocp::Workspace<Problem, 6, 1>;

/// The outcome of a solve, its path and its multipliers.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    pub outcome: Outcome,
    /// The states in state order, SI and radians, one more than inputs.
    pub states: Vec<[f64; 6]>,
    /// Gimbal angle of each interval, rad.
    pub inputs_rad: Vec<[f64; 1]>,
    /// Multiplier of the dynamics into each node, one more than inputs; the first is not used.
    pub costates: Vec<[f64; 6]>,
    /// Multipliers of each input's lower and upper limit.
    pub limit_multipliers: Vec<[[f64; 2]; 1]>,
    /// Multiplier of each condition; the first is that of the end height, cost per metre.
    pub condition_multipliers: Vec<f64>,
}

impl Solution {
    /// The last solve of a workspace.
    pub fn of(workspace: &Workspace, outcome: Outcome) -> Self {
        Self {
            outcome,
            states: workspace.states().to_vec(),
            inputs_rad: workspace.inputs().to_vec(),
            costates: workspace.costates().to_vec(),
            limit_multipliers: workspace.limit_multipliers().collect(),
            condition_multipliers: workspace.condition_multipliers().collect(),
        }
    }

    /// Whether the optimality conditions hold to the tolerance.
    pub fn converged(&self) -> bool {
        self.outcome.status == Status::Converged
    }

    /// The state at a node.
    pub fn state(&self, node: usize) -> PlanarState {
        PlanarState::from_array(self.states[node])
    }

    /// The state after the last interval.
    pub fn end(&self) -> PlanarState {
        self.state(self.inputs_rad.len())
    }

    /// This solution as a start for the same problem `steps` intervals later.
    pub fn start(&self, steps: usize) -> Start<'_, 6, 1> {
        Start {
            states: &self.states[steps..],
            inputs: &self.inputs_rad[steps..],
            costates: &self.costates[steps..],
            limit_multipliers: &self.limit_multipliers[steps..],
            // A horizon too short for all settled nodes has fewer conditions, the first ones.
            condition_multipliers: &self.condition_multipliers,
        }
    }
}

/// Solves the landing problem.
///
/// The solve starts from an earlier solution if its length fits. Otherwise it starts from two bent
/// guesses and keeps the better result: the problem has mirrored and multi-swing local minima, and
/// the straight path between them is a saddle.
pub fn solve(problem: &Problem, start: Option<&Start<'_, 6, 1>>) -> Solution {
    let mut workspace = Workspace::default();
    let outcome = workspace.solve(problem, start);
    Solution::of(&workspace, outcome)
}
