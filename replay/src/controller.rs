//! The controller that a log's ticks came from, run again on their inputs.
//!
//! This is the one place that knows which kind of controller wrote a log's ticks; verification, evaluation and the
//! closed loop go through it.

use flight::controller::{ControllerConfig, ControllerInput, ControllerOutput, ControllerState, step};
use flight::profile::Profile;
use protocol::log::v1;
use tick_log::{TickLogError, input_from_log, tick_to_log};

use crate::settings::Schedule;

/// A controller being fed from a log; ticks must come in order, from the first one on.
#[derive(Debug, Clone)]
pub struct LoggedController {
    state: ControllerState,
    schedule: Option<Schedule>,
}

impl LoggedController {
    /// The controller of a profile before its first tick.
    pub fn new(profile: &Profile) -> Self {
        Self { state: ControllerState::new(&ControllerConfig::from_profile(profile)), schedule: None }
    }

    /// A controller whose settings change in flight, before its first tick.
    pub fn scheduled(schedule: &Schedule) -> Self {
        Self { schedule: Some(schedule.clone()), ..Self::new(schedule.base()) }
    }

    /// Runs one tick.
    pub fn step(&mut self, input: &ControllerInput) -> ControllerOutput {
        if let Some(schedule) = &mut self.schedule {
            schedule.apply(&mut self.state, input.time_s);
        }
        step(&mut self.state, input)
    }

    /// Runs a recorded tick again: its input, and what is decided now. Measured times are copied, since they were
    /// not decided.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's controller.
    pub fn run_again(&mut self, tick: &v1::ControllerTick) -> Result<v1::ControllerTick, TickLogError> {
        let input = input_from_log(&tick.input)?;
        let output = self.step(&input);
        Ok(tick_to_log(&input, &output, self.state.digest(), tick.solve_time_s, tick.deadline_s))
    }

    /// What it remembers.
    pub fn state(&self) -> &ControllerState {
        &self.state
    }
}
