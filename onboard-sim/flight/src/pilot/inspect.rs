//! The flight computer looked at, and its settings changed, from outside the flight: for those who replay it.

use super::known::{Burning, Known};
use super::{FRAMES_PER_PLAN, Pilot, PilotInput, PilotOutput};
use crate::airframe::MassModel;
use crate::atmosphere::Air;
use crate::dynamics::PlanarState;
use crate::mission::{Mission, MissionError};
use crate::powered::{LandingSolved, Plane};

impl Pilot {
    /// The same memory under another mission: another vehicle as it is known, other gains, limits and settings. The length
    /// of a frame, the estimator's configuration and the start stay what they were.
    ///
    /// # Errors
    /// The mission's motor is not to be had.
    pub fn reconfigured(&self, mission: &Mission) -> Result<Self, MissionError> {
        let curve = mission.motor()?;
        let mass = MassModel::new(&mission.airframe.mass, curve.propellant_mass_kg());
        Ok(Self {
            powered: self.powered.reconfigured(&mission.powered),
            aim_loop: self.aim_loop.reconfigured(mission.aim),
            known: Known { mission: mission.clone(), curve, mass, ..self.known.clone() },
            ..self.clone()
        })
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

    /// One frame, and the landing that it plans solved alone; none if it plans none.
    pub fn step_inspected(&mut self, input: &PilotInput) -> (PilotOutput, Option<LandingSolved>) {
        let before = self.clone();
        let output = self.step(input);
        (output, self.landing_planned(&before, input))
    }

    /// What `before` planned at this frame, seen from behind it.
    fn landing_planned(&self, before: &Self, input: &PilotInput) -> Option<LandingSolved> {
        let planned = input.frame.is_multiple_of(FRAMES_PER_PLAN) && self.mode.phase.in_landing_burn();
        let burning_s = self.known.burning_s(input.time_s).filter(|_| planned)?;
        let estimate = self.estimate.as_ref()?;
        // As in the frame itself.
        let density_kg_m3 =
            Air::at_height_m(self.known.mission.pad_altitude_m + estimate.state.position_m.z).density_kg_m3;
        let mass = self.known.mass_now(Some(burning_s));
        let lands_here = self.mode.interlocks.lands_here;
        let burning = Burning { burning_s, mass, density_kg_m3, lands_here };
        let (preferred, fallback) = self.known.situations_to_plan(estimate, &burning, &input.fins_rad);
        before.powered.inspect(&self.powered, input.time_s, &estimate.state, &preferred, fallback.as_ref())
    }
}
