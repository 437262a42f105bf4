//! Open loop: the recorded inputs, other settings, the controller alone.
//!
//! Every tick is given what it was given in flight, so the vehicle goes where it went, whatever is commanded now. The
//! answer is what the controller *would have commanded*, beside what it did; what *would have happened* is for the
//! [closed loop](mod@crate::refly).

use flight::controller::ControlLevel;
use flight::dynamics::PlanarState;
use flight::phase::Phase;
use flight::verdict::{LandingVerdict, TouchdownLimits};
use protocol::log::v1;
use serde::Serialize;
use tick_log::{TickLogError, state_from_log};

use crate::controller::LoggedController;
use crate::log::{Recording, RecordingError};
use crate::settings::{Schedule, Setting, SettingError};

/// Sections that the controller never sees.
const NOT_THE_CONTROLLERS: [&str; 4] = ["plant.", "dispersion.", "arming.", "gate."];

/// Why a flight cannot be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// The log has not what it takes.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A setting is wrong.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A recorded input has no meaning in this build.
    #[error(transparent)]
    Input(#[from] TickLogError),
    /// A setting that the controller does not have.
    #[error(
        "{path} is not the controller's: on recorded inputs it changes nothing; refly flies the flight again with it"
    )]
    NotTheControllers {
        /// The setting.
        path: String,
    },
    /// Other ticks than the recorded ones.
    #[error(
        "nmpc.sample_time_s cannot be changed on recorded inputs: there is one input every {recorded_s} s; refly flies the flight again with it"
    )]
    SampleTime {
        /// As recorded, s.
        recorded_s: f64,
    },
}

/// A tick, as it was decided and as it would be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluatedTick {
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    /// Its phase.
    pub phase: &'static str,
    /// As recorded.
    pub recorded: Decided,
    /// With the other settings.
    pub evaluated: Decided,
}

/// What a tick decides, in short.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decided {
    /// Gimbal command, rad.
    pub gimbal_rad: f64,
    /// What decided it.
    pub level: &'static str,
    /// Cost of the plan.
    pub cost: f64,
    /// Newton iterations.
    pub iterations: u32,
    /// Whether the plan's end keeps every touchdown limit; `None` without a plan.
    pub plan_lands: Option<bool>,
}

/// What an evaluation found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluateReport {
    /// Says that this is the open loop.
    pub kind: &'static str,
    /// The log.
    pub file: String,
    /// What was changed.
    pub settings: Vec<String>,
    /// Ticks whose gimbal command differs in some bit.
    pub commands_different: usize,
    /// Root mean square of the differences of the gimbal commands in the landing, rad.
    pub gimbal_difference_rms_rad: f64,
    /// The largest difference of a gimbal command, rad.
    pub gimbal_difference_max_rad: f64,
    /// The tick with it.
    pub gimbal_difference_max_tick: Option<u64>,
    /// Ticks on which another level decides.
    pub levels_different: usize,
    /// Every tick.
    pub ticks: Vec<EvaluatedTick>,
}

/// Evaluates a recorded flight under other settings.
///
/// # Errors
/// See [`EvaluateError`].
pub fn evaluate(recording: &Recording, settings: &[Setting]) -> Result<EvaluateReport, EvaluateError> {
    let recorded_s = recording.profile()?.nmpc.sample_time_s;
    for setting in settings {
        let path = &setting.path;
        if NOT_THE_CONTROLLERS.iter().any(|section| path.starts_with(section)) {
            return Err(EvaluateError::NotTheControllers { path: path.clone() });
        }
        if path == "nmpc.sample_time_s" {
            return Err(EvaluateError::SampleTime { recorded_s });
        }
    }
    let schedule = Schedule::new(recording.profile_toml()?, settings)?;
    let limits = TouchdownLimits::from_profile(&recording.profile()?);
    let mut controller = LoggedController::scheduled(&schedule);
    let mut ticks = Vec::new();
    for tick in recording.replayable_ticks()? {
        let again = controller.run_again(tick)?;
        ticks.push(EvaluatedTick {
            tick: tick.input.tick,
            time_s: tick.input.time_s,
            phase: phase_of(tick).map_or("unknown", Phase::name),
            recorded: decided(&limits, &tick.output),
            evaluated: decided(&limits, &again.output),
        });
    }
    Ok(summarise(recording, settings, ticks))
}

fn summarise(recording: &Recording, settings: &[Setting], ticks: Vec<EvaluatedTick>) -> EvaluateReport {
    let difference_rad = |tick: &EvaluatedTick| (tick.recorded.gimbal_rad - tick.evaluated.gimbal_rad).abs();
    let landing: Vec<&EvaluatedTick> =
        ticks.iter().filter(|tick| !matches!(tick.phase, "SAFE" | "PAD_IDLE" | "PAD_ARMED")).collect();
    let squares: f64 = landing.iter().map(|tick| difference_rad(tick) * difference_rad(tick)).sum();
    let largest = ticks.iter().max_by(|a, b| difference_rad(a).total_cmp(&difference_rad(b)));
    let count = |differs: &dyn Fn(&EvaluatedTick) -> bool| ticks.iter().filter(|tick| differs(tick)).count();
    EvaluateReport {
        kind: "open loop: the controller alone on recorded inputs",
        file: recording.name.clone(),
        settings: settings.iter().map(ToString::to_string).collect(),
        commands_different: count(&|tick| {
            tick.recorded.gimbal_rad.to_bits() != tick.evaluated.gimbal_rad.to_bits()
        }),
        gimbal_difference_rms_rad: if landing.is_empty() {
            0.0
        } else {
            libm::sqrt(squares / landing.len() as f64)
        },
        gimbal_difference_max_rad: largest.map_or(0.0, difference_rad),
        gimbal_difference_max_tick: largest.filter(|tick| difference_rad(tick) > 0.0).map(|tick| tick.tick),
        levels_different: count(&|tick| tick.recorded.level != tick.evaluated.level),
        ticks,
    }
}

fn phase_of(tick: &v1::ControllerTick) -> Option<Phase> {
    u8::try_from(tick.input.phase).ok().and_then(Phase::from_index)
}

fn decided(limits: &TouchdownLimits, output: &v1::ControllerOutput) -> Decided {
    let level = u8::try_from(output.level).ok().and_then(ControlLevel::from_index);
    let planned = !matches!(level, None | Some(ControlLevel::Idle));
    let end: PlanarState = state_from_log(&output.predicted_touchdown.state);
    Decided {
        gimbal_rad: output.gimbal_command_rad,
        level: level.map_or("unknown", ControlLevel::name),
        cost: output.solver.cost,
        iterations: output.solver.iterations,
        plan_lands: planned.then(|| LandingVerdict::judge_plan(limits, &end).landed()),
    }
}
