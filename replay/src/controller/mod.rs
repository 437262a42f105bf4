//! The controller that a log's ticks came from, run again on their inputs.
//!
//! There are three: the whole flight computer ([`LoggedComputer`], every frame from power-up on), the controller of the
//! planar landing ([`LoggedController`], ten ticks a second) and the pilot of a flight from apogee ([`LoggedPilot`],
//! two hundred frames a second, some of which plan). Verification and evaluation are written for any [`Replayed`].

mod computer;
mod pilot;
mod planar;
mod plans;

pub use computer::{LoggedComputer, StartError};
pub use pilot::{LoggedPilot, SETTINGS_IN_FLIGHT, settings_in_flight};
pub(crate) use pilot::{REFLOWN_AT, REFLOWN_BY};
pub use planar::LoggedController;
pub use plans::{NewPlans, path_in_world_m};

pub use tick_log::again::FrameError;

use prost::Message;
use prost_reflect::MessageDescriptor;
use serde::Serialize;

/// A controller that can be run on the ticks of a log; ticks must come in order, from the first tick on.
pub trait Replayed {
    /// The record of a tick in a log.
    type Tick: Message;
    /// Why a tick cannot be run again.
    type Error: std::error::Error + 'static;

    /// Describes the record's fields.
    fn descriptor() -> Option<MessageDescriptor>;

    /// The tick that a record belongs to.
    fn moment(tick: &Self::Tick) -> Moment;

    /// Distance between the gimbal commands of two records, rad, and between their predicted touchdowns, m, if they
    /// have any.
    fn apart(a: &Self::Tick, b: &Self::Tick) -> (f64, Option<f64>);

    /// Runs a recorded tick again: the result has the recorded input and the new decision. Measured times are copied,
    /// because they were not decided.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's controller.
    fn run_again(&mut self, tick: &Self::Tick) -> Result<Self::Tick, Self::Error>;
}

/// A computer whose decisions can be summarised.
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

/// Summary of a tick's decision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decided {
    /// Gimbal command, rad: one angle, or pitch and yaw.
    pub gimbal_rad: Vec<f64>,
    /// Fin commands, rad.
    pub fins_rad: Vec<f64>,
    /// The phase: an input of the planar landing's controller, a decision of a flight computer.
    pub phase: &'static str,
    /// The control level that decided the gimbal command.
    pub level: &'static str,
    /// Cost of the last plan.
    pub cost: f64,
    /// Iterations of the last plan's solve.
    pub iterations: u32,
    /// Whether the end of the plan keeps every touchdown limit (planar landing) or meets every condition (flight
    /// computer); `None` without a plan.
    pub plan_lands: Option<bool>,
}

fn phase_name(number: u32) -> &'static str {
    let phase = u8::try_from(number).ok().and_then(flight::rules::phase::Phase::from_index);
    phase.map_or("unknown", flight::rules::phase::Phase::name)
}
