//! A solve from an earlier solution.

use crate::barrier::LAST_BARRIER;
use crate::model::Model;
use crate::outcome::{SolveEnd, Status};
use crate::solver::Workspace;
use crate::start::{self, Start};

/// Largest difference between the start and the earlier solution's expected state at which that solution may still be
/// optimal.
const AS_EXPECTED: f64 = 1e-6;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Solves from an earlier solution. It is returned unchanged if it is still optimal. Otherwise the steps of
    /// `clamped`, the barrier method and a cold solve are tried in this order until one succeeds, in at most `cap`
    /// iterations in total.
    pub(crate) fn warm(&mut self, model: &M, warm: &Start<NX, NU>, cap: usize) -> SolveEnd {
        let complete = start::warm(model, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        let expected = warm.states.first().is_some_and(|state| {
            let pairs = state.iter().zip(model.initial());
            pairs.into_iter().all(|(one, other)| (one - other).abs() <= AS_EXPECTED)
        });
        if expected || !complete {
            self.current.evaluate(model, false);
            let residual = self.residual(model);
            if residual.largest(0.0) <= model.settings().tolerance {
                return SolveEnd { status: Status::Converged, residual, ..SolveEnd::BAD };
            }
        }
        let (mut iterations, mut sweeps) = (0, 0);
        if complete {
            match self.pursue(model, cap) {
                Ok(outcome) => return outcome,
                Err((made, swept)) => (iterations, sweeps) = (made, swept),
            }
            start::warm(model, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        }
        let mut outcome = self.descend(model, LAST_BARRIER, cap - iterations);
        iterations += outcome.iterations;
        sweeps += outcome.sweeps;
        let failed = matches!(outcome.status, Status::Stalled | Status::SubproblemFailed);
        if failed && iterations < cap && !self.allowance.is_spent() {
            outcome = self.cold(model, cap - iterations);
            iterations += outcome.iterations;
            sweeps += outcome.sweeps;
        }
        SolveEnd { iterations, sweeps, ..outcome }
    }
}
