//! The guidance looked at, and its settings changed, from outside the flight: for those who replay it.

use super::situation::Ahead;
use super::{Plane, PoweredGuidance, PoweredSettings, PoweredSituation};
use crate::dynamics::PlanarState;
use crate::nmpc::Problem;
use crate::nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, pose, solve_free_time};
use crate::rigid::RigidState;

/// A landing, planned again alone.
#[derive(Debug, Clone, PartialEq)]
pub struct LandingSolved {
    /// The problem at the final time that the warm plan chose: its conditions, limits and motor.
    pub problem: Problem,
    /// As in flight, from the plan before.
    pub warm: FreeTimeSolution,
    /// The same from nothing.
    pub cold: FreeTimeSolution,
}

impl PoweredGuidance {
    /// The plane of the landing, once there is one.
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// The planned planar states, one step apart, s, if there is a plan, in the frame of the air that moves along the
    /// plane; [`Plane::over_ground`] takes them out of it.
    pub fn planned(&self) -> Option<(&[PlanarState], f64)> {
        let flown = self.flown.as_ref()?;
        Some((&flown.plan.solution.states, flown.plan.solution.step_s))
    }

    /// The same memory under other settings.
    #[must_use]
    pub(crate) fn reconfigured(&self, settings: &PoweredSettings) -> Self {
        Self { settings: *settings, ..self.clone() }
    }

    /// The landing that [`plan`](Self::plan) is about to solve, solved alone; `None` if it solves none here. `self` is as
    /// it was before the plan, `decided` as it is afterwards.
    pub(crate) fn inspect(
        &self,
        decided: &Self,
        time_s: f64,
        state: &RigidState,
        preferred: &PoweredSituation<'_>,
        fallback: Option<&PoweredSituation<'_>>,
    ) -> Option<LandingSolved> {
        let plane = decided.plane?;
        if self.is_flown_out(time_s) {
            return None;
        }
        let mut again = self.clone();
        let (posed, situation) = again.solve_either(time_s, &plane, state, preferred, fallback)?;
        let (ahead, warm) = (Ahead(situation), again.trial);
        let cold = solve_free_time(&posed, &ahead, None);
        Some(LandingSolved { problem: at_final_time(&posed, &ahead, warm.final_time_s), warm, cold })
    }
}

/// The problem of one final time.
fn at_final_time(posed: &FreeTimeProblem, ahead: &Ahead<'_, '_>, final_time_s: f64) -> Problem {
    let mut problem = posed.landing.clone();
    pose(posed, ahead, final_time_s, &mut problem);
    problem
}
