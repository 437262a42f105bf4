//! A solve from an earlier solution.

use super::Workspace;
use super::block::Constants;
use super::solver::{LAST_BARRIER, Outcome};
use super::start;
use crate::nmpc::{Problem, SolveStatus, WarmStart};

/// Largest difference of the start from where the earlier solution expected it, m, rad, m/s or rad/s, at which that
/// may still be optimal.
const AS_EXPECTED: f64 = 1e-6;

impl Workspace {
    /// From an earlier solution: as it is if it is still optimal; else by the steps of `clamped`, by the barrier
    /// method, and cold, each where the one before fails, in at most `cap` iterations together.
    pub(super) fn warm(&mut self, problem: &Problem, warm: &WarmStart, cap: usize) -> Outcome {
        let constants = Constants::of(&problem.model, problem.step_s);
        let complete = start::warm(problem, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        let expected = warm.states.first().is_some_and(|state| {
            let pairs = state.to_array().into_iter().zip(problem.initial.to_array());
            pairs.into_iter().all(|(one, other)| (one - other).abs() <= AS_EXPECTED)
        });
        if expected || !complete {
            self.current.evaluate::<false>(&constants, problem);
            let residual = self.residual(problem);
            if residual.largest(0.0) <= problem.solver.kkt_tolerance {
                return Outcome { status: SolveStatus::Converged, residual, ..Outcome::BAD };
            }
        }
        let (mut iterations, mut sweeps) = (0, 0);
        if complete {
            // Half is left for what can start from further away.
            match self.pursue(problem, &constants, cap / 2) {
                Ok(outcome) => return outcome,
                Err((made, swept)) => (iterations, sweeps) = (made, swept),
            }
            start::warm(problem, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        }
        let mut outcome = self.descend(problem, LAST_BARRIER, cap - iterations);
        iterations += outcome.iterations;
        sweeps += outcome.sweeps;
        if matches!(outcome.status, SolveStatus::Stalled | SolveStatus::SubproblemFailed) && iterations < cap
        {
            outcome = self.cold(problem, cap - iterations);
            iterations += outcome.iterations;
            sweeps += outcome.sweeps;
        }
        Outcome { iterations, sweeps, ..outcome }
    }
}
