//! The single layers of an iteration, for benchmarks.

use super::Workspace;
use super::barrier::LAST_BARRIER;
use super::block::Constants;
use super::solver::RAISED_BARRIER;
use super::start;
use crate::{Problem, WarmStart};

impl Workspace {
    /// Starts from a warm start whose length fits, and raises the barrier until the sweeps are well scaled.
    pub fn load(&mut self, problem: &Problem, warm: &WarmStart) {
        self.resize(problem);
        start::warm(problem, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        start::raise(problem, &self.conditions, RAISED_BARRIER, &mut self.current);
    }

    /// Dynamics, first and second derivatives of every interval.
    pub fn evaluate_intervals(&mut self, problem: &Problem) {
        let constants = Constants::of(&problem.model, problem.step_s);
        self.current.evaluate::<true>(&constants, problem);
    }

    /// One Newton step at the evaluated intervals: backward and forward sweep; whether the inertia was right.
    pub fn sweep(&mut self, problem: &Problem) -> bool {
        self.newton.assemble(problem, &self.conditions, &self.current, RAISED_BARRIER);
        let solved = self.newton.factorise(problem, &self.current, 1.0);
        self.newton.solve(problem, &self.conditions, &self.current, RAISED_BARRIER);
        solved
    }
}
