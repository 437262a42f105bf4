//! The flight computer of a flight from apogee.

use std::collections::BTreeMap;

use flight::controller::ControlLevel;
use flight::estimator::StartUncertainty;
use flight::mission::{Mission, MissionError};
use flight::nmpc::SolveStatus;
use flight::pilot::{Pilot, PilotInput, PilotOutput};
use flight::powered::LandingSolved;
use prost_reflect::MessageDescriptor;
use protocol::log::flight_v1;
use tick_log::pilot::{PilotLogError, input_from_log, state_from_log, tick_to_log};

use super::{Decided, Moment, Replayed, phase_name};
use crate::log::pilot_descriptor;
use crate::settings::{Schedule, Setting, SettingError, mission_with};

/// The log's run fact with the settings that a flight flown again changed on its way, one a line.
pub const SETTINGS_IN_FLIGHT: &str = "settings_in_flight";

/// The number of the first frame.
const FIRST_FRAME: u64 = 1;
/// Length of a frame, ms; see [`flight::pilot`].
const FRAME_MS: f64 = 5.0;

/// A flight computer being fed from a log; frames must come in order. Missing ones are what a restarted computer leaves:
/// it is restarted here too.
#[derive(Debug, Clone)]
pub struct LoggedPilot {
    pilot: Pilot,
    schedule: Schedule<Mission>,
    next: u64,
}

/// Why a flight computer cannot be let go again.
#[derive(Debug, thiserror::Error)]
pub enum PilotStartError {
    /// A setting is wrong, or the mission is none of this build.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The motor is not to be had.
    #[error(transparent)]
    Mission(#[from] MissionError),
}

/// Why a frame was not run again.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
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
    /// Settings that change in flight name a motor that is not to be had.
    #[error("frame {frame}: {reason}")]
    Settings {
        /// The frame.
        frame: u64,
        /// What is wrong.
        reason: String,
    },
}

/// The settings that a log says were changed in its flight.
///
/// # Errors
/// They are no settings.
pub fn settings_in_flight(run: &BTreeMap<String, String>) -> Result<Vec<Setting>, SettingError> {
    run.get(SETTINGS_IN_FLIGHT).map_or_else(|| Ok(Vec::new()), |text| text.lines().map(str::parse).collect())
}

impl LoggedPilot {
    /// The flight computer of a mission as it was let go, with other settings.
    ///
    /// # Errors
    /// The text is no mission of this build, a name is unknown, or the motor is not to be had.
    pub fn new(
        mission_toml: &str,
        start: &flight_v1::PilotStart,
        settings: &[Setting],
    ) -> Result<Self, PilotStartError> {
        let schedule = Self::schedule(mission_toml, start, settings)?;
        let believed = state_from_log(&start.believed);
        let uncertainty = StartUncertainty::at_apogee();
        let pilot = Pilot::at_apogee(schedule.base(), start.time_s, &believed, &uncertainty)?;
        Ok(Self { pilot, schedule, next: FIRST_FRAME })
    }

    /// The missions that hold one after the other: as it was let go, then with the settings.
    pub(crate) fn schedule(
        mission_toml: &str,
        start: &flight_v1::PilotStart,
        settings: &[Setting],
    ) -> Result<Schedule<Mission>, SettingError> {
        Schedule::of(settings, |so_far| {
            let mut mission = mission_with(mission_toml, so_far)?;
            let set = |path: &str| so_far.iter().any(|setting| setting.path == path);
            if !set("steered") {
                mission.steered = start.steered;
            }
            if !set("ignition.fixed_height_m") {
                mission.ignition.fixed_height_m = start.fixed_ignition_height_m;
            }
            Ok(mission)
        })
    }

    /// The flight computer itself.
    pub fn pilot(&self) -> &Pilot {
        &self.pilot
    }

    /// Runs one frame.
    ///
    /// # Errors
    /// It is out of order, or a change of settings is due that cannot be made.
    pub fn step(&mut self, input: &PilotInput) -> Result<PilotOutput, FrameError> {
        self.make_ready(input)?;
        Ok(self.pilot.step(input))
    }

    /// Runs one frame, and solves the landing that it plans alone; see [`Pilot::step_inspected`].
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_inspected(
        &mut self,
        input: &PilotInput,
    ) -> Result<(PilotOutput, Option<LandingSolved>), FrameError> {
        self.make_ready(input)?;
        Ok(self.pilot.step_inspected(input))
    }

    /// Restarts and changes of settings that come before a frame.
    fn make_ready(&mut self, input: &PilotInput) -> Result<(), FrameError> {
        let frame = input.frame;
        if frame < self.next {
            return Err(FrameError::Order { frame, after: self.next - 1 });
        }
        if frame > self.next {
            // It was dead meanwhile, and came back at the end of the frame before this.
            self.pilot = self.pilot.restarted((frame - 1) as f64 * FRAME_MS * 1e-3);
        }
        self.next = frame.saturating_add(1);
        if let Some(mission) = self.schedule.due(input.time_s) {
            let changed = self.pilot.reconfigured(mission);
            self.pilot =
                changed.map_err(|error| FrameError::Settings { frame, reason: error.to_string() })?;
        }
        Ok(())
    }
}

impl Replayed for LoggedPilot {
    type Tick = flight_v1::PilotTick;
    type Error = FrameError;

    fn descriptor() -> Option<MessageDescriptor> {
        pilot_descriptor()
    }

    fn moment(tick: &flight_v1::PilotTick) -> Moment {
        let input = &tick.input;
        Moment { tick: input.frame, time_s: input.time_s, phase: phase_name(tick.output.phase) }
    }

    fn apart(a: &flight_v1::PilotTick, b: &flight_v1::PilotTick) -> (f64, Option<f64>) {
        let axes = a.output.gimbal_rad.iter().zip(&b.output.gimbal_rad);
        (axes.map(|(then, now)| (then - now).abs()).fold(0.0, f64::max), None)
    }

    fn run_again(&mut self, tick: &flight_v1::PilotTick) -> Result<flight_v1::PilotTick, FrameError> {
        let input = input_from_log(&tick.input)?;
        let output = self.step(&input)?;
        Ok(tick_to_log(&input, &output, self.pilot.digest()))
    }

    fn decided(&self, tick: &flight_v1::PilotTick) -> Decided {
        let output = &tick.output;
        let report = self.pilot.report();
        let level = u8::try_from(output.level).ok().and_then(ControlLevel::from_index);
        let planned = report.status != SolveStatus::NotRun;
        Decided {
            gimbal_rad: output.gimbal_rad.clone(),
            fins_rad: output.fins_rad.clone(),
            phase: phase_name(output.phase),
            level: level.map_or("unknown", ControlLevel::name),
            cost: report.cost,
            iterations: u32::try_from(report.iterations).unwrap_or(u32::MAX),
            plan_lands: planned.then(|| report.level == ControlLevel::Converged),
        }
    }
}
