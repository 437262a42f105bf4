//! The solver's buffers, between a problem and its solution.

use alloc::vec::Vec;
use core::iter::repeat;

use stages::{Start, Status};

use crate::dynamics::PlanarState;
use crate::{Problem, Solution, SolveStatus, WarmStart};

/// Buffers of a solve, kept so that the next solve does not allocate. The result does not depend on them.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    solver: stages::Workspace<Problem, 6, 1>,
    start: StartBuffers,
}

/// The parts of a start that the solver has in another form.
#[derive(Debug, Clone, Default)]
struct StartBuffers {
    states: Vec<[f64; 6]>,
    condition_multipliers: Vec<f64>,
}

impl StartBuffers {
    /// A start from these parts.
    fn fill<'a>(
        &'a mut self,
        problem: &Problem,
        states: &[PlanarState],
        inputs_rad: &'a [f64],
        costates: &'a [[f64; 6]],
        limit_multipliers: &'a [[f64; 2]],
        [end_multipliers, floor_multipliers]: [&[f64]; 2],
    ) -> Start<'a, 6, 1> {
        self.states.clear();
        self.states.extend(states.iter().map(|state| state.to_array()));
        // A horizon too short for all settled nodes has fewer conditions at its end than the earlier solution had.
        let ends = end_multipliers.iter().chain(repeat(&0.0)).take(problem.end_conditions_len());
        self.condition_multipliers.clear();
        self.condition_multipliers.extend(ends.chain(floor_multipliers));
        Start {
            states: &self.states,
            inputs: inputs_rad.as_chunks().0,
            costates,
            limit_multipliers: limit_multipliers.as_chunks().0,
            condition_multipliers: &self.condition_multipliers,
        }
    }

    fn of_warm<'a>(&'a mut self, problem: &Problem, warm: &'a WarmStart) -> Start<'a, 6, 1> {
        let multipliers = [&*warm.end_multipliers, &*warm.floor_multipliers];
        self.fill(
            problem,
            &warm.states,
            &warm.inputs_rad,
            &warm.costates,
            &warm.limit_multipliers,
            multipliers,
        )
    }
}

impl Workspace {
    /// Allows the coming solves so many passes together: [`stages::Workspace::allow`].
    pub(crate) fn allow(&mut self, passes: Option<usize>) {
        self.solver.allow(passes);
    }

    pub(crate) fn is_spent(&self) -> bool {
        self.solver.is_spent()
    }

    /// Solves a problem with at least one interval into `solution`, except its bound of the touchdown speed.
    pub fn solve(&mut self, problem: &Problem, warm: Option<&WarmStart>, solution: &mut Solution) {
        let start = warm.map(|warm| self.start.of_warm(problem, warm));
        let outcome = self.solver.solve(problem, start.as_ref());
        solution.clear();
        solution.status = match outcome.status {
            Status::Converged => SolveStatus::Converged,
            Status::IterationLimit => SolveStatus::IterationLimit,
            Status::Stalled => SolveStatus::Stalled,
            Status::SubproblemFailed => SolveStatus::SubproblemFailed,
            Status::NotFinite => SolveStatus::BadInput,
        };
        solution.iterations = outcome.iterations;
        solution.qp_iterations = outcome.factorisations;
        if !outcome.cost.is_finite() {
            return;
        }
        solution.cost = outcome.cost;
        solution.price = outcome.price;
        solution.kkt_stationarity = outcome.stationarity;
        solution.kkt_feasibility = outcome.feasibility;
        solution.condition_miss = outcome.miss;
        solution.states.extend(self.solver.states().iter().map(|state| PlanarState::from_array(*state)));
        solution.inputs_rad.extend(self.solver.inputs().as_flattened());
        solution.costates.extend(self.solver.costates());
        solution.limit_multipliers.extend(self.solver.limit_multipliers().flatten());
        let mut multipliers = self.solver.condition_multipliers();
        solution.end_multipliers.extend(multipliers.by_ref().take(problem.end_conditions_len()));
        solution.floor_multipliers.extend(multipliers);
    }

    /// The Lagrangian of a problem at the solution of another problem with as many intervals; NaN if it has another
    /// number.
    pub(crate) fn lagrangian(&mut self, problem: &Problem, solution: &Solution) -> f64 {
        let Solution { states, inputs_rad, costates, limit_multipliers, .. } = solution;
        let multipliers = [&*solution.end_multipliers, &*solution.floor_multipliers];
        let start = self.start.fill(problem, states, inputs_rad, costates, limit_multipliers, multipliers);
        self.solver.lagrangian(problem, &start)
    }

    /// For benchmarks: starts from a warm start whose length fits, and raises the barrier until the sweeps are well
    /// scaled.
    pub fn load(&mut self, problem: &Problem, warm: &WarmStart) {
        self.solver.load(problem, &self.start.of_warm(problem, warm));
    }

    /// For benchmarks: dynamics, first and second derivatives of every interval.
    pub fn evaluate_intervals(&mut self, problem: &Problem) {
        self.solver.evaluate_intervals(problem);
    }

    /// For benchmarks: one Newton step at the evaluated intervals: backward and forward sweep; whether the inertia was
    /// right.
    pub fn sweep(&mut self, problem: &Problem) -> bool {
        self.solver.sweep(problem)
    }
}
