//! The flight computer that a log's frames came from, run again on their inputs.
//!
//! Two records of a frame are read: [`LoggedComputer`] runs every frame from power-up on, and [`LoggedPilot`] the frames
//! from the release on, some of which plan a landing. Verification is written for any [`Replayed`].

use std::collections::BTreeMap;

use flight::computer::pilot::{Pilot, PilotInput, PilotOutput};
use flight::computer::{Computer, Input, flight_time_s};
use flight::guidance::baseline::{Controller, Law, UnknownController};
use flight::guidance::powered::ControlLevel;
use flight::guidance::powered::{LandingSolved, Plane};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::mission::Mission;
use nalgebra::Vector3;
use nmpc::SolveStatus;
use prost::Message;
use prost_reflect::MessageDescriptor;
use protocol::log::{computer_v1, flight_v1};
use serde::Serialize;
pub use tick_log::again::FrameError;
use tick_log::again::RecordedComputer;
use tick_log::pilot::{input_from_log, state_from_log, tick_to_log, vector_from_log};

use crate::log::{computer_descriptor, pilot_descriptor};
use crate::settings::{Schedule, Setting, SettingError, mission_with};

/// A flight computer that can be run on the frames of a log; frames must come in order, from the first one on.
pub trait Replayed {
    /// The record of a frame in a log.
    type Tick: Message;
    /// Why a frame cannot be run again.
    type Error: std::error::Error + 'static;

    /// Describes the record's fields.
    fn descriptor() -> Option<MessageDescriptor>;

    /// The frame that a record belongs to.
    fn moment(tick: &Self::Tick) -> Moment;

    /// The gimbal commands of a record, rad.
    fn gimbal_rad(tick: &Self::Tick) -> &[f64];

    /// Runs a recorded frame again: the result has the recorded input and the new decision.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's flight computer.
    fn run_again(&mut self, tick: &Self::Tick) -> Result<Self::Tick, Self::Error>;
}

/// A frame, its vehicle time and its phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
}

/// Summary of a frame's decision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decided {
    /// Gimbal commands in pitch and yaw, rad.
    pub gimbal_rad: Vec<f64>,
    /// Fin commands, rad.
    pub fins_rad: Vec<f64>,
    pub phase: &'static str,
    /// The control level that decided the gimbal command.
    pub level: &'static str,
    /// Cost of the last plan.
    pub cost: f64,
    /// Iterations of the last plan's solve.
    pub iterations: u32,
    /// Whether the end of the plan meets every condition; `None` without a plan.
    pub plan_lands: Option<bool>,
}

fn phase_name(number: u32) -> &'static str {
    let phase = u8::try_from(number).ok().and_then(flight::rules::phase::Phase::from_index);
    phase.map_or("unknown", flight::rules::phase::Phase::name)
}

/// Why a flight computer cannot be built as it was at power-up.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error("controller {0}")]
    Controller(#[from] UnknownController),
}

/// A flight computer that is run on the frames of a log, from power-up on. Frames must come in order.
#[derive(Debug, Clone)]
pub struct LoggedComputer(RecordedComputer);

impl LoggedComputer {
    /// The flight computer that a log's frames came from, before its first frame. It is built from the text of the
    /// mission and from the law that the run facts name.
    ///
    /// # Errors
    /// This build cannot use the text, or a name is unknown.
    pub fn recorded(
        toml: &str,
        start: &computer_v1::ComputerStart,
        run: &BTreeMap<String, String>,
    ) -> Result<Self, StartError> {
        let start = &start.start;
        let schedule = LoggedPilot::schedule(toml, start, &[])?;
        let controller = run.get("controller").map(|name| name.parse::<Controller>()).transpose()?;
        Ok(Self(RecordedComputer::at_power_up(schedule.base(), start, controller.unwrap_or_default())))
    }

    /// The pilot's part of the last frame, as a log has it; `None` on the pad.
    pub fn pilot_tick(&self) -> Option<flight_v1::PilotTick> {
        let computer = self.0.computer();
        let (input, output) = computer.piloted()?;
        Some(tick_to_log(input, output, computer.flight_digest()))
    }
}

impl Replayed for LoggedComputer {
    type Tick = computer_v1::ComputerFrame;
    type Error = FrameError;

    fn descriptor() -> Option<MessageDescriptor> {
        computer_descriptor()
    }

    fn moment(frame: &computer_v1::ComputerFrame) -> Moment {
        let input = &frame.input;
        Moment { tick: input.frame, time_s: input.time_s, phase: phase_name(frame.output.phase) }
    }

    fn gimbal_rad(frame: &computer_v1::ComputerFrame) -> &[f64] {
        &frame.output.gimbal_rad
    }

    fn run_again(
        &mut self,
        frame: &computer_v1::ComputerFrame,
    ) -> Result<computer_v1::ComputerFrame, FrameError> {
        let read = self.0.read(&frame.input)?;
        let output = self.0.step(&read);
        Ok(self.0.record(&read, &output))
    }
}

/// Run fact of a re-flown flight's log: the settings that changed in flight, one on each line.
pub const SETTINGS_IN_FLIGHT: &str = "settings_in_flight";

/// The number of the first frame.
const FIRST_FRAME: u64 = 1;

/// Run facts of a re-flown flight's log: the law of the landing burn, and the first frame that it flew.
pub(crate) const REFLOWN_BY: &str = "reflown_by";
pub(crate) const REFLOWN_AT: &str = "reflown_at_tick";

/// A pilot that is run on the frames of a log; frames must come in order. Missing frames mean that the computer was
/// restarted: it is restarted here, too.
#[derive(Debug, Clone)]
pub struct LoggedPilot {
    computer: Computer,
    schedule: Schedule<Mission>,
    /// The frame in which a re-flown flight changed to another law, and that law.
    other_law: Option<(u64, Controller)>,
    next: u64,
    /// If false, the recorded digests are copied: digests of another schema cover other fields.
    compares_digests: bool,
}

/// The settings that, according to a log, were changed in its flight.
///
/// # Errors
/// A line is not a setting.
pub fn settings_in_flight(run: &BTreeMap<String, String>) -> Result<Vec<Setting>, SettingError> {
    run.get(SETTINGS_IN_FLIGHT).map_or_else(|| Ok(Vec::new()), |text| text.lines().map(str::parse).collect())
}

impl LoggedPilot {
    /// The pilot that a log's frames came from, before its first frame. It is built from the mission, from the laws and
    /// changes of settings that the run facts name, and from the `other` settings, which apply last.
    ///
    /// # Errors
    /// This build cannot use the text as a mission, or a name is unknown.
    pub fn recorded(
        mission_toml: &str,
        start: &flight_v1::PilotStart,
        run: &BTreeMap<String, String>,
        other: &[Setting],
    ) -> Result<Self, SettingError> {
        let settings: Vec<Setting> =
            settings_in_flight(run)?.into_iter().chain(other.iter().cloned()).collect();
        let schedule = Self::schedule(mission_toml, start, &settings)?;
        let law_of = |fact: &str| run.get(fact).map(|name| name.parse::<Controller>()).transpose();
        let controller = law_of("controller")?.unwrap_or_default();
        let at_frame = run.get(REFLOWN_AT).and_then(|frame| frame.parse().ok());
        let other_law = at_frame.zip(law_of(REFLOWN_BY)?);
        let law = Law::of(controller, schedule.base());
        let believed = state_from_log(&start.believed);
        let computer = Computer::at_power_up(schedule.base(), law, &believed);
        let computer = match &start.gyro_bias_rad_s {
            Some(bias) => computer.standing(&believed, vector_from_log(bias)),
            None => computer,
        }
        .released();
        Ok(Self { computer, schedule, other_law, next: FIRST_FRAME, compares_digests: true })
    }

    /// The same pilot for a log of another schema, whose digests cover other fields and are not compared.
    #[must_use]
    pub fn without_digests(self) -> Self {
        Self { compares_digests: false, ..self }
    }

    /// The missions over time: first the mission as at the release, then with the settings.
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

    /// The pilot in the flight computer.
    pub fn pilot(&self) -> &Pilot {
        self.computer.pilot()
    }

    /// Runs one frame.
    ///
    /// # Errors
    /// The frame is out of order.
    pub fn step(&mut self, input: &PilotInput) -> Result<PilotOutput, FrameError> {
        self.make_ready(input)?;
        self.computer.step(&Input::in_the_air(input));
        Ok(self.decided_now())
    }

    /// Runs one frame, and solves the landing that it plans separately; see [`Computer::step_inspected`].
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_inspected(
        &mut self,
        input: &PilotInput,
    ) -> Result<(PilotOutput, Option<LandingSolved>), FrameError> {
        self.make_ready(input)?;
        let (_, solved) = self.computer.step_inspected(&Input::in_the_air(input));
        Ok((self.decided_now(), solved))
    }

    fn decided_now(&self) -> PilotOutput {
        let piloted = self.computer.piloted();
        piloted.map_or_else(|| unreachable!("a frame was flown"), |(_, output)| *output)
    }

    /// The digest of the pilot's memory.
    pub fn digest(&self) -> u64 {
        self.computer.flight_digest()
    }

    /// Applies the restarts and the changes of settings that come before a frame.
    fn make_ready(&mut self, input: &PilotInput) -> Result<(), FrameError> {
        let frame = input.frame;
        if frame < self.next {
            return Err(FrameError::Order { frame, after: self.next - 1 });
        }
        if frame > self.next {
            // It was dead in the missing frames and restarted at the end of the frame before this one.
            self.computer.restart(flight_time_s(frame - 1));
            if self.computer.released_at_s().is_none() {
                return Err(FrameError::Gap { frame, missing: frame - self.next });
            }
        }
        self.next = frame.saturating_add(1);
        if let Some(mission) = self.schedule.due(input.time_s) {
            self.computer.reconfigure(mission);
        }
        if let Some((_, controller)) = self.other_law.take_if(|(at_frame, _)| *at_frame <= frame) {
            let law = Law::of(controller, self.pilot().mission());
            self.computer.set_law(law);
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

    fn gimbal_rad(tick: &flight_v1::PilotTick) -> &[f64] {
        &tick.output.gimbal_rad
    }

    fn run_again(&mut self, tick: &flight_v1::PilotTick) -> Result<flight_v1::PilotTick, FrameError> {
        let input = input_from_log(&tick.input)?;
        let output = self.step(&input)?;
        let digest = if self.compares_digests { self.digest() } else { tick.state_digest };
        Ok(tick_to_log(&input, &output, digest))
    }
}

impl LoggedPilot {
    /// A summary of a frame's decision; the pilot has just run that frame.
    pub fn decided(&self, tick: &flight_v1::PilotTick) -> Decided {
        let output = &tick.output;
        let report = self.pilot().report();
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

/// Tells a new plan from an earlier plan that is still being flown; frames must come in order.
#[derive(Debug, Clone, Default)]
pub struct NewPlans {
    flown: Vec<PlanarState>,
}

impl NewPlans {
    /// The plan that a flight computer made in the frame it has just run, in which `level` decided: states relative to
    /// the air in the plane of the landing, and the time between them, s. `None` if it flies an earlier plan or none.
    pub fn made<'p>(&mut self, pilot: &'p Pilot, level: u32) -> Option<(&'p [PlanarState], f64)> {
        let planned = level != u32::from(ControlLevel::Idle.index());
        let (states, step_s) =
            pilot.planned().filter(|(states, _)| planned && *states != self.flown.as_slice())?;
        self.flown = states.to_vec();
        Some((states, step_s))
    }
}

/// The path of the centre of gravity in a plan just made, m: x, y, z of the world. It begins at the estimated position;
/// motion across the plane of the landing is not planned.
pub fn path_in_world_m(pilot: &Pilot, states: &[PlanarState], step_s: f64) -> Vec<[f64; 3]> {
    let (Some(plane), Some(estimate), Some(first)) = (pilot.plane(), pilot.estimate(), states.first()) else {
        return Vec::new();
    };
    let wind_m_s = estimate.wind_m_s.push(0.0).dot(&plane.along);
    let place = |(node, state): (usize, &PlanarState)| {
        let over_ground = Plane::over_ground(state, wind_m_s, node as f64 * step_s);
        let moved =
            plane.along * (over_ground.x_m - first.x_m) + Vector3::z() * (over_ground.z_m - first.z_m);
        (estimate.state.position_m + moved).into()
    };
    states.iter().enumerate().map(place).collect()
}
