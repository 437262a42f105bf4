//! Rehearsal of the landing at power-up, on a board: without a simulated world, the vehicle falls
//! as in its model, and then moves as planned.
//!
//! It shows whether the planner works on this machine, and whether a landing is possible with this
//! vehicle, motor and mission.

use nalgebra::{Vector2, Vector3};

use super::planner::{Planner, Problem};
use super::vehicle_model::{Burning, VehicleModel};
use crate::computer::Rehearsed;
use crate::estimation::estimator::Estimate;
use crate::rules::arming::PredictedLanding;
use crate::rules::verdict::{LandingVerdict, Limits};
use crate::text::text;
use crate::vehicle::rigid::RigidState;

/// Interval of the search for the ignition in the fall, s, and number of steps.
const LOOK_S: f64 = 0.05;
const LOOKS: u32 = 400;
/// Upper bound of the plans of a burn.
const MOST_PLANS: u32 = 200;

impl Planner {
    /// Rehearses the landing, with no plan flown. It takes some seconds on a board.
    pub(super) fn rehearse(&mut self) -> Rehearsed {
        let (mut plans, mut converged) = (0, 0);
        let mut flown = self.model().at_thrust_onset();
        while let Some((estimate, burning)) = flown.take().filter(|_| plans < MOST_PLANS) {
            self.request(estimate.time_s, &estimate, Problem::Landing(burning.clone()));
            self.solve();
            // The vehicle moves as planned before, until the plan is ready.
            let (estimate, burning) = self.later(&estimate, &burning);
            let Some(lands) = self.fly_on() else { break };
            plans += 1;
            converged += u32::from(lands);
            // Twice that time is the period of plans.
            flown = Some(self.later(&estimate, &burning));
        }
        let mission = &self.model().mission;
        let verdict = LandingVerdict::judge_plan(&Limits::from(&mission.leg_limits), &self.end());
        let rehearsed = Rehearsed {
            warm: converged > 0 && verdict.is_inside(),
            found: text!("planned, {converged} of {plans} plans converged"),
            landing: (plans > 0).then(|| PredictedLanding::from(&verdict)),
        };
        rehearsed.explained(mission)
    }
}

impl VehicleModel {
    /// The vehicle at thrust onset, at time zero, after a fall with open fins in still air; `None`
    /// if no height suits the motor.
    fn at_thrust_onset(&self) -> Option<(Estimate, Burning)> {
        let (mission, mass, fins_m2) =
            (&self.mission, self.mass.at(0.0), self.airframe().open_fin_drag_area_m2());
        let feet_m = self.feet_below_cg_m(&mass);
        let exact = |state| Estimate::exact(0.0, state, Vector3::zeros(), Vector2::zeros());
        let density_kg_m3 = self.density_kg_m3(&exact(RigidState::upright(0.0)));
        let column = self.column(density_kg_m3, mission.soft_tilt_deg);
        let at_onset = (0..LOOKS).find_map(|look| {
            let after_s = f64::from(look) * LOOK_S;
            let (height_m, vertical_m_s) =
                column.fallen(mission.start_height_m() - feet_m, 0.0, fins_m2, after_s);
            let curve = &mission.motor_curve;
            let looked = mission.ignition.prediction(&column, curve, height_m, vertical_m_s, fins_m2);
            looked.overdue_s(looked.onset_height_m).map(|_| looked)
        })?;
        let mut estimate = exact(RigidState::upright(at_onset.onset_height_m + feet_m));
        estimate.state.velocity_m_s.z = at_onset.onset_vertical_m_s;
        // Drag is neglected.
        estimate.specific_force_m_s2.x = self.burn().mean_thrust_n(0.0, 0.05) / mass.mass_kg;
        Some((estimate, Burning { burning_s: 0.0, mass, density_kg_m3, lands_in_place: false }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::computer::Computer;
    use crate::vehicles::mission::test_missions::TEST_MISSIONS;
    use crate::vehicles::mission::{BUILTIN, from_toml};

    /// For a vehicle that no height lands, the builder needs the cause, not the parachute.
    #[test]
    fn a_vehicle_that_does_not_match_its_motor_is_reported() {
        let (name, text) = BUILTIN[1];
        for (kg, words) in [("5.0", "too heavy for its motor"), ("2.2", "too light for its motor")] {
            let text = text.replace("loaded_kg = 3.7", &format!("loaded_kg = {kg}"));
            let mission = crate::vehicles::mission::from_toml(&text, name).unwrap();
            let found = text!("ended, 0 of 0 plans converged");
            let rehearsed = Rehearsed { warm: false, found, landing: None };
            let explained = rehearsed.clone().explained(&mission);
            assert!(explained.found.starts_with(words), "{explained:?}");
            let landed = Rehearsed { warm: true, ..rehearsed };
            assert_eq!(landed.clone().explained(&mission), landed);
        }
    }

    /// Every mission that can be flown can be armed on a board, and the rehearsal leaves the memory
    /// unchanged.
    #[test]
    fn every_mission_rehearses_a_landing() {
        for (name, text) in BUILTIN.iter().chain(&TEST_MISSIONS) {
            let mission = from_toml(text, name).unwrap();
            let initial = RigidState::upright(mission.start.height_m);
            let mut computer = Computer::at_power_up(&mission, &initial);
            let before = computer.digest();
            let rehearsed = computer.rehearse().unwrap();
            assert!(
                rehearsed.warm && rehearsed.landing.as_ref().is_some_and(|landing| landing.lands),
                "{name}: {rehearsed:?}"
            );
            assert_eq!(computer.digest(), before, "{name}");
            assert_eq!(computer.released(0).rehearse(), None, "{name}");
        }
    }
}
