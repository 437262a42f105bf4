//! The controller that a log's ticks came from, run again on their inputs.
//!
//! There are two: that of the planar landing ([`LoggedController`], ten ticks a second) and the flight computer of a flight
//! from apogee ([`LoggedPilot`], two hundred frames a second, of which some plan). This is the one place that knows which
//! kind wrote a log's ticks; verification and evaluation are written for any [`Replayed`].

mod computer;
mod pilot;
mod planar;
mod plans;

pub use computer::{LoggedComputer, StartError};
pub use pilot::{FrameError, LoggedPilot, SETTINGS_IN_FLIGHT, settings_in_flight};
pub(crate) use pilot::{REFLOWN_AT, REFLOWN_BY};
pub use planar::LoggedController;
pub use plans::{NewPlans, path_in_world_m};

use prost::Message;
use prost_reflect::MessageDescriptor;
use serde::Serialize;

/// A controller that can be fed from a log; ticks must come in order, from the first one on.
pub trait Replayed {
    /// Its record in a log.
    type Tick: Message;
    /// Why a tick cannot be run again.
    type Error: std::error::Error + 'static;

    /// Describes the record's fields.
    fn descriptor() -> Option<MessageDescriptor>;

    /// Which tick a record is of.
    fn moment(tick: &Self::Tick) -> Moment;

    /// How far gimbal commands, rad, and, where a record has them, predicted touchdowns, m, are apart.
    fn apart(a: &Self::Tick, b: &Self::Tick) -> (f64, Option<f64>);

    /// Runs a recorded tick again: its input, and what is decided now. Measured times are copied, since they were
    /// not decided.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's controller.
    fn run_again(&mut self, tick: &Self::Tick) -> Result<Self::Tick, Self::Error>;
}

/// A computer whose decisions can be told in short.
pub trait Decides: Replayed {
    /// A summary of a tick's decision; `self` has just run that tick.
    fn decided(&self, tick: &Self::Tick) -> Decided;
}

/// A tick, its vehicle time and its phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
}

/// What a tick decides, in short.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decided {
    /// Gimbal command, rad: one angle, or pitch and yaw.
    pub gimbal_rad: Vec<f64>,
    /// Fin commands, rad.
    pub fins_rad: Vec<f64>,
    /// The phase: given to the planar landing's controller, decided by a flight computer.
    pub phase: &'static str,
    /// What decided the gimbal.
    pub level: &'static str,
    /// Cost of the last plan.
    pub cost: f64,
    /// Iterations of its solve.
    pub iterations: u32,
    /// Whether the plan's end keeps every touchdown limit (planar landing) or all that was asked of it (flight computer);
    /// `None` without a plan.
    pub plan_lands: Option<bool>,
}

fn phase_name(number: u32) -> &'static str {
    let phase = u8::try_from(number).ok().and_then(flight::rules::phase::Phase::from_index);
    phase.map_or("unknown", flight::rules::phase::Phase::name)
}
