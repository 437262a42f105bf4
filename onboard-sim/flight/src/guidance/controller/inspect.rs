//! Reads the controller's memory and changes its settings, for a replay.

use super::{ControllerConfig, ControllerState};
use nmpc::{Problem, Solution};

impl ControllerState {
    /// The same memory with other settings. A plan with another sample time or horizon is dropped, because its
    /// intervals would be at other times.
    #[must_use]
    pub fn reconfigured(&self, config: &ControllerConfig) -> Self {
        let (before, after) = (&self.config.profile.nmpc, &config.profile.nmpc);
        let same_intervals = before.sample_time_s.to_bits() == after.sample_time_s.to_bits()
            && before.horizon_steps == after.horizon_steps;
        let flown = self.flown.clone().filter(|_| same_intervals);
        Self { flown, ..Self::new(config) }
    }

    /// The landing problem of the last tick that solved one.
    pub fn last_problem(&self) -> &Problem {
        &self.room.problem
    }

    /// The plan being flown or rehearsed, with its multipliers.
    pub fn kept_solution(&self) -> Option<&Solution> {
        self.flown.as_ref().map(|flown| &flown.solution)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ControllerInput, step};
    use super::*;
    use crate::rules::phase::Phase;
    use crate::vehicle::profile::Profile;

    /// A controller that has rehearsed once.
    fn rehearsed(profile: &Profile) -> ControllerState {
        let mut controller = ControllerState::new(&ControllerConfig::from_profile(profile));
        let input = ControllerInput {
            tick: 0,
            time_s: 0.0,
            phase: Phase::PadIdle,
            time_since_ignition_s: 0.0,
            state: profile.start.planar_state(),
            gimbal_applied_rad: 0.0,
            thrust_scale: 1.0,
            degraded: false,
            lands_here: false,
            deadline_missed: false,
        };
        step(&mut controller, &input);
        controller
    }

    #[test]
    fn the_plan_is_kept_with_other_weights_and_dropped_with_another_horizon() {
        let mut profile = crate::vehicles::profile::builtin("paper-calibrated").unwrap();
        let controller = rehearsed(&profile);
        let intervals = controller.last_problem().intervals();
        assert_eq!(controller.kept_solution().unwrap().inputs_rad.len(), intervals);
        profile.nmpc.weights.w *= 2.0;
        let other = controller.reconfigured(&ControllerConfig::from_profile(&profile));
        assert_eq!(other.digest(), controller.digest());
        assert_eq!(other.config().profile(), &profile);
        profile.nmpc.horizon_steps += 1;
        let forgetful = controller.reconfigured(&ControllerConfig::from_profile(&profile));
        assert_eq!(forgetful.kept_solution(), None);
    }
}
