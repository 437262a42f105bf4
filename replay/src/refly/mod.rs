//! Closed loop: the flight flown again in simulation from a chosen moment, with other settings.
//!
//! The simulated plant is put into the recorded state of that moment (position, motion, servos, time since ignition),
//! the controller into what it remembered then, and both fly on to the ground. Nothing of the record is used after
//! the moment of the start, so this answers what *would have* happened; [`evaluate`](mod@crate::evaluate) answers what
//! the controller alone *would have commanded* on the recorded inputs. With nothing changed, a simulated flight comes
//! out the same bit for bit.
//!
//! Settings change the controller and the plant alike, those "of the plant" the plant alone, timed ones the
//! controller alone. Abort under thrust is flown if the record had it at the start.

mod simulation;
mod start;
mod write;

pub use simulation::{ReflownFlight, ReflownTick};
pub use start::{From, StartAt, StartState};
pub use write::{ReflyLogError, write_log};

use flight::profile::Profile;
use flight::verdict::TouchdownLimits;
use onboard_sim::scatter::draw;
use onboard_sim::vehicle::VehicleError;
use protocol::log::v1;
use serde::Serialize;
use tick_log::TickLogError;

use crate::controller::LoggedController;
use crate::info::VerdictFacts;
use crate::log::{Recording, RecordingError};
use crate::settings::{Schedule, Setting, SettingError, profile_with};
use simulation::Simulation;

/// The log's run fact with the settings of the plant alone, in a flight flown again.
const RUN_PLANT_SETTINGS: &str = "plant_settings";

/// Which law flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// As recorded: the landing controller, or the upright law if an abort under thrust was latched.
    #[default]
    AsRecorded,
    /// The upright law alone, as after an abort under thrust.
    Stabiliser,
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
    /// A timed setting of the plant.
    #[error(
        "{setting}: the plant's settings hold from the beginning; only the controller's can change in flight"
    )]
    TimedPlant {
        /// The setting.
        setting: String,
    },
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
    /// True thrust over nominal thrust.
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
    /// Of these, how many recorded ticks of the same number decided the same gimbal command, bit for bit.
    pub commands_identical: usize,
    /// The largest difference of a gimbal command from the recorded one of the same tick, rad.
    pub gimbal_difference_max_rad: f64,
}

/// Flies a recorded flight again.
///
/// # Errors
/// See [`ReflyError`].
pub fn refly(recording: &Recording, options: &ReflyOptions) -> Result<ReflyReport, ReflyError> {
    Ok(refly_flight(recording, options)?.0)
}

/// Flies a recorded flight again and keeps the flight itself.
///
/// # Errors
/// See [`ReflyError`].
pub fn refly_flight(
    recording: &Recording,
    options: &ReflyOptions,
) -> Result<(ReflyReport, ReflownFlight), ReflyError> {
    let toml = recording.profile_toml()?;
    let ticks = recording.replayable_ticks()?;
    let plant_profile = plant_profile(recording, options)?;
    let schedule = Schedule::new(toml, &options.settings)?;
    let start = start::find(recording, ticks, options)?;

    let believed = schedule.base();
    let mut controller = LoggedController::scheduled(&schedule);
    let before: Vec<v1::ControllerTick> =
        ticks.iter().take(start.index).map(|tick| controller.run_again(tick)).collect::<Result<_, _>>()?;
    let seed = options.seed.or_else(|| recording.seed()).unwrap_or(0);
    let dispersed = draw(&plant_profile, seed);
    let limits = TouchdownLimits::from_profile(believed);
    let mut simulation =
        Simulation::new(believed, &plant_profile, &dispersed, controller, &start, options.law)?;
    let flown = ReflownFlight { before, ..simulation.fly(&limits) };

    let (commands_identical, gimbal_difference_max_rad) = compare_commands(ticks, &flown);
    let recorded = recording.verdict.as_ref().map(VerdictFacts::of);
    let reflown = flown.verdict.as_ref().map(VerdictFacts::of);
    let verdict_changed =
        recorded.as_ref().map(|then| Some(then.landed) != reflown.as_ref().map(|now| now.landed));
    let report = ReflyReport {
        kind: "closed loop: flown again in simulation",
        file: recording.name.clone(),
        settings: options.settings.iter().map(ToString::to_string).collect(),
        plant_settings: options.plant_settings.iter().map(ToString::to_string).collect(),
        law: options.law,
        start: start.state,
        thrust_scale: dispersed.thrust_scale,
        recorded,
        margin: reflown.as_ref().map(margin),
        reflown,
        verdict_changed,
        ticks: flown.ticks.len(),
        commands_identical,
        gimbal_difference_max_rad,
    };
    Ok((report, flown))
}

/// What is true: the flown profile, what a flight flown again before had its plant changed by, and the settings.
fn plant_profile(recording: &Recording, options: &ReflyOptions) -> Result<Profile, ReflyError> {
    if let Some(timed) = options.plant_settings.iter().find(|setting| setting.at_s.is_some()) {
        return Err(ReflyError::TimedPlant { setting: timed.to_string() });
    }
    let recorded = recording.head.run.get(RUN_PLANT_SETTINGS).map(String::as_str).unwrap_or_default();
    let mut settings =
        recorded.split_whitespace().map(str::parse).collect::<Result<Vec<Setting>, SettingError>>()?;
    settings.extend(options.settings.iter().filter(|setting| setting.at_s.is_none()).cloned());
    settings.extend(options.plant_settings.iter().cloned());
    Ok(profile_with(recording.profile_toml()?, &settings)?)
}

/// How many ticks command the same as the recorded ones, and by how much the others differ at most, rad.
fn compare_commands(recorded: &[v1::ControllerTick], flown: &ReflownFlight) -> (usize, f64) {
    let mut identical = 0;
    let mut largest_rad = 0.0_f64;
    for now in &flown.ticks {
        let then = usize::try_from(now.record.input.tick).ok().and_then(|number| recorded.get(number));
        if let Some(then) = then {
            let (then_rad, now_rad) = (then.output.gimbal_command_rad, now.record.output.gimbal_command_rad);
            identical += usize::from(then_rad.to_bits() == now_rad.to_bits());
            largest_rad = largest_rad.max((then_rad - now_rad).abs());
        }
    }
    (identical, largest_rad)
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
