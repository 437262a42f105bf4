//! What a board must offer to fly the flight computer, and the loop that flies it.

use alloc::vec::Vec;

use flight::computer::crew::{People, Request};
use flight::computer::news::News;
use flight::computer::pilot::Sensed;
use flight::computer::{Commander, Commands, Computer, Input, LogState, Output, Rehearsed, flight_time_s};
use flight::estimation::estimator::Measurements;
use flight::rules::arming::Uplink;
use log_records::computer_v1::ComputerFrame;
use tick_log::computer::frame_to_log;

/// Everything that a board has read during a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Gyro and accelerometer in every frame; barometer, satellites and lidar if they have something new.
    pub measured: Measurements,
    /// Where the gimbal is (pitch, yaw), rad; as commanded if its servos do not say.
    pub gimbal_rad: [f64; 2],
    /// Where the fins are, rad; as commanded if their servos do not say.
    pub fins_rad: [f64; 4],
    /// A foot touches the ground.
    pub contact: bool,
    /// A small current flows through the landing motor's igniter.
    pub igniter_continuity: bool,
    /// The wire between booster and vehicle is whole.
    pub booster_attached: bool,
    /// Voltage of the battery, V; `None` on a board that does not measure it.
    pub battery_v: Option<f64>,
    /// The safety pin is out.
    pub pin_out: bool,
    pub log: LogState,
    /// How well the best station is heard.
    pub uplink: Uplink,
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    /// How many people an arming and a start take; `None` without operators.
    pub people: Option<People>,
    /// What the crew has asked for, in order.
    pub requests: Vec<Request>,
    /// Result of the rehearsal of the landing, once it is over.
    pub rehearsed: Option<Rehearsed>,
}

/// A board: a crate for one board implements this with its drivers.
pub trait Board {
    type Error;

    /// Waits for the end of the frame, 5 ms after the last one, and reads everything. `None`: the flight is over.
    ///
    /// # Errors
    /// A device without which nothing can be decided has failed: the loop ends.
    fn sense(&mut self) -> Result<Option<Readings>, Self::Error>;

    /// Moves servos and switches currents: gimbal, fins, both igniters, separation, parachute. It acts on every command
    /// of the last frame at once, and keeps a current only as long as it is commanded.
    ///
    /// # Errors
    /// As [`sense`](Self::sense).
    fn act(&mut self, commands: &Commands) -> Result<(), Self::Error>;

    /// Tells the crew.
    fn tell(&mut self, news: &[News]);

    /// Appends a frame to the log. It must not wait: a log that cannot follow says so in the next frame's `log`.
    fn keep(&mut self, frame: &ComputerFrame);
}

/// Flies the computer on the board until the flight is over.
///
/// # Errors
/// The board has failed.
pub fn fly<B: Board>(computer: &mut Computer, board: &mut B) -> Result<(), B::Error> {
    let (mut frame, mut rehearsed_before) = (0, false);
    while let Some(readings) = board.sense()? {
        frame += 1;
        let input = Input {
            frame,
            time_s: flight_time_s(frame),
            sensed: Sensed::Measured(readings.measured),
            gimbal_rad: readings.gimbal_rad,
            fins_rad: readings.fins_rad,
            contact: readings.contact,
            igniter_continuity: readings.igniter_continuity,
            booster_attached: readings.booster_attached,
            pin_out: readings.pin_out,
            battery_v: readings.battery_v,
            log: readings.log,
            uplink: readings.uplink,
            commander: readings.commander,
            people: readings.people,
            requests: &readings.requests,
            rehearsed: readings.rehearsed.as_ref(),
        };
        let output: Output = computer.step(&input);
        board.act(&output.commands)?;
        board.tell(&output.news);
        board.keep(&frame_to_log(&input, &output, computer, rehearsed_before));
        rehearsed_before |= readings.rehearsed.is_some();
    }
    Ok(())
}
