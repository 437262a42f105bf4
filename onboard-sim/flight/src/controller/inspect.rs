//! The controller looked at, and its settings changed, from outside the flight: for those who replay it.

use super::{ControllerConfig, ControllerState};
use crate::nmpc::{Problem, Solution};

impl ControllerState {
    /// The same memory under other settings. A plan of another sample time or horizon is forgotten: its intervals
    /// would mean other times.
    #[must_use]
    pub fn reconfigured(&self, config: &ControllerConfig) -> Self {
        let (before, after) = (&self.config.profile.nmpc, &config.profile.nmpc);
        let same_intervals = before.sample_time_s.to_bits() == after.sample_time_s.to_bits()
            && before.horizon_steps == after.horizon_steps;
        let flown = self.flown.clone().filter(|_| same_intervals);
        Self { flown, ..Self::new(config) }
    }

    /// The landing problem as the last tick that solved one posed it.
    pub fn last_problem(&self) -> &Problem {
        &self.room.problem
    }

    /// The plan that is being flown or rehearsed, with its multipliers.
    pub fn kept_solution(&self) -> Option<&Solution> {
        self.flown.as_ref().map(|flown| &flown.solution)
    }
}
