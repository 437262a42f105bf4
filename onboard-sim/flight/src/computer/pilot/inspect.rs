//! The flight computer looked at, and its settings changed, from outside the flight: for those who replay it.

use super::known::{Burning, Known};
use super::{FRAMES_PER_PLAN, Pilot, PilotInput};
use crate::guidance::powered::{LandingSolved, Plane};
use crate::rules::phase::Mode;
use crate::vehicle::airframe::MassModel;
use crate::vehicle::atmosphere::Air;
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::mission::Mission;

impl Pilot {
    /// The same memory under another mission: another vehicle as it is known, other gains, limits and settings. The length
    /// of a frame, the estimator's configuration and the start stay what they were.
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

    /// The states of the plan that is flown, one step apart, s, if there is one: in that plane, in the frame that moves with
    /// the wind along it and was the ground's where the plan began.
    pub fn planned(&self) -> Option<(&[PlanarState], f64)> {
        self.powered.planned()
    }

    /// The plane of its landing, once there is one.
    pub fn plane(&self) -> Option<&Plane> {
        self.powered.plane()
    }

    /// The mission it flies.
    pub fn mission(&self) -> &Mission {
        &self.known.mission
    }

    /// The landing that `before`, this pilot a frame earlier, planned in this frame, solved alone; none if it planned none.
    pub(crate) fn landing_planned(
        &self,
        before: &Self,
        mode: &Mode,
        input: &PilotInput,
    ) -> Option<LandingSolved> {
        let planned = input.frame.is_multiple_of(FRAMES_PER_PLAN) && mode.phase.in_landing_burn();
        let burning_s = self.known.burning_s(input.time_s).filter(|_| planned)?;
        let estimate = self.estimate.as_ref()?;
        // As in the frame itself.
        let density_kg_m3 =
            Air::at_height_m(self.known.mission.pad_altitude_m + estimate.state.position_m.z).density_kg_m3;
        let mass = self.known.mass_now(Some(burning_s));
        let lands_here = mode.interlocks.lands_here;
        let burning = Burning { burning_s, mass, density_kg_m3, lands_here };
        let (preferred, fallback) = self.known.situations_to_plan(estimate, &burning, &input.fins_rad);
        before.powered.inspect(&self.powered, input.time_s, &estimate.state, &preferred, fallback.as_ref())
    }
}
