//! The flight computer from apogee to touchdown, fed from a log.

use flight::estimator::StartUncertainty;
use flight::mission::{Mission, MissionError};
use flight::pilot::Pilot;
use prost_reflect::MessageDescriptor;
use protocol::log::flight_v1;
use tick_log::pilot::{PilotLogError, input_from_log, state_from_log, tick_to_log};

use super::tally::{Moment, Tally};
use super::verifier::phase_name;
use crate::log::pilot_descriptor;

/// The number of the first frame.
const FIRST_FRAME: u64 = 1;
/// Length of a frame, ms; see [`flight::pilot`].
const FRAME_MS: f64 = 5.0;

/// Re-executes frames and compares them; frames must come in order. Missing ones are what a restarted computer leaves:
/// it is restarted here too.
#[derive(Debug)]
pub struct PilotVerifier {
    pilot: Pilot,
    next: u64,
    restarts: u64,
    descriptor: Option<MessageDescriptor>,
    pub(super) tally: Tally,
}

/// Why a frame was not compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Its input has no meaning in this build.
    #[error(transparent)]
    Input(#[from] PilotLogError),
    /// It was there already, or comes too late.
    #[error("frame {frame} comes after frame {after}: nothing behind it was compared")]
    Order {
        /// Its number.
        frame: u64,
        /// The frame before it in the log.
        after: u64,
    },
}

impl PilotVerifier {
    /// The flight computer of a mission as it was let go.
    ///
    /// # Errors
    /// The text is no mission of this build, or its motor is not to be had.
    pub fn new(mission_toml: &str, start: &flight_v1::PilotStart) -> Result<Self, MissionError> {
        let mut mission = Mission::from_toml(mission_toml, "profile.toml")?;
        mission.steered = start.steered;
        mission.ignition.fixed_height_m = start.fixed_ignition_height_m;
        let believed = state_from_log(&start.believed);
        let pilot = Pilot::at_apogee(&mission, start.time_s, &believed, &StartUncertainty::at_apogee())?;
        Ok(Self {
            pilot,
            next: FIRST_FRAME,
            restarts: 0,
            descriptor: pilot_descriptor(),
            tally: Tally::default(),
        })
    }

    /// How often the flight computer was restarted.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Re-executes the next frame and compares it with its record.
    ///
    /// # Errors
    /// The frame is out of order, or its input cannot be given to this build's flight computer.
    pub fn check(&mut self, tick: &flight_v1::PilotTick) -> Result<(), FrameError> {
        let input = input_from_log(&tick.input)?;
        let frame = input.frame;
        if frame < self.next {
            return Err(FrameError::Order { frame, after: self.next - 1 });
        }
        if frame > self.next {
            // It was dead meanwhile, and came back at the end of the frame before this.
            self.pilot = self.pilot.restarted((frame - 1) as f64 * FRAME_MS * 1e-3);
            self.restarts += 1;
        }
        self.next = frame.saturating_add(1);
        let output = self.pilot.step(&input);
        let again = tick_to_log(&input, &output, self.pilot.digest());
        let moment =
            Moment { tick: frame, time_s: input.time_s, phase: phase_name(u32::from(output.phase.index())) };
        self.tally.compare(moment, self.descriptor.as_ref(), (tick, &again), || {
            let axes = tick.output.gimbal_rad.iter().zip(&again.output.gimbal_rad);
            (axes.map(|(then, now)| (then - now).abs()).fold(0.0, f64::max), None)
        });
        Ok(())
    }
}
