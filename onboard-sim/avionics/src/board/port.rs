//! The interface that a board implements to fly the flight computer, and the frames that fly it.
//!
//! A board has two contexts. A timer calls [`Frames::fly`] every 5 ms, which never waits. The main
//! context computes the [request](Board::submit) of a frame, which takes up to 20 frames, and is
//! interrupted by them: it receives a [`Planner`], calls [`Planner::solve`], and sends it back. The
//! planner is a box that moves through the board's channels, such as two queues of
//! `heapless::spsc`: nothing is shared.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;
use core::mem::{swap, take};

use crate::log::frame::{LoggedInput, frame_to_log};
use crate::log::logged::Logged;
use flight::computer::crew::ANSWERED;
use flight::computer::messages::CrewMessage;
use flight::computer::pilot::planner::Planner;
use flight::computer::{Commands, Computer, Input, Output, Rehearsed, SensedInput, flight_time_s};
use protocol::records::computer_v1::{self, ComputerFrame, ComputerInput, ComputerOutput};

/// A board: a crate for one board implements this with its drivers.
pub trait Board {
    type Error;

    /// Reads everything at the end of a frame, 5 ms after the last one, without waiting: gyro and
    /// accelerometer in every frame, barometer, satellites and lidar if they have new data; gimbal
    /// and fins, unless the airframe's servos have no feedback. [`Input`] describes each value; its
    /// number, its time, the rehearsal and `plan_ready` are set by [`Frames`]. `None`: the flight
    /// is over.
    ///
    /// # Errors
    /// A device without which nothing can be decided has failed.
    fn sense(&mut self) -> Result<Option<LoggedInput>, Self::Error>;

    /// Moves servos and switches outputs: gimbal, fins, both igniters, separation, parachute. It
    /// acts on every command of the last frame at once, and an output stays on only as long as it
    /// is commanded.
    ///
    /// # Errors
    /// As [`sense`](Self::sense).
    fn act(&mut self, commands: &Commands) -> Result<(), Self::Error>;

    /// Submits a request to the main context, without waiting: there is never more than one.
    fn submit(&mut self, planner: Box<Planner>);

    /// Receives the result of the main context, once.
    fn solved(&mut self) -> Option<Box<Planner>>;

    /// Sends messages to the crew.
    fn send(&mut self, messages: &[CrewMessage]);

    /// Appends a frame to the log, without waiting: a log that falls behind reports so in the next
    /// frame's `log`.
    fn log(&mut self, frame: &ComputerFrame);
}

/// The frames of a flight. None allocates or frees memory.
#[derive(Debug)]
pub struct Frames {
    computer: Computer,
    frame: u64,
    /// For the next frame, which stores it.
    rehearsed: Option<Rehearsed>,
    /// The same in the log, and the last record, whose memory is used again.
    rehearsal: Option<computer_v1::Rehearsed>,
    record: ComputerFrame,
}

impl Frames {
    /// Behind this frame: 0 at power-up, and for a computer that was [resumed](Computer::resume)
    /// the one that a clock gives which ran through the reset. A computer that was not released
    /// rehearses its landing now, which takes some seconds.
    pub fn new(mut computer: Computer, frame: u64) -> Self {
        let rehearsed = computer.rehearse();
        let input =
            ComputerInput { requests: Vec::with_capacity(ANSWERED), ..SensedInput::default().to_log() };
        let (gimbal_rad, fins_rad, answers) = (vec![0.0; 2], vec![0.0; 4], Vec::with_capacity(ANSWERED));
        let output = ComputerOutput { gimbal_rad, fins_rad, answers, ..ComputerOutput::default() };
        let record = ComputerFrame { input, output, state_digest: 0 };
        Self { computer, frame, rehearsal: rehearsed.as_ref().map(Logged::to_log), rehearsed, record }
    }

    /// The computer after the last frame.
    pub fn computer(&self) -> &Computer {
        &self.computer
    }

    /// Flies one frame. Returns `false` if the flight is over.
    ///
    /// # Errors
    /// The board has failed.
    pub fn fly<B: Board>(&mut self, board: &mut B) -> Result<bool, B::Error> {
        let Some(read) = board.sense()? else { return Ok(false) };
        self.frame += 1;
        let (solved, rehearsed) = (board.solved(), self.rehearsed.take());
        let sensed = SensedInput { frame: self.frame, time_s: flight_time_s(self.frame), ..read.sensed };
        let (requests, plan_ready) = (&*read.requests, solved.is_some());
        let input = Input { sensed, requests, rehearsed: rehearsed.as_ref(), plan_ready };
        if let Some(planner) = solved {
            self.computer.give_back(planner);
        }
        let output: Output = self.computer.step(&input);
        board.act(&output.commands)?;
        if let Some(planner) = self.computer.take_request() {
            board.submit(planner);
        }
        board.send(&output.messages);
        self.record = frame_to_log(&input, &output, &self.computer, true, take(&mut self.record));
        let rehearsal = if rehearsed.is_some() { &mut self.rehearsal } else { &mut None };
        swap(&mut self.record.input.rehearsed, rehearsal);
        board.log(&self.record);
        swap(&mut self.record.input.rehearsed, rehearsal);
        Ok(true)
    }
}
