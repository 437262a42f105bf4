//! Reads the guidance's memory and changes its settings, for a replay.

use super::situation::Ahead;
use super::{Plane, PoweredGuidance, PoweredSettings, PoweredSituation};
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::rigid::RigidState;
use nmpc::Problem;
use nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, pose, solve_free_time};

/// A landing that is planned again outside the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct LandingSolved {
    /// The problem at the final time of the warm plan, with its conditions, limits and motor.
    pub problem: Problem,
    /// Solved as in flight, from the previous plan.
    pub warm: FreeTimeSolution,
    /// Solved cold.
    pub cold: FreeTimeSolution,
}

impl PoweredGuidance {
    /// The plane of the landing, once there is one.
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// The planned planar states and the step between them, s, if there is a plan. They are in the frame that moves
    /// with the air along the plane; [`Plane::over_ground`] converts them.
    pub fn planned(&self) -> Option<(&[PlanarState], f64)> {
        if let Some(in_space) = self.space.projected() {
            return Some(in_space);
        }
        let flown = self.flown.as_ref()?;
        Some((&flown.plan.solution.states, flown.plan.solution.step_s))
    }

    /// The same memory with other settings.
    #[must_use]
    pub(crate) fn reconfigured(&self, settings: &PoweredSettings) -> Self {
        Self { settings: *settings, ..self.clone() }
    }

    /// Solves the landing that [`plan`](Self::plan) solves, outside the flight; `None` if there is none. `self` is the
    /// memory before the plan, `decided` the memory after it.
    pub(crate) fn inspect(
        &self,
        decided: &Self,
        time_s: f64,
        state: &RigidState,
        preferred: &PoweredSituation<'_>,
        fallback: Option<&PoweredSituation<'_>>,
    ) -> Option<LandingSolved> {
        let plane = decided.plane?;
        if self.is_flown_out(time_s) || self.settings.space.is_some() {
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
