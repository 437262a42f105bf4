//! What a board must offer to fly the flight computer, and the loop that flies it.

use flight::computer::news::CrewMessage;
use flight::computer::{Commands, Computer, Input, Output, flight_time_s};
use flight_log::frame::{LoggedInput, frame_to_log};
use protocol::records::computer_v1::ComputerFrame;

/// A board: a crate for one board implements this with its drivers.
pub trait Board {
    type Error;

    /// Waits for the end of the frame, 5 ms after the last one, and reads everything: gyro and accelerometer in every frame,
    /// barometer, satellites and lidar if they have something new; gimbal and fins, which are not read if the airframe says
    /// that their servos do not tell where they are. [`Input`] says what each value is; its number and its time are set by the
    /// loop. `None`: the flight is over.
    ///
    /// # Errors
    /// A device without which nothing can be decided has failed: the loop ends.
    fn sense(&mut self) -> Result<Option<LoggedInput>, Self::Error>;

    /// Moves servos and switches currents: gimbal, fins, both igniters, separation, parachute. It acts on every command
    /// of the last frame at once, and keeps a current only as long as it is commanded.
    ///
    /// # Errors
    /// As [`sense`](Self::sense).
    fn act(&mut self, commands: &Commands) -> Result<(), Self::Error>;

    /// Tells the crew.
    fn tell(&mut self, news: &[CrewMessage]);

    /// Appends a frame to the log. It must not wait: a log that cannot follow says so in the next frame's `log`.
    fn keep(&mut self, frame: &ComputerFrame);
}

/// Flies the computer on the board until the flight is over.
///
/// # Errors
/// The board has failed.
pub fn fly<B: Board>(computer: &mut Computer, board: &mut B) -> Result<(), B::Error> {
    let (mut frame, mut rehearsed_before) = (0, false);
    while let Some(read) = board.sense()? {
        frame += 1;
        let input = Input { frame, time_s: flight_time_s(frame), ..read.input() };
        let output: Output = computer.step(&input);
        board.act(&output.commands)?;
        board.tell(&output.news);
        board.keep(&frame_to_log(&input, &output, computer, rehearsed_before));
        rehearsed_before |= input.rehearsed.is_some();
    }
    Ok(())
}
