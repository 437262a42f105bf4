//! The controller, fed from a log.

use flight::phase::Phase;
use flight::profile::Profile;
use prost_reflect::MessageDescriptor;
use protocol::log::v1;
use tick_log::TickLogError;

use super::tally::{Moment, Tally};
use crate::controller::LoggedController;
use crate::log::tick_descriptor;

/// Re-executes ticks and compares them; ticks must come in order, from the first one on.
#[derive(Debug)]
pub struct Verifier {
    controller: LoggedController,
    descriptor: Option<MessageDescriptor>,
    pub(super) tally: Tally,
}

impl Verifier {
    /// The controller of a profile before its first tick.
    pub fn new(profile: &Profile) -> Self {
        Self {
            controller: LoggedController::new(profile),
            descriptor: tick_descriptor(),
            tally: Tally::default(),
        }
    }

    /// Re-executes the next tick and compares it with its record.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's controller.
    pub fn check(&mut self, tick: &v1::ControllerTick) -> Result<(), TickLogError> {
        let again = self.controller.run_again(tick)?;
        let moment =
            Moment { tick: tick.input.tick, time_s: tick.input.time_s, phase: phase_name(tick.input.phase) };
        self.tally.compare(moment, self.descriptor.as_ref(), (tick, &again), || apart(tick, &again));
        Ok(())
    }
}

/// How far gimbal commands, rad, and predicted touchdowns, m, are apart.
fn apart(recorded: &v1::ControllerTick, again: &v1::ControllerTick) -> (f64, Option<f64>) {
    let end = |tick: &v1::ControllerTick| {
        let state = &tick.output.predicted_touchdown.state;
        (state.x_m, state.z_m)
    };
    let (then, now) = (end(recorded), end(again));
    let gimbal_rad = (recorded.output.gimbal_command_rad - again.output.gimbal_command_rad).abs();
    (gimbal_rad, Some(libm::hypot(then.0 - now.0, then.1 - now.1)))
}

/// The controller has taken the input, so the phase is a known one.
pub(super) fn phase_name(number: u32) -> &'static str {
    u8::try_from(number).ok().and_then(Phase::from_index).map_or("unknown", Phase::name)
}
