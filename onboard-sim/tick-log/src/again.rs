//! The flight computer of a log, run again on its recorded frames, from power-up on. A replay and a board use the same
//! code.

use flight::computer::pilot::PilotInput;
use flight::computer::saved::{LONGEST_RESET_S, Saved};
use flight::computer::{Computer, Input, Output, flight_time_s};
use flight::guidance::baseline::{Controller, Law};
use flight::vehicle::mission::Mission;
use log_records::computer_v1::{ComputerFrame, ComputerInput};
use log_records::flight_v1::{self, PilotStart};

use crate::computer::{LoggedInput, frame_to_log, input_from_log};
use crate::pilot::{self, PilotLogError, state_from_log, vector_from_log};

/// Why a frame was not run again.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// This build does not know some value of its input.
    #[error(transparent)]
    Input(#[from] PilotLogError),
    /// It is a repetition, or it is out of order.
    #[error("frame {frame} comes after frame {after}: nothing behind it was compared")]
    Order {
        /// Its number.
        frame: u64,
        /// The frame before it in the log.
        after: u64,
    },
    /// So many frames before it are missing that a computer would not fly on.
    #[error(
        "{missing} frames are missing before frame {frame}: no computer flies on after more than {LONGEST_RESET_S} s"
    )]
    Gap {
        /// Its number.
        frame: u64,
        missing: u64,
    },
}

/// A flight computer that is run on the frames of a log, from power-up on. Frames must come in order. Missing frames
/// mean that the computer was restarted: it is restarted here, too.
#[derive(Debug, Clone)]
pub struct RecordedComputer {
    computer: Computer,
    /// The frame after the last one.
    next: Option<u64>,
    rehearsed: bool,
}

/// The mission as it was flown: the start record may change two of its values.
pub fn mission_flown(mission: Mission, start: &PilotStart) -> Mission {
    let mut mission = Mission { steered: start.steered, ..mission };
    mission.ignition.fixed_height_m = start.fixed_ignition_height_m;
    mission
}

impl RecordedComputer {
    /// The computer at power-up. `mission` is the mission [as flown](mission_flown).
    pub fn at_power_up(mission: &Mission, start: &PilotStart, controller: Controller) -> Self {
        let law = Law::of(controller, mission);
        Self::of(Computer::at_power_up(mission, law, &state_from_log(&start.believed)))
    }

    /// The computer of a flight that was released at once, without a pad. Its frames are
    /// [in the air](Self::step_in_the_air).
    pub fn in_the_air(mission: &Mission, start: &PilotStart, controller: Controller) -> Self {
        let believed = state_from_log(&start.believed);
        let computer = Computer::at_power_up(mission, Law::of(controller, mission), &believed);
        let computer = match &start.gyro_bias_rad_s {
            Some(bias) => computer.standing(&believed, vector_from_log(bias)),
            None => computer,
        };
        // The first frame has the number 1.
        Self { next: Some(1), ..Self::of(computer.released()) }
    }

    fn of(computer: Computer) -> Self {
        Self { computer, next: None, rehearsed: false }
    }

    /// Reads a recorded input, and restarts the computer if frames before it are missing.
    ///
    /// # Errors
    /// This build cannot use the input, or its frame is out of order.
    pub fn read(&mut self, input: &ComputerInput) -> Result<LoggedInput, FrameError> {
        let read = input_from_log(input)?;
        self.follow(input.frame)?;
        Ok(read)
    }

    /// Flies the frame that was just [read](Self::read).
    pub fn step(&mut self, read: &LoggedInput) -> Output {
        self.computer.step(&read.input())
    }

    /// Reads a recorded input of a flight that was released at once, as [`read`](Self::read) does.
    ///
    /// # Errors
    /// This build cannot use the input, or its frame is out of order.
    pub fn read_in_the_air(&mut self, input: &flight_v1::PilotInput) -> Result<PilotInput, FrameError> {
        let read = pilot::input_from_log(input)?;
        self.follow(input.frame)?;
        Ok(read)
    }

    /// Flies the frame that was just [read](Self::read_in_the_air).
    pub fn step_in_the_air(&mut self, read: &PilotInput) -> Output {
        self.computer.step(&Input::in_the_air(read))
    }

    /// Frame `number` is next: a computer that missed frames before it is restarted.
    fn follow(&mut self, number: u64) -> Result<(), FrameError> {
        if let Some(next) = self.next {
            if number < next {
                return Err(FrameError::Order { frame: number, after: next - 1 });
            }
            if number > next {
                // It was dead in the missing frames and restarted at the end of the frame before this one.
                self.computer.restart(flight_time_s(number - 1));
                self.rehearsed = self.computer.rehearsed().is_some();
            }
        }
        self.next = Some(number.saturating_add(1));
        Ok(())
    }

    /// The whole frame as a record, after its [step](Self::step).
    pub fn record(&mut self, read: &LoggedInput, output: &Output) -> ComputerFrame {
        let input = read.input();
        let frame = frame_to_log(&input, output, &self.computer, self.rehearsed);
        self.rehearsed |= input.rehearsed.is_some();
        frame
    }

    /// This computer at power-up, after a reset behind which frame `number` is next: it goes on from what was saved.
    pub fn resume(&mut self, saved: &Saved, number: u64) {
        self.computer.resume(saved, flight_time_s(number.saturating_sub(1)));
        (self.next, self.rehearsed) = (Some(number), false);
    }

    /// Whether frames are missing before this one, so that the computer was reset there.
    pub fn was_reset_before(&self, number: u64) -> bool {
        self.next.is_some_and(|next| number > next)
    }

    pub fn computer(&self) -> &Computer {
        &self.computer
    }
}
