//! For replay: reads the pilot's state and changes its settings from outside the flight.

use super::known::{Burning, Known};
use super::{FRAMES_PER_PLAN, Pilot, PilotInput};
use crate::guidance::powered::{LandingSolved, Plane};
use crate::rules::phase::Mode;
use crate::vehicle::airframe::MassModel;
use crate::vehicle::atmosphere::Air;
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::mission::Mission;

impl Pilot {
    /// The same memory with another mission: other vehicle data, gains, limits and settings. The frame length, the
    /// estimator's configuration and the start stay as they were.
    #[must_use]
    pub fn reconfigured(&self, mission: &Mission) -> Self {
        let mass = MassModel::new(&mission.airframe.mass, mission.motor_curve.propellant_mass_kg());
        Self {
            powered: self.powered.reconfigured(&mission.powered),
            aim_loop: self.aim_loop.reconfigured(mission.aim),
            known: Known { mission: mission.clone(), mass, ..self.known.clone() },
            ..self.clone()
        }
    }

    /// The states of the plan being flown and the step between them, s, if there is a plan. They lie in the plane of
    /// the landing, in the frame that moves with the wind along that plane and coincided with the ground's when the
    /// plan began.
    pub fn planned(&self) -> Option<(&[PlanarState], f64)> {
        self.powered.planned()
    }

    /// The plane of the landing, once it is chosen.
    pub fn plane(&self) -> Option<&Plane> {
        self.powered.plane()
    }

    /// The mission it flies.
    pub fn mission(&self) -> &Mission {
        &self.known.mission
    }

    /// The landing planned in this frame, solved separately; `None` if none was planned. `before` is this pilot one
    /// frame earlier.
    pub(crate) fn landing_planned(
        &self,
        before: &Self,
        mode: &Mode,
        input: &PilotInput,
    ) -> Option<LandingSolved> {
        let planned = input.frame.is_multiple_of(FRAMES_PER_PLAN) && mode.phase.in_landing_burn();
        let burning_s = self.known.burning_s(input.time_s).filter(|_| planned)?;
        let estimate = self.estimate.as_ref()?;
        // As in the frame itself, `Pilot::step`.
        let density_kg_m3 =
            Air::at_height_m(self.known.mission.pad_altitude_m + estimate.state.position_m.z).density_kg_m3;
        let mass = self.known.mass_now(Some(burning_s));
        let lands_here = mode.interlocks.lands_here;
        let burning = Burning { burning_s, mass, density_kg_m3, lands_here };
        let (preferred, fallback) = self.known.situations_to_plan(estimate, &burning, &input.fins_rad);
        before.powered.inspect(&self.powered, input.time_s, &estimate.state, &preferred, fallback.as_ref())
    }
}
