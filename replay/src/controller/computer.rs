//! The whole flight computer, from power-up on; the same code for both vehicles.

use std::collections::BTreeMap;

use flight::computer::Output;
use flight::computer::plane::PlaneError;
use flight::guidance::baseline::{Controller, UnknownController};
use prost_reflect::MessageDescriptor;
use protocol::log::{computer_v1, flight_v1, v1};
use tick_log::again::{FrameError, RecordedComputer};

use super::{LoggedPilot, Moment, Replayed, phase_name};
use crate::log::computer_descriptor;
use crate::settings::{SettingError, profile_with};

/// Why a flight computer cannot be built as it was at power-up.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(transparent)]
    Plane(#[from] PlaneError),
    #[error("controller {0}")]
    Controller(#[from] UnknownController),
    #[error("its record /computer/start must name one vehicle, in space or in the plane")]
    NoVehicle,
}

/// A flight computer that is run on the frames of a log, from power-up on. Frames must come in order.
#[derive(Debug, Clone)]
pub struct LoggedComputer {
    computer: RecordedComputer,
    last: Option<Output>,
}

impl LoggedComputer {
    /// The flight computer that a log's frames came from, before its first frame. It is built from the text of the
    /// profile or mission and from the law that the run facts name.
    ///
    /// # Errors
    /// This build cannot use the text, or a name is unknown.
    pub fn recorded(
        toml: &str,
        start: &computer_v1::ComputerStart,
        run: &BTreeMap<String, String>,
    ) -> Result<Self, StartError> {
        let computer = match (&start.in_space, &start.in_plane) {
            (Some(start), None) => {
                let schedule = LoggedPilot::schedule(toml, start, &[])?;
                let controller = run.get("controller").map(|name| name.parse::<Controller>()).transpose()?;
                RecordedComputer::in_space(schedule.base(), start, controller.unwrap_or_default())
            }
            (None, Some(release)) => {
                let profile = profile_with(toml, &[])?;
                RecordedComputer::in_plane(&profile, release)?
            }
            _ => return Err(StartError::NoVehicle),
        };
        Ok(Self { computer, last: None })
    }

    /// The pilot's part of the last frame, as a log has it; `None` on the pad and for the planar vehicle.
    pub fn pilot_tick(&self) -> Option<flight_v1::PilotTick> {
        let computer = self.computer.computer();
        let (input, output) = computer.piloted()?;
        Some(tick_log::pilot::tick_to_log(input, output, computer.flight_digest()))
    }

    /// The landing controller's tick in the last frame, as a log has it except for the measured times; `None` if the
    /// frame had no tick, and for a rocket in space.
    pub fn controller_tick(&self) -> Option<v1::ControllerTick> {
        let tick = self.last.as_ref()?.tick.as_ref()?;
        Some(tick_log::tick_to_log(&tick.input, &tick.output, tick.state_digest, 0.0, 0.0))
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

    fn apart(a: &computer_v1::ComputerFrame, b: &computer_v1::ComputerFrame) -> (f64, Option<f64>) {
        let axes = a.output.gimbal_rad.iter().zip(&b.output.gimbal_rad);
        (axes.map(|(then, now)| (then - now).abs()).fold(0.0, f64::max), None)
    }

    fn run_again(
        &mut self,
        frame: &computer_v1::ComputerFrame,
    ) -> Result<computer_v1::ComputerFrame, FrameError> {
        let read = self.computer.read(&frame.input)?;
        let output = self.computer.step(&read);
        let again = self.computer.record(&read, &output);
        self.last = Some(output);
        Ok(again)
    }
}
