//! A solve from an earlier solution.

use super::Workspace;
use super::barrier::LAST_BARRIER;
use super::block::Constants;
use super::solver::SolveEnd;
use super::start;
use crate::{Problem, SolveStatus, WarmStart};

/// Largest difference between the start and the earlier solution's expected state, m, rad, m/s or rad/s, at which that
/// solution may still be optimal.
const AS_EXPECTED: f64 = 1e-6;

impl Workspace {
    /// Solves from an earlier solution. It is returned unchanged if it is still optimal. Otherwise the steps of
    /// `clamped`, the barrier method and a cold solve are tried in this order until one succeeds, in at most `cap`
    /// iterations in total.
    pub(super) fn warm(&mut self, problem: &Problem, warm: &WarmStart, cap: usize) -> SolveEnd {
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
                return SolveEnd { status: SolveStatus::Converged, residual, ..SolveEnd::BAD };
            }
        }
        let (mut iterations, mut sweeps) = (0, 0);
        if complete {
            // Half of the iterations are reserved for the methods that can start from further away.
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
        SolveEnd { iterations, sweeps, ..outcome }
    }
}
