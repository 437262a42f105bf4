//! Closed loop: the flight flown again in simulation from a chosen moment, with other settings.
//!
//! For a planar landing, the simulated plant starts in the recorded state of that moment (position, motion, servos,
//! time since ignition) and the controller with the memory it had then. Both continue to the ground. Nothing of the
//! record is used after the start, so this answers what *would have* happened; [`evaluate`](mod@crate::evaluate)
//! answers what the controller alone *would have commanded* on the recorded inputs. With nothing changed, a simulated
//! flight is reproduced bit for bit.
//!
//! For a flight from apogee, the recorded truth is not enough, because no log holds the internal states of gusts,
//! servos and sensors. So the flight is flown again from its start, with the recorded draw and seed, up to that moment,
//! and compared with the record frame by frame on the way. From there on the changed settings apply to world and flight
//! computer.
//!
//! Faults may be added and taken away ("would it have landed without the GNSS outage?"): then the flight is flown from
//! its beginning with the other faults, and the settings apply from the start, as always.
//!
//! Settings change both controller and plant. Settings "of the plant" change the plant only, timed ones the controller
//! only. An abort under thrust is flown if the record had it at the start; in a flight from apogee, the crew's abort
//! comes at its recorded frame. Only a flight from apogee has wind (`truth.wind_m_s`); the planar plant has none.

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

use flight::computer::plane::PlaneError;
use serde::Serialize;
use sim::sortie::SetUpError;
use tick_log::TickLogError;
use world::world::WorldError;

use crate::info::VerdictFacts;
use crate::log::{FlightKind, Recording, RecordingError};
use crate::settings::{Setting, SettingError};

/// Key of the run fact that holds the plant's settings in the log of a re-flown flight.
const RUN_PLANT_SETTINGS: &str = "plant_settings";

/// The controller that flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// As recorded: the landing controller, with a latched abort if there was one; the upright law if it flew alone.
    #[default]
    AsRecorded,
    /// The upright law alone; for planar landings only.
    Stabiliser,
    /// The pilot itself. This law and the laws below are for flights from apogee only.
    Nmpc,
    /// Ignition and fins at times fixed in advance.
    OpenLoop,
    /// The nose swings to waste thrust.
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

/// Options of a re-flown flight.
#[derive(Debug, Clone, Default)]
pub struct ReflyOptions {
    /// Where to begin.
    pub start: StartAt,
    /// Which recorded state to begin from.
    pub from: From,
    /// Settings of controller and plant; timed ones change the controller only.
    pub settings: Vec<Setting>,
    /// Additional settings of the plant only.
    pub plant_settings: Vec<Setting>,
    /// The controller that flies.
    pub law: Law,
    /// Seed of the plant's dispersions instead of the recorded seed.
    pub seed: Option<u64>,
    /// Other faults than the recorded ones.
    pub faults: FaultChanges,
}

/// How the faults of a flight differ from the recorded ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FaultChanges {
    /// Faults that happen as well, as on the command line of a simulated flight.
    pub with: Vec<String>,
    /// Recorded faults that do not happen: each by its name, or in full as it was given; `all` for every one.
    pub without: Vec<String>,
}

impl FaultChanges {
    fn is_none(&self) -> bool {
        self.with.is_empty() && self.without.is_empty()
    }
}

/// Why a flight cannot be flown again.
#[derive(Debug, thiserror::Error)]
pub enum ReflyError {
    /// The log lacks the records that are needed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A setting is wrong.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The profile needs something that the simulation cannot do.
    #[error(transparent)]
    Vehicle(#[from] PlaneError),
    /// This build cannot interpret a recorded input.
    #[error(transparent)]
    Input(#[from] TickLogError),
    /// The requested start is not in the log, or not part of a landing.
    #[error("{name}: {reason}")]
    Start {
        /// The file.
        name: String,
        /// What was requested and what the log has.
        reason: String,
    },
    /// The flight from apogee cannot be set up.
    #[error(transparent)]
    Flight(#[from] SetUpError),
    /// The world cannot be changed this way at the start.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The log does not say how its flight from apogee was flown, or this build does not know it.
    #[error("{name}: cannot be flown again from its start: {reason}")]
    Recipe {
        /// The file.
        name: String,
        /// What is missing or unknown.
        reason: String,
    },
    /// A fault cannot be added or left out.
    #[error("{name}: {reason}")]
    Fault {
        /// The file.
        name: String,
        reason: String,
    },
    /// The request applies only to another kind of flight.
    #[error("{what} is only for {of}; {name} is {is}")]
    OtherKind {
        /// The file.
        name: String,
        /// The request.
        what: String,
        /// The kind of flight that has it.
        of: &'static str,
        /// The kind of this flight.
        is: &'static str,
    },
    /// A setting of the controller given to the plant, or the other way round.
    #[error("{setting}: {belongs}")]
    Misplaced {
        setting: String,
        /// The owner of the setting.
        belongs: &'static str,
    },
    /// A setting of the plant has a time.
    #[error(
        "{setting}: the plant's settings hold from the beginning; only the controller's can change in flight"
    )]
    TimedPlant { setting: String },
}

/// How the re-flown frames before the start compare with the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Reached {
    /// Recorded frames before the start.
    pub frames: usize,
    /// Of these, how many were reproduced bit for bit.
    pub identical: usize,
    /// The first frame that was not.
    pub first_different: Option<u64>,
}

/// The result of flying again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReflyReport {
    /// Marks the report as closed loop.
    pub kind: &'static str,
    /// The log.
    pub file: String,
    /// The changed settings of controller and plant.
    pub settings: Vec<String>,
    /// The changed settings of the plant only.
    pub plant_settings: Vec<String>,
    /// The controller that flew.
    pub law: Law,
    /// The faults that differ from the recorded ones, from the beginning of the flight on.
    pub faults: FaultChanges,
    /// The seed of the plant's draw, if it is not the recorded one.
    pub seed: Option<u64>,
    pub start: StartState,
    /// For a flight from apogee: how the frames before the start compare with the record.
    pub reached: Option<Reached>,
    /// True thrust over nominal thrust; for a flight from apogee, impulse over certified impulse.
    pub thrust_scale: f64,
    /// The recorded verdict.
    pub recorded: Option<VerdictFacts>,
    /// The verdict now; `None` if the vehicle did not come down in a minute.
    pub reflown: Option<VerdictFacts>,
    /// Whether the verdict changed between landed and not landed; `None` if either is unknown.
    pub verdict_changed: Option<bool>,
    /// The smallest distance to a touchdown limit, as a fraction of the limit: 1 in the middle of the range, 0 on the
    /// limit, negative outside. Height is left out, because contact is at the ground. `None` without a contact.
    pub margin: Option<f64>,
    /// Ticks that the controller ran.
    pub ticks: usize,
    /// Of these, how many have a recorded tick of the same number.
    pub commands_recorded: usize,
    /// Of those, how many commanded the same gimbal angle, bit for bit.
    pub commands_identical: usize,
    /// The largest difference of a gimbal command from the recorded command of the same tick, rad.
    pub gimbal_difference_max_rad: f64,
}

/// Whether a flight can be flown again at all.
///
/// # Errors
/// The log lacks what is needed, or this build cannot use it.
pub fn can_be_flown(recording: &Recording) -> Result<(), ReflyError> {
    match recording.kind() {
        FlightKind::InSpace => apogee::can_be_flown(recording),
        FlightKind::Planar => {
            recording.replayable_ticks()?;
            Ok(recording.profile().map(|_| ())?)
        }
    }
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

/// Refuses a time on settings of the plant.
fn refuse_timed(plant_settings: &[Setting]) -> Result<(), ReflyError> {
    let timed = plant_settings.iter().find(|setting| setting.at_s.is_some());
    timed.map_or(Ok(()), |timed| Err(ReflyError::TimedPlant { setting: timed.to_string() }))
}

/// The report of a re-flown flight, without the fields that only one kind of flight has.
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
        faults: options.faults.clone(),
        seed: options.seed,
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
        // A NaN counts as infinitely far outside.
        if fraction.is_nan() { f64::NEG_INFINITY } else { fraction }
    });
    fractions.fold(f64::INFINITY, f64::min)
}
