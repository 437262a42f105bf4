//! Closed loop: the flight flown again in simulation from a chosen moment, with other settings.
//!
//! The recorded truth is not enough, because no log holds the internal states of gusts, servos and sensors. So the flight
//! is flown again from its start, with the recorded draw and seed, up to that moment, and compared with the record frame
//! by frame on the way. From there on the changed settings apply to world and flight computer. Nothing of the record is
//! used after the start, so this answers what *would have* happened; [`evaluate`](mod@crate::evaluate) answers what the
//! flight computer alone *would have commanded* on the recorded inputs. With nothing changed, a simulated flight is
//! reproduced bit for bit.
//!
//! Faults may be added and taken away ("would it have landed without the GNSS outage?"): then the flight is flown from
//! its beginning with the other faults, and the settings apply from the start, as always.
//!
//! Settings change both flight computer and world. Settings "of the plant" change the world only, timed ones the flight
//! computer only. The crew's abort comes at its recorded frame.

mod prepared;
mod rerun;
mod write;

pub use prepared::Prepared;
pub use write::{ReflyLogError, write_log};

use std::collections::BTreeMap;

use flight::rules::phase::Phase;
use protocol::log::record::Record;
use protocol::log::v1;
use serde::Serialize;
use sim::sortie::SetUpError;
use world::world::WorldError;

use crate::info::VerdictFacts;
use crate::log::{Recording, RecordingError};
use crate::settings::{Setting, SettingError};

/// The controller that flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// As recorded.
    #[default]
    AsRecorded,
    /// The pilot itself.
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
            Self::Nmpc => "nmpc",
            Self::OpenLoop => "open-loop",
            Self::Oscillating => "oscillating",
        }
    }
}

/// Where to begin.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum StartAt {
    /// The first frame of the landing.
    #[default]
    Landing,
    Tick(u64),
    /// The first frame at or after this vehicle time, s.
    Time(f64),
    /// The frame after the one that entered this phase.
    Phase(Phase),
}

/// Which recorded state to begin from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum From {
    /// The simulated world's.
    #[default]
    Truth,
    /// The flight computer's estimate.
    Estimate,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StartState {
    /// The first frame flown again.
    pub tick: u64,
    /// Its vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// The recorded state that was used.
    pub from: From,
    /// Horizontal distance from the pad, m.
    pub x_m: f64,
    /// Altitude, m.
    pub z_m: f64,
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
    /// The requested start is not in the log.
    #[error("{name}: {reason}")]
    Start {
        /// The file.
        name: String,
        /// What was requested and what the log has.
        reason: String,
    },
    /// The flight cannot be set up.
    #[error(transparent)]
    Flight(#[from] SetUpError),
    /// The world cannot be changed this way at the start.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The log does not say how its flight was flown, or this build does not know it.
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
    /// How the frames before the start compare with the record.
    pub reached: Reached,
    /// True impulse over certified impulse.
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

/// A re-flown flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReflownFlight {
    /// All its records, with vehicle times, s.
    pub records: Vec<(f64, Record)>,
    /// Facts that its log has in addition to those of the recorded flight.
    pub run: BTreeMap<String, String>,
    /// The landing verdict; `None` if it did not come down.
    pub verdict: Option<v1::LandingVerdict>,
}

/// Whether a flight can be flown again at all.
///
/// # Errors
/// The log lacks what is needed, or this build cannot use it.
pub fn can_be_flown(recording: &Recording) -> Result<(), ReflyError> {
    rerun::Recorded::of(recording).map(|_| ())
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
