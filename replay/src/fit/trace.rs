//! What a flight's log gives to a fit: sensor samples, commands and the flight computer's own estimates. The simulated
//! truth that some logs have beside them is never read.

use std::path::Path;

use avionics::log::frame::{commands_from_log, input_from_log, phase_of};
use avionics::log::logged::{At, Logged as _};
use flight::computer::Commands;
use flight::computer::KeptInput;
use flight::estimation::estimator::{Estimate, Measurements};
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::vehicle::mission::Mission;
use protocol::log::computer_v1::ComputerFrame;

use crate::digest::digest;
use crate::log::{Entry, FlightLog, LogError, RecordingError};

/// One frame of the flight computer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// End of the frame, s.
    pub time_s: f64,
    pub measured: Measurements,
    /// Fin openings as the feedback tells them at the end of the frame, rad.
    pub fins_rad: [f64; 4],
    /// The gimbal's angles as its feedback tells them at the end of the frame, rad.
    pub gimbal_reported_rad: [f64; 2],
    /// The gimbal's command that is given at the end of the frame, rad.
    pub gimbal_rad: [f64; 2],
    /// The igniter of the landing motor is fired from the end of the frame on.
    pub ignite: bool,
    /// The parachute is or was thrown out.
    pub parachute: bool,
    pub contact: bool,
    pub booster_attached: bool,
    pub phase: Phase,
    /// The flight computer's estimate at the end of the frame, and the standard deviations with it.
    pub estimate: Estimate,
}

/// A flight as its log has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The log's name, for messages.
    pub name: String,
    pub mission: Mission,
    /// The mission's text.
    pub mission_toml: String,
    /// In order of time. A gap is a restart of the computer, or lost records.
    pub frames: Vec<Frame>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Whether the flight landed, if the log says so.
    pub landed: Option<bool>,
    /// Tells what was recorded from any other flight.
    pub content: Option<u64>,
    /// When the log ends, ns of Unix time.
    pub last_ns: Option<u64>,
}

/// Why nothing can be learnt from a log.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// It cannot be read, or is no flight log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// It holds too much, several flights, or no usable mission.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It has no frames with an inertial unit.
    #[error(
        "{name}: has no frames of a flight computer with its sensors and estimates ({found}). A fit needs the vehicle's own \
         log: at the rates of telemetry neither thrust nor delays nor noises can be found"
    )]
    NoFrames {
        /// The file.
        name: String,
        /// What the log has instead.
        found: &'static str,
    },
    /// A record has a value that this build does not know.
    #[error("{name}: {reason}")]
    Unknown {
        /// The file.
        name: String,
        reason: String,
    },
}

impl Trace {
    /// A flight without frames yet.
    pub fn new(name: &str, mission: Mission, mission_toml: &str) -> Self {
        let mission_toml = mission_toml.to_owned();
        let name = name.to_owned();
        let frames = Vec::new();
        Self { name, mission, mission_toml, frames, damage: None, landed: None, content: None, last_ns: None }
    }

    /// Adds a frame; one with numbers that are not finite is left out.
    pub fn push(
        &mut self,
        input: &KeptInput,
        commands: &Commands,
        phase: Phase,
        estimate: &Estimate,
        gimbal_reported_rad: [f64; 2],
    ) {
        let measured = input.measured;
        let numbers = [&measured.imu.gyro_rad_s, &measured.imu.specific_force_m_s2];
        let sound = estimate.state.is_finite()
            && estimate.wind_m_s.iter().all(|wind| wind.is_finite())
            && numbers.iter().all(|vector| vector.iter().all(|value| value.is_finite()))
            && input
                .fins_rad
                .iter()
                .chain(&commands.gimbal_rad)
                .chain(&gimbal_reported_rad)
                .all(|angle| angle.is_finite())
            && input.time_s.is_finite()
            && measured.gnss.is_none_or(|fix| {
                fix.position_m.iter().chain(fix.velocity_m_s.iter()).all(|value| value.is_finite())
                    && fix.valid_at_s.is_finite()
            });
        let later = self.frames.last().is_none_or(|last| last.time_s < input.time_s);
        if !(sound && later) {
            return;
        }
        self.frames.push(Frame {
            time_s: input.time_s,
            measured,
            fins_rad: input.fins_rad,
            gimbal_reported_rad,
            gimbal_rad: commands.gimbal_rad,
            ignite: commands.outputs.is_on(PyroOutput::LandingIgniter),
            parachute: commands.outputs.is_on(PyroOutput::Parachute),
            contact: input.contact,
            booster_attached: input.booster_attached,
            phase,
            estimate: *estimate,
        });
    }

    /// Reads a vehicle's log.
    ///
    /// # Errors
    /// [`TraceError`] says what the log lacks.
    pub fn open(path: &Path) -> Result<Self, TraceError> {
        Self::read(&mut FlightLog::open(path)?)
    }

    /// Reads a vehicle's log to its end.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn read<R: std::io::Read>(log: &mut FlightLog<R>) -> Result<Self, TraceError> {
        /// Two hours of frames: no flight is that long.
        const FRAMES_MAX: usize = 1_440_000;
        /// The noise of so many frames is that of no other flight.
        const NAMING_FRAMES: usize = 100;
        let name = log.name().to_owned();
        let unknown = |reason: String| TraceError::Unknown { name: name.clone(), reason };
        let mut trace: Option<Self> = None;
        let mut waiting = None;
        let (mut telemetry, mut flights) = (false, 0_usize);
        let (mut landed, mut naming) = (None, Vec::new());
        while let Some(stamped) = log.next_entry()? {
            if naming.len() < NAMING_FRAMES && matches!(stamped.entry, Entry::ComputerFrame(_)) {
                naming.push(stamped.data);
            }
            match stamped.entry {
                Entry::Verdict(verdict) => landed = Some(verdict.landing.stands),
                Entry::Telemetry(_) => telemetry = true,
                Entry::ComputerStart(start) => flights += usize::from(start.released),
                Entry::ComputerFrame(frame) => waiting = frame.in_flight(),
                Entry::Estimate(estimate) => {
                    let Some(ComputerFrame { input, output, .. }) = waiting.take() else { continue };
                    let number = input.frame;
                    let read = input_from_log(&input).map_err(|error| unknown(error.to_string()))?;
                    let commands =
                        commands_from_log(&output, number).map_err(|error| unknown(error.to_string()))?;
                    let phase =
                        phase_of(&output).ok_or_else(|| unknown(format!("frame {number}: unknown phase")))?;
                    let read = read.input();
                    let input = read.since(0);
                    let estimate = Estimate::from_log(&estimate, At { frame: number, field: "estimate" })
                        .map_err(|error| unknown(error.to_string()))?;
                    if trace.is_none() {
                        let (mission, text) = mission_of(log)?;
                        trace = Some(Self::new(&name, mission, &text));
                    }
                    if let Some(trace) = &mut trace {
                        trace.push(&input, &commands, phase, &estimate, read.gimbal_rad);
                        if trace.frames.len() > FRAMES_MAX {
                            let kind = "frames of the flight computer";
                            return Err(RecordingError::TooLong { name: name.clone(), kind }.into());
                        }
                    }
                }
                _ => {}
            }
        }
        if flights > 1 {
            return Err(RecordingError::SeveralFlights { name, flights }.into());
        }
        let found = if telemetry { "it is a ground station's" } else { "none of either" };
        match trace.filter(|trace| !trace.frames.is_empty()) {
            None => Err(TraceError::NoFrames { name, found }),
            Some(trace) => {
                let damage = log.damage().map(ToString::to_string);
                let content = Some(digest(naming.iter().map(Vec::as_slice)));
                Ok(Self { damage, landed, content, last_ns: log.last_log_time_ns(), ..trace })
            }
        }
    }
}

fn mission_of<R: std::io::Read>(log: &FlightLog<R>) -> Result<(Mission, String), RecordingError> {
    let name = log.name().to_owned();
    match &log.head().profile_toml {
        None => Err(RecordingError::NoProfile { name }),
        Some(Err(error)) => Err(RecordingError::ProfileUnusable { name, reason: error.to_string() }),
        Some(Ok(text)) => match flight::vehicles::mission::from_toml(text, "profile.toml") {
            Ok(mission) => Ok((mission, text.clone())),
            Err(error) => Err(RecordingError::ProfileUnusable { name, reason: error.to_string() }),
        },
    }
}
