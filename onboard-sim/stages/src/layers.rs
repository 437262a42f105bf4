//! The single layers of an iteration, for benchmarks.

use crate::barrier::LAST_BARRIER;
use crate::model::Model;
use crate::solver::{RAISED_BARRIER, Workspace};
use crate::start::{self, Start};

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Starts from a warm start whose length fits, and raises the barrier until the sweeps are well scaled.
    pub fn load(&mut self, model: &M, warm: &Start<NX, NU>) {
        self.resize(model);
        start::warm(model, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        start::raise(model, &self.conditions, RAISED_BARRIER, &mut self.current);
    }

    /// Dynamics, first and second derivatives of every interval.
    pub fn evaluate_intervals(&mut self, model: &M) {
        self.current.evaluate(model, true);
    }

    /// One Newton step at the evaluated intervals: backward and forward sweep; whether the inertia was right.
    pub fn sweep(&mut self, model: &M) -> bool {
        self.newton.assemble(model, &self.conditions, &self.current, RAISED_BARRIER);
        let solved = self.newton.sweep.backward(&self.current, 1.0);
        self.newton.solve(model, &self.conditions, &self.current, RAISED_BARRIER);
        solved
    }
}
