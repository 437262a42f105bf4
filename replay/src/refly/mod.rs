//! Closed loop: the flight flown again in simulation from a chosen moment, with other settings.
//!
//! Of a planar landing the simulated plant is put into the recorded state of that moment (position, motion, servos, time since ignition),
//! the controller into what it remembered then, and both fly on to the ground. Nothing of the record is used after
//! the moment of the start, so this answers what *would have* happened; [`evaluate`](mod@crate::evaluate) answers what
//! the controller alone *would have commanded* on the recorded inputs. With nothing changed, a simulated flight comes
//! out the same bit for bit.
//!
//! Of a flight from apogee the recorded truth is not enough (gusts, servos and sensors have memories that no log holds), so
//! it is flown again from apogee with the recorded draw and seed up to that moment, and compared with the record frame by
//! frame on the way; from there on the other settings hold, for world and flight computer alike.
//!
//! Settings change the controller and the plant alike, those "of the plant" the plant alone, timed ones the
//! controller alone. Abort under thrust is flown if the record had it at the start; of a flight
//! from apogee, a crew's abort comes at its recorded frame. There is wind in a flight from apogee
//! only (`truth.wind_m_s`): the planar plant has none.

mod apogee;
mod planar;
mod prepared;
mod simulation;
mod start;
mod write;

pub use prepared::Prepared;
pub use simulation::{ReflownFlight, ReflownTick};
pub use start::{From, StartAt, StartState};
pub use write::{ReflyLogError, write_log};

use campaign::fly::FlyError;
use flight::mission::MissionError;
use onboard_sim::vehicle::VehicleError;
use serde::Serialize;
use tick_log::TickLogError;
use world::world::WorldError;

use crate::info::VerdictFacts;
use crate::log::{Recording, RecordingError};
use crate::settings::{Setting, SettingError};

/// The log's run fact with the settings of the plant alone, in a flight flown again.
const RUN_PLANT_SETTINGS: &str = "plant_settings";

/// Which law flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// As recorded: the landing controller, with an abort that was latched; the upright law if it flew alone.
    #[default]
    AsRecorded,
    /// The upright law alone; of the planar landing.
    Stabiliser,
    /// The pilot itself; of a flight from apogee, as those below.
    Nmpc,
    /// Ignition and fins timed beforehand.
    OpenLoop,
    /// A nose that swings to waste thrust.
    Oscillating,
}

impl Law {
    /// The name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::AsRecorded => "as-recorded",
            Self::Stabiliser => "stabiliser",
            Self::Nmpc => "nmpc",
            Self::OpenLoop => "open-loop",
            Self::Oscillating => "oscillating",
        }
    }
}

/// What to fly again, and how.
#[derive(Debug, Clone, Default)]
pub struct ReflyOptions {
    /// Where to begin.
    pub start: StartAt,
    /// Which recorded state to begin from.
    pub from: From,
    /// Settings of controller and plant; timed ones change the controller alone.
    pub settings: Vec<Setting>,
    /// Settings of the plant alone, on top.
    pub plant_settings: Vec<Setting>,
    /// Which law flies.
    pub law: Law,
    /// Seed of the plant's dispersions instead of the recorded one.
    pub seed: Option<u64>,
}

/// Why a flight cannot be flown again.
#[derive(Debug, thiserror::Error)]
pub enum ReflyError {
    /// The log has not what it takes.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A setting is wrong.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The profile asks for something the simulation does not do.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// A recorded input has no meaning in this build.
    #[error(transparent)]
    Input(#[from] TickLogError),
    /// The moment to start from is not in the log, or not part of a landing.
    #[error("{name}: {reason}")]
    Start {
        /// The file.
        name: String,
        /// What was asked for and what there is.
        reason: String,
    },
    /// The flight from apogee cannot be set up.
    #[error(transparent)]
    Flight(#[from] FlyError),
    /// The moment's world cannot be changed so.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The mission's motor is not to be had.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The log does not say how its flight from apogee was flown, or this build does not know it.
    #[error("{name}: cannot be flown again from apogee: {reason}")]
    Recipe {
        /// The file.
        name: String,
        /// What is missing or unknown.
        reason: String,
    },
    /// Another kind of flight has this.
    #[error("{what} is of {of}; {name} is {is}")]
    OtherKind {
        /// The file.
        name: String,
        /// What was asked for.
        what: String,
        /// Which kind has it.
        of: &'static str,
        /// Which kind this is.
        is: &'static str,
    },
    /// A setting of the controller given to the plant, or the other way round.
    #[error("{setting}: {belongs}")]
    Misplaced {
        /// The setting.
        setting: String,
        /// Whose it is.
        belongs: &'static str,
    },
    /// A timed setting of the plant.
    #[error(
        "{setting}: the plant's settings hold from the beginning; only the controller's can change in flight"
    )]
    TimedPlant {
        /// The setting.
        setting: String,
    },
}

/// How the moment of the start was reached, flying again from apogee.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Reached {
    /// Recorded frames before the start.
    pub frames: usize,
    /// Of these, how many came out as recorded, bit for bit.
    pub identical: usize,
    /// The first that did not.
    pub first_different: Option<u64>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReflyReport {
    /// Says that this is the closed loop.
    pub kind: &'static str,
    /// The log.
    pub file: String,
    /// What was changed, for controller and plant.
    pub settings: Vec<String>,
    /// What was changed for the plant alone.
    pub plant_settings: Vec<String>,
    /// Which law flew.
    pub law: Law,
    /// Where it began.
    pub start: StartState,
    /// Of a flight from apogee: how the moment of the start was reached.
    pub reached: Option<Reached>,
    /// True thrust over nominal thrust; of a flight from apogee impulse over certified impulse.
    pub thrust_scale: f64,
    /// The recorded verdict.
    pub recorded: Option<VerdictFacts>,
    /// The verdict now; `None` if the vehicle did not come down in a minute.
    pub reflown: Option<VerdictFacts>,
    /// Whether landed became not landed or the other way round; `None` if either is not known.
    pub verdict_changed: Option<bool>,
    /// The smallest distance to a touchdown limit, as a fraction of the limit: 1 in its middle, 0 on it, negative
    /// outside. Height is left out, since contact is at the ground. `None` without a contact.
    pub margin: Option<f64>,
    /// Ticks that the controller ran.
    pub ticks: usize,
    /// Of these, how many have a recorded tick of the same number.
    pub commands_recorded: usize,
    /// Of those, how many decided the same gimbal command, bit for bit.
    pub commands_identical: usize,
    /// The largest difference of a gimbal command from the recorded one of the same tick, rad.
    pub gimbal_difference_max_rad: f64,
}

/// Flies a recorded flight again.
///
/// # Errors
/// See [`ReflyError`].
pub fn refly(recording: &Recording, options: &ReflyOptions) -> Result<ReflyReport, ReflyError> {
    Prepared::new(recording, options)?.fly(options)
}

/// Flies a recorded flight again and keeps the flight itself.
///
/// # Errors
/// See [`ReflyError`].
pub fn refly_flight(
    recording: &Recording,
    options: &ReflyOptions,
) -> Result<(ReflyReport, ReflownFlight), ReflyError> {
    Prepared::new(recording, options)?.fly_kept(options)
}

/// Settings of the plant have no time.
fn refuse_timed(plant_settings: &[Setting]) -> Result<(), ReflyError> {
    let timed = plant_settings.iter().find(|setting| setting.at_s.is_some());
    timed.map_or(Ok(()), |timed| Err(ReflyError::TimedPlant { setting: timed.to_string() }))
}

/// A report of a flight that came out so; what only one kind of flight has is filled in by it.
fn report(
    recording: &Recording,
    options: &ReflyOptions,
    start: StartState,
    recorded: Option<VerdictFacts>,
    reflown: Option<VerdictFacts>,
) -> ReflyReport {
    let verdict_changed =
        recorded.as_ref().map(|then| Some(then.landed) != reflown.as_ref().map(|now| now.landed));
    ReflyReport {
        kind: "closed loop: flown again in simulation",
        file: recording.name.clone(),
        settings: options.settings.iter().map(ToString::to_string).collect(),
        plant_settings: options.plant_settings.iter().map(ToString::to_string).collect(),
        law: options.law,
        start,
        reached: None,
        thrust_scale: 1.0,
        recorded,
        margin: reflown.as_ref().map(margin),
        reflown,
        verdict_changed,
        ticks: 0,
        commands_recorded: 0,
        commands_identical: 0,
        gimbal_difference_max_rad: 0.0,
    }
}

/// The smallest distance to a limit as a fraction of it; see [`ReflyReport::margin`].
pub fn margin(verdict: &VerdictFacts) -> f64 {
    let fractions = verdict.limits.iter().filter(|limit| limit.name != "altitude").map(|limit| {
        let half_width = 0.5 * (limit.maximum - limit.minimum);
        let fraction = (limit.value - limit.minimum).min(limit.maximum - limit.value) / half_width;
        // What is not a number is as far outside as can be.
        if fraction.is_nan() { f64::NEG_INFINITY } else { fraction }
    });
    fractions.fold(f64::INFINITY, f64::min)
}
