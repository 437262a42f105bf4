//! What a board must offer to fly the flight computer, and the frames that fly it.
//!
//! A board has two contexts. A timer calls [`Frames::fly`] every 5 ms, which never waits. The main
//! context computes what a frame has [posed](Board::pose), which takes up to 20 frames, and is
//! interrupted by them: it receives a [`Planner`], calls [`Planner::solve`], and sends it back. The
//! planner is a box that moves through the board's own channels, such as two queues of
//! `heapless::spsc`: nothing is shared.

use alloc::boxed::Box;

use crate::log::frame::{LoggedInput, frame_to_log};
use flight::computer::news::CrewMessage;
use flight::computer::pilot::planner::Planner;
use flight::computer::{Commands, Computer, Input, KeptInput, Output, Rehearsed, flight_time_s};
use protocol::records::computer_v1::ComputerFrame;

/// A board: a crate for one board implements this with its drivers.
pub trait Board {
    type Error;

    /// Reads everything at the end of a frame, 5 ms after the last one, and does not wait: gyro and
    /// accelerometer in every frame, barometer, satellites and lidar if they have something new;
    /// gimbal and fins, which are not read if the airframe says that their servos do not tell where
    /// they are. [`Input`] says what each value is; its number, its time, the rehearsal and whether
    /// a plan is ready are set by [`Frames`]. `None`: the flight is over.
    ///
    /// # Errors
    /// A device without which nothing can be decided has failed.
    fn sense(&mut self) -> Result<Option<LoggedInput>, Self::Error>;

    /// Moves servos and switches currents: gimbal, fins, both igniters, separation, parachute. It
    /// acts on every command of the last frame at once, and keeps a current only as long as it is
    /// commanded.
    ///
    /// # Errors
    /// As [`sense`](Self::sense).
    fn act(&mut self, commands: &Commands) -> Result<(), Self::Error>;

    /// Sends to the main context what it has to compute. It does not wait: there is never more than
    /// one.
    fn pose(&mut self, posed: Box<Planner>);

    /// Receives what the main context has computed, once.
    fn solved(&mut self) -> Option<Box<Planner>>;

    /// Tells the crew.
    fn tell(&mut self, news: &[CrewMessage]);

    /// Appends a frame to the log. It must not wait: a log that cannot follow says so in the next
    /// frame's `log`.
    fn keep(&mut self, frame: &ComputerFrame);
}

/// The frames of a flight.
#[derive(Debug)]
pub struct Frames {
    computer: Computer,
    frame: u64,
    /// For the next frame, which keeps it.
    rehearsed: Option<Rehearsed>,
}

impl Frames {
    /// Behind this frame: 0 at power-up, and for a computer that was [resumed](Computer::resume)
    /// the one that a clock gives which ran through the reset. A computer that was not released
    /// rehearses its landing now, which takes some seconds.
    pub fn new(mut computer: Computer, frame: u64) -> Self {
        let rehearsed = computer.rehearse();
        Self { computer, frame, rehearsed }
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
        let kept = KeptInput { frame: self.frame, time_s: flight_time_s(self.frame), ..read.kept };
        let (requests, plan_ready) = (&*read.requests, solved.is_some());
        let input = Input { kept, requests, rehearsed: rehearsed.as_ref(), plan_ready };
        if let Some(planner) = solved {
            self.computer.give_back(planner);
        }
        let output: Output = self.computer.step(&input);
        board.act(&output.commands)?;
        if let Some(posed) = self.computer.take_posed() {
            board.pose(posed);
        }
        board.tell(&output.news);
        board.keep(&frame_to_log(&input, &output, &self.computer, false));
        Ok(true)
    }
}
