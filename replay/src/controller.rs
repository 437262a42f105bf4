//! The flight computer that a log's frames came from, run again on their inputs.

use std::collections::BTreeMap;

pub use avionics::log::again::FrameError;
use avionics::log::again::RecordedComputer;
use avionics::log::frame::{level_of, output_to_log, phase_of};
use flight::computer::Computer;
use flight::computer::pilot::Pilot;
use flight::guidance::powered::{ControlLevel, Plan};
use flight::rules::phase::Phase;
use ocp::Status;
use protocol::log::computer_v1::{ComputerFrame, ComputerOutput, ComputerStart};
use serde::Serialize;
use sim::sortie::SetUpError;

use crate::log::RecordingError;
use crate::settings::{Schedule, Setting, SettingError};

/// Why the frames of a log cannot be executed again, or its flight be flown again.
#[derive(Debug, thiserror::Error)]
pub enum AgainError {
    /// The log lacks the records that are needed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A setting is wrong, or the log names one that this build does not have.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A recorded frame cannot be executed again.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The flight cannot be set up, or its world cannot be changed this way.
    #[error(transparent)]
    Flight(#[from] SetUpError),
    #[error("{name}: no frame {frame} that can be re-executed; there are {first} to {last}")]
    NoFrame { name: String, frame: u64, first: u64, last: u64 },
    /// The request cannot be met: `of` is the file or the setting.
    #[error("{of}: {reason}")]
    Refused { of: String, reason: String },
}

/// Refuses the first setting for which `why_not` has a reason.
pub(crate) fn refuse(
    settings: &[Setting],
    why_not: impl Fn(&Setting) -> Option<String>,
) -> Result<(), AgainError> {
    match settings.iter().find_map(|setting| Some((setting, why_not(setting)?))) {
        None => Ok(()),
        Some((setting, reason)) => Err(AgainError::Refused { of: setting.to_string(), reason }),
    }
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

pub(crate) fn phase_name(output: &ComputerOutput) -> &'static str {
    phase_of(output).map_or("unknown", Phase::name)
}

/// Run fact of a re-flown flight's log: the settings that changed in flight, one on each line.
pub const SETTINGS_IN_FLIGHT: &str = "settings_in_flight";

/// A flight computer that is run on the frames of a log, from its power-up or its release on;
/// frames must come in order. Missing frames mean that the computer was restarted: it is restarted
/// here, too.
#[derive(Debug, Clone)]
pub struct LoggedComputer {
    computer: RecordedComputer,
    schedule: Schedule,
    /// If false, input and digest of a frame are copied from the record: the digest takes a third
    /// of the time, and a computer that did not wait on the pad remembers less.
    pub(crate) compares_digests: bool,
}

impl LoggedComputer {
    /// The flight computer that a log's frames came from, before its first frame. It is built from
    /// the mission, from the changes of settings that the run facts name, and from the `other`
    /// settings, which apply last.
    ///
    /// # Errors
    /// This build cannot use the text as a mission, or a name is unknown.
    pub fn recorded(
        mission_toml: &str,
        start: &ComputerStart,
        run: &BTreeMap<String, String>,
        other: &[Setting],
    ) -> Result<Self, SettingError> {
        let in_flight = run.get(SETTINGS_IN_FLIGHT).map_or("", String::as_str).lines();
        let in_flight: Vec<Setting> = in_flight.map(str::parse).collect::<Result<_, _>>()?;
        let schedule = Schedule::of(mission_toml, start, &[in_flight.as_slice(), other].concat())?;
        let computer = RecordedComputer::started(&schedule.base, start);
        Ok(Self { computer, schedule, compares_digests: false })
    }

    pub(crate) fn computer(&self) -> &Computer {
        self.computer.computer()
    }

    /// The pilot in the flight computer.
    pub fn pilot(&self) -> &Pilot {
        self.computer.computer().pilot()
    }

    /// Runs a recorded frame again, with the restarts and the changes of settings that come before
    /// it: the result has the recorded input and the new decision.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's flight computer, or the frame is out of
    /// order.
    pub fn run_again(&mut self, frame: &ComputerFrame) -> Result<ComputerFrame, FrameError> {
        let (number, next) = (frame.input.frame, self.computer.next());
        let flew = self.computer().released_at_s().is_some();
        let read = self.computer.read(&frame.input)?;
        let released_at_s = self.computer().released_at_s();
        if let Some(next) = next.filter(|_| flew && released_at_s.is_none()) {
            return Err(FrameError::Gap { frame: number, missing: number.saturating_sub(next) });
        }
        if let Some(released_at_s) = released_at_s
            && let Some(mission) = self.schedule.due(frame.input.time_s - released_at_s)
        {
            self.computer.computer_mut().reconfigure(&mission);
        }
        let output = self.computer.step(&read);
        if self.compares_digests {
            return Ok(self.computer.record(&read, &output));
        }
        let output = output_to_log(&output, self.computer(), ComputerOutput::default());
        Ok(ComputerFrame { input: frame.input.clone(), output, state_digest: frame.state_digest })
    }

    /// A summary of a frame's decision; the computer has just run that frame.
    pub fn decided(&self, frame: &ComputerFrame) -> Decided {
        let output = &frame.output;
        let report = self.pilot().report();
        let planned = report.status != Status::NotRun;
        Decided {
            gimbal_rad: output.gimbal_rad.clone(),
            fins_rad: output.fins_rad.clone(),
            phase: phase_name(output),
            level: level_of(output).map_or("unknown", ControlLevel::name),
            cost: report.cost,
            iterations: u32::try_from(report.iterations).unwrap_or(u32::MAX),
            plan_lands: planned.then(|| report.level == ControlLevel::Converged),
        }
    }
}

/// The plan that a flight computer took over in the frame it has just run; `None` if it flies an
/// earlier plan or none.
pub fn new_plan<'a>(pilot: &'a Pilot, output: &ComputerOutput) -> Option<&'a Plan> {
    let requested_at_s = pilot.report().requested_at_s;
    pilot.powered().planned().filter(|plan| output.planned && plan.begins_s() >= requested_at_s)
}
