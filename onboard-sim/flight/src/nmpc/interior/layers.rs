//! The layers of an iteration, one by one, for measuring them.

use super::Workspace;
use super::block::Constants;
use super::solver::{LAST_BARRIER, RAISED_BARRIER};
use super::start;
use crate::nmpc::{Problem, WarmStart};

impl Workspace {
    /// Starts from a warm start whose length fits, and raises the barrier to where sweeps are well scaled.
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
