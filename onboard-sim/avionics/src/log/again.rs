//! The flight computer of a log, run again on its recorded frames. A replay and a board use the
//! same code.

use flight::computer::saved::{LONGEST_RESET_S, Saved};
use flight::computer::{Computer, Output, flight_time_s};
use flight::vehicle::mission::Mission;
use protocol::records::computer_v1::{ComputerFrame, ComputerInput, ComputerStart};

use crate::log::frame::{LoggedInput, frame_to_log, input_from_log};
use crate::log::logged::{RecordError, calibration_from_log, state_from_log};

/// Why a frame was not run again.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Its input has a value that is unknown to this build.
    #[error(transparent)]
    Input(#[from] RecordError),
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

/// A flight computer that is run on the frames of a log, from its start record on. Frames must come
/// in order. Missing frames mean that the computer was restarted: it is restarted here, too.
#[derive(Debug, Clone)]
pub struct RecordedComputer {
    computer: Computer,
    /// The frame after the last one.
    next: Option<u64>,
    rehearsed: bool,
}

/// The mission as it was flown, with the values that its start record adds, but for the keys that
/// are `decided` otherwise.
pub fn mission_flown(mut mission: Mission, start: &ComputerStart, decided: impl Fn(&str) -> bool) -> Mission {
    if let (Some(launch), Some(foot_m)) = (&mut mission.launch, &start.rail_m) {
        for (key, value, found) in [
            ("launch.rail.x_m", &mut launch.rail.x_m, foot_m.x),
            ("launch.rail.y_m", &mut launch.rail.y_m, foot_m.y),
        ] {
            if !decided(key) {
                *value = found;
            }
        }
    }
    mission
}

impl RecordedComputer {
    /// The computer of a start record. `mission` is the mission [as flown](mission_flown).
    pub fn started(mission: &Mission, start: &ComputerStart) -> Self {
        let believed = state_from_log(&start.believed);
        let computer = Computer::at_power_up(mission, &believed);
        let (computer, next) = if start.released {
            let standing = match &start.calibration {
                Some(calibration) => computer.standing(&believed, &calibration_from_log(calibration)),
                None => computer,
            };
            (standing.released(start.frame), Some(start.frame.saturating_add(1)))
        } else {
            (computer, None)
        };
        let computer = match start.aborted_before_s {
            Some(at_s) => computer.aborted_before(at_s),
            None => computer,
        };
        Self { computer, next, rehearsed: false }
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

    /// Frame `number` is next: a computer that missed frames before it is restarted.
    fn follow(&mut self, number: u64) -> Result<(), FrameError> {
        if let Some(next) = self.next {
            if number < next {
                return Err(FrameError::Order { frame: number, after: next - 1 });
            }
            if number > next {
                // It was dead in the missing frames and restarted at the end of the frame before
                // this one.
                self.computer.restart(flight_time_s(number - 1));
                self.rehearsed = self.computer.rehearsed().is_some();
            }
        }
        self.next = Some(number.saturating_add(1));
        Ok(())
    }

    /// The complete frame as a record, after its [step](Self::step).
    pub fn record(&mut self, read: &LoggedInput, output: &Output) -> ComputerFrame {
        let input = read.input();
        let frame = frame_to_log(&input, output, &self.computer, self.rehearsed, ComputerFrame::default());
        self.rehearsed |= input.rehearsed.is_some();
        frame
    }

    /// Resumes this computer at power-up, after a reset, from the saved state; frame `number` is
    /// next.
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

    /// The computer, for a replay that changes its settings.
    pub fn computer_mut(&mut self) -> &mut Computer {
        &mut self.computer
    }

    /// The number of the only frame that may come next, if there is one.
    pub fn next(&self) -> Option<u64> {
        self.next
    }
}
