//! The flight computer's board as a student club would wire it, around a Teensy 4.1. It has never
//! flown.
//!
//! Everything here is written for the traits of `embedded-hal` and `embedded-io`, so that it runs
//! on a desk, too: `tests.rs` puts simulated devices in the place of the real ones. The image
//! (`chip.rs`) adds a [`Wiring`], a [`Chip`], an entry, a heap, and a timer that calls [`tick`]
//! every 5 ms. [`card`] writes the log to an SD card. `README.md` has pins and parts.
#![cfg_attr(target_os = "none", no_std)]

extern crate alloc;

mod barometer;
pub mod card;
mod gnss;
#[cfg(not(target_os = "none"))]
mod head;
mod imu;
mod lidar;
mod saved;
mod servo;
#[cfg(test)]
mod tests;
mod uart;

use alloc::boxed::Box;
use core::convert::Infallible;

use avionics::board::port::{Board, Frames};
use avionics::link::endpoint::UplinkState;
use avionics::log::frame::LoggedInput;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin, PinState};
use embedded_hal::i2c::I2c;
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal::spi::SpiDevice;
use embedded_io::{Read, ReadReady, Write};
use flight::computer::messages::CrewMessage;
use flight::computer::pad_check::surfaces_rad;
use flight::computer::pilot::planner::Planner;
use flight::computer::{Commands, Computer, FRAME_S, LogState, SensedInput, flight_time_s};
use flight::estimation::estimator::{GnssFix, ImuSample, Measurements};
use flight::rules::outputs::PyroOutput;
use flight::vehicle::atmosphere::{Air, pressure_altitude_m};
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use flight::vehicles::mission::{BUILTIN, builtin};
use nalgebra::Vector3;
use prost::Message as _;
use protocol::motion::Degrees;
use protocol::records::computer_v1::ComputerFrame;

pub use self::barometer::Barometer;
#[cfg(not(target_os = "none"))]
pub use self::head::head;
pub use self::saved::MOST_BYTES;
use self::saved::{Record, Zero};
pub use self::servo::Surface;
use self::uart::Framer;

/// The types of buses and pins, as the chip's own crate names them.
pub trait Wiring {
    type Imu: SpiDevice;
    type Barometer: I2c;
    type Gnss: Read + ReadReady + Write;
    type Lidar: Read + ReadReady;
    type Servo: SetDutyCycle;
    type Output: OutputPin;
    type Switch: InputPin;
    type Chip: Chip;
}

/// Services of the chip besides its buses and pins. None of them waits.
pub trait Chip {
    /// Submits a request to the main context.
    fn submit(&mut self, planner: Box<Planner>);

    /// Returns the result of the main context, once.
    fn solved(&mut self) -> Option<Box<Planner>>;

    /// Radio data since the last frame: an endpoint's uplink state, as in `avionics::board::radio`.
    fn uplink_state(&mut self) -> UplinkState;

    /// Sends messages to the crew.
    fn send(&mut self, messages: &[CrewMessage]);

    /// Puts the record of a frame into the ring from which the main context writes the log
    /// ([`card::Appender`]).
    fn append(&mut self, frame: u64, record: &[u8]);

    /// Whether the ring has never been full, and the space behind it.
    fn log(&self) -> LogState;

    /// Voltage of the pack, V, if it is measured: the computer's, and that of servos and igniters.
    fn batteries_v(&mut self) -> [Option<f64>; 2];

    /// A clock that runs through a reset and never goes back, s.
    fn clock_s(&mut self) -> f64;

    /// Writes a record to one of two places (0 and 1) in a memory that outlasts a reset.
    fn save(&mut self, slot: usize, record: &[u8]);

    /// Reads such a place, which has room for [`MOST_BYTES`]; returns how many bytes were written
    /// to it.
    fn load(&mut self, slot: usize, into: &mut [u8]) -> usize;
}

/// Everything that is wired to the chip.
pub struct Parts<W: Wiring> {
    pub imu: W::Imu,
    pub barometer: W::Barometer,
    pub gnss: W::Gnss,
    pub lidar: W::Lidar,
    /// Gimbal pitch and yaw, fins 1 to 4.
    pub servos: [W::Servo; 6],
    /// As in [`LINES`]: high switches the current on.
    pub outputs: [W::Output; 5],
    /// To ground while a foot touches the ground.
    pub foot: W::Switch,
    /// High if current can flow through the landing motor's igniter, one for each.
    pub igniters: [W::Switch; 2],
    /// To ground through the booster.
    pub booster: W::Switch,
    /// To ground while the safety pin is in.
    pub pin: W::Switch,
    pub chip: W::Chip,
}

/// The outputs: both igniters of the landing motor, that of the ascent motor, separation and
/// parachute.
pub const LINES: [PyroOutput; 5] = [
    PyroOutput::LandingIgniter,
    PyroOutput::LandingIgniter,
    PyroOutput::AscentIgniter,
    PyroOutput::Separation,
    PyroOutput::Parachute,
];

/// Axes from other ones: for each, which of the others it lies on, and whether along it (1) or
/// against it (-1).
pub type Axes = [(usize, f64); 3];

/// World axes (north, west, up) from those of a satellite receiver (north, east, down).
pub const WORLD_FROM_NED: Axes = [(0, 1.0), (1, -1.0), (2, -1.0)];

/// How this vehicle was built.
#[derive(Debug, Clone, PartialEq)]
pub struct Build {
    /// Body axes from those that are printed on the inertial unit.
    pub body_from_imu: Axes,
    /// Gimbal pitch and yaw, fins 1 to 4.
    pub surfaces: [Surface; 6],
    /// Age of a fix when its last byte arrives, s.
    pub fix_age_s: f64,
}

/// Why a board or a part of it does not start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Trouble {
    #[error("airframe: servos_report is true, and these servos tell nothing; false is accepted")]
    ServosTell,
    #[error("body_from_imu mirrors its axes; three different ones of a right-handed set are accepted")]
    Mirrored,
    #[error("{0}")]
    Part(&'static str),
    #[error("the inertial unit calls itself {0:#04x}; 0x47, an ICM-42688-P, is accepted")]
    AnotherImu(u8),
    #[error("the barometer calls itself {0:#04x}; 0x60, a BMP390, is accepted")]
    AnotherBarometer(u8),
}

/// Longest record of a frame, bytes: 250 as a rule, and some kB with the rehearsal and requests.
const MOST_RECORD_BYTES: usize = 8 * 1024;

/// Frames between requests for the receiver's mode, until it is confirmed: a second.
const AIRBORNE_FRAMES: u64 = 200;

/// Samples that make the zero of the height, one second, and of the place, two seconds.
const ZERO_HEIGHTS: u32 = 50;
const ZERO_FIXES: u32 = 10;

/// The board.
pub struct TeensyBoard<W: Wiring> {
    /// A device that did not start is silent: the flight computer arms nothing without it, and
    /// after a reset in the air it flies without it.
    pub imu: Result<(), Trouble>,
    pub barometer: Result<Barometer, Trouble>,
    parts: Parts<W>,
    build: Build,
    gnss: Framer<{ gnss::FRAME_BYTES }>,
    /// The receiver's answers about its dynamic model, and whether the last one was: airborne.
    model: Framer<{ gnss::MODEL_BYTES }>,
    airborne: bool,
    unconfirmed_frames: u64,
    lidar: Framer<{ lidar::FRAME_BYTES }>,
    pad: Degrees,
    /// Air temperature at the pad, in the shade, K: warm air is taller. An error of 3 K makes every
    /// height wrong by one per cent.
    air_k: f64,
    /// Position of the centre of gravity of the vehicle on its pad, world, m.
    stands_m: Vector3<f64>,
    height: Zero,
    place: Zero,
    frame: u64,
    released_at: u64,
}

/// Text and content of a built-in mission, flown with servos that report nothing.
pub fn mission(name: &str) -> Option<(&'static str, Mission)> {
    let (_, toml) = BUILTIN.iter().find(|(available, _)| *available == name)?;
    let mut mission = builtin(name)?.ok()?;
    mission.airframe.servos_report = false;
    Some((toml, mission))
}

/// The computer at power-up. It assumes that its rail is as in the drawing.
pub fn at_power_up(mission: &Mission) -> Computer {
    let cg_station_m = mission.airframe.mass.loaded_cg_station_m;
    let standing = mission.launched().map(|launch| launch.standing(cg_station_m));
    Computer::at_power_up(mission, &standing.unwrap_or_else(|| RigidState::upright(cg_station_m)))
}

/// Starts board and frames at power-up, and resumes after a reset. `computer` is one at power-up.
///
/// # Errors
/// The vehicle is built otherwise than this board needs it.
pub fn start<W: Wiring>(
    mut parts: Parts<W>,
    build: Build,
    mut computer: Computer,
    delay: &mut impl DelayNs,
) -> Result<(Frames, TeensyBoard<W>), Trouble> {
    let mission = computer.pilot().mission();
    if mission.airframe.servos_report {
        return Err(Trouble::ServosTell);
    }
    let [x, y, z] = build.body_from_imu.map(|(axis, sign)| Vector3::ith(axis, sign));
    if x.cross(&y) != z {
        return Err(Trouble::Mirrored);
    }
    let (site, stands_m) = (mission.site, computer.pilot().estimator().estimate().state.position_m);
    let (imu, barometer) = (imu::start(&mut parts.imu, delay), Barometer::start(&mut parts.barometer, delay));
    let (mut height, mut place, mut frame, chip) = (Zero::default(), Zero::default(), 0, &mut parts.chip);
    let records = [0, 1].into_iter().filter_map(|slot| {
        let mut bytes = [0; MOST_BYTES];
        let read = chip.load(slot, &mut bytes);
        Record::read(bytes.get(..read)?)
    });
    if let Some(record) = records.max_by_key(|record| record.saved.frame()) {
        let lost_s = (chip.clock_s() - record.clock_s).max(0.0);
        let back = record.saved.frame() + libm::round(lost_s / FRAME_S) as u64;
        computer.resume(&record.saved, flight_time_s(back));
        // It is not resumed after too long a time.
        if computer.frame() > 0 {
            (height, place, frame) = (record.height, record.place, back);
        }
    }
    let released_at = computer.released_at_s().map_or(0, |at_s| libm::round(at_s / FRAME_S) as u64);
    let (gnss, lidar) = (Framer::new(gnss::HEAD), Framer::new(lidar::HEAD));
    let board = TeensyBoard {
        imu,
        barometer,
        parts,
        build,
        gnss,
        model: Framer::new(gnss::MODEL_HEAD),
        airborne: false,
        unconfirmed_frames: 0,
        lidar,
        pad: Degrees { latitude: site.latitude_deg, longitude: site.longitude_deg },
        air_k: site.air_at_m(0.0).temperature_k,
        stands_m,
        height,
        place,
        frame,
        released_at,
    };
    Ok((Frames::new(computer, frame), board))
}

/// Called by the timer every 5 ms. Returns `false` if the flight is over.
pub fn tick<W: Wiring>(frames: &mut Frames, board: &mut TeensyBoard<W>) -> bool {
    let Ok(goes_on) = frames.fly(board);
    let (saved, clock_s) = (frames.computer().saved(), board.parts.chip.clock_s());
    let record = Record { clock_s, height: board.height, place: board.place, saved };
    if let Some(bytes) = record.write(&mut [0; MOST_BYTES]) {
        board.parts.chip.save((record.saved.frame() % 2) as usize, bytes);
    }
    goes_on
}

impl<W: Wiring> TeensyBoard<W> {
    fn measured(&mut self) -> Measurements {
        let (parts, axes) = (&mut self.parts, &self.build.body_from_imu);
        // The sensor monitor treats NaN as silence.
        let sensed = self.imu.as_ref().ok().and_then(|()| imu::read(&mut parts.imu));
        let [force_m_s2, rate_rad_s] = sensed.unwrap_or([[f64::NAN; 3]; 2]);
        let imu =
            ImuSample { gyro_rad_s: turned(axes, rate_rad_s), specific_force_m_s2: turned(axes, force_m_s2) };
        let pressure_pa = self.barometer.as_mut().ok().and_then(|driver| driver.poll(&mut parts.barometer));
        let pressure_altitude_m = pressure_pa.map(pressure_altitude_m).and_then(|height_m| {
            let above_m = self.height.from(ZERO_HEIGHTS, Vector3::repeat(height_m))?.z;
            let standard_k = Air::at_geopotential_m(height_m - above_m).temperature_k;
            Some(self.stands_m.z + above_m * self.air_k / standard_k)
        });
        let (mut lidar_range_m, mut fix) = (None, None);
        uart::each(&mut parts.lidar, |bytes| {
            lidar_range_m = self.lidar.newest(bytes, lidar::range_m).or(lidar_range_m);
        });
        uart::each(&mut parts.gnss, |bytes| {
            self.airborne = self.model.newest(bytes, gnss::is_airborne).unwrap_or(self.airborne);
            fix = self.gnss.newest(bytes, gnss::fix).or(fix);
        });
        if !self.airborne {
            if self.unconfirmed_frames.is_multiple_of(AIRBORNE_FRAMES) {
                gnss::request_airborne(&mut parts.gnss);
            }
            self.unconfirmed_frames += 1;
        }
        // A receiver in another mode is silent: nothing is armed without it.
        let gnss = fix.filter(|_| self.airborne).and_then(|fix| self.located(&fix));
        Measurements { imu, pressure_altitude_m, gnss, lidar_range_m }
    }

    /// A fix on the flight computer's clock, relative to the pad: the vehicle is at its mission's
    /// site.
    fn located(&mut self, fix: &gnss::Fix) -> Option<GnssFix> {
        let (north_m, east_m) =
            self.pad.to(Degrees { latitude: fix.latitude_deg, longitude: fix.longitude_deg });
        let place_m = turned(&WORLD_FROM_NED, [north_m, east_m, -fix.height_m]);
        Some(GnssFix {
            position_m: self.stands_m + self.place.from(ZERO_FIXES, place_m)?,
            velocity_m_s: turned(&WORLD_FROM_NED, fix.velocity_ned_m_s),
            valid_at_s: flight_time_s(self.frame + 1 - self.released_at) - self.build.fix_age_s,
            quality: fix.quality,
        })
    }
}

impl<W: Wiring> Board for TeensyBoard<W> {
    /// A failed sensor is silent, which the flight computer handles; ending the frames would be
    /// worse.
    type Error = Infallible;

    fn sense(&mut self) -> Result<Option<LoggedInput>, Infallible> {
        let UplinkState { uplink, commander, requests } = self.parts.chip.uplink_state();
        // A switch that cannot be read counts as: no contact, no igniter, no booster, pin in.
        let high = |switch: &mut W::Switch| switch.is_high().unwrap_or(false);
        let low = |switch: &mut W::Switch| switch.is_low().unwrap_or(false);
        let [battery_v, servo_battery_v] = self.parts.chip.batteries_v();
        let sensed = SensedInput {
            frame: 0,
            time_s: 0.0,
            measured: self.measured(),
            // Not read: the flight computer models these servos.
            gimbal_rad: [0.0; 2],
            fins_rad: [0.0; 4],
            contact: low(&mut self.parts.foot),
            igniter_continuity: self.parts.igniters.iter_mut().all(high),
            booster_attached: low(&mut self.parts.booster),
            pin_out: high(&mut self.parts.pin),
            battery_v,
            servo_battery_v,
            log: self.parts.chip.log(),
            uplink,
            commander,
            // `avionics::board::radio` does not support operators yet.
            people: None,
        };
        Ok(Some(LoggedInput { sensed, requests, rehearsed: None, plan_ready: false }))
    }

    fn act(&mut self, commands: &Commands) -> Result<(), Infallible> {
        let Commands { gimbal_rad, fins_rad, outputs } = *commands;
        let angles_rad = surfaces_rad(gimbal_rad, fins_rad);
        let surfaces = self.parts.servos.iter_mut().zip(&self.build.surfaces);
        for ((servo, surface), angle_rad) in surfaces.zip(angles_rad) {
            // A failed command is repeated in the next frame.
            let _ = servo.set_duty_cycle(surface.duty(angle_rad, servo.max_duty_cycle()));
        }
        for (output, line) in self.parts.outputs.iter_mut().zip(LINES) {
            let _ = output.set_state(PinState::from(outputs.is_on(line)));
        }
        Ok(())
    }

    fn submit(&mut self, planner: Box<Planner>) {
        self.parts.chip.submit(planner);
    }

    fn solved(&mut self) -> Option<Box<Planner>> {
        self.parts.chip.solved()
    }

    fn send(&mut self, messages: &[CrewMessage]) {
        self.parts.chip.send(messages);
    }

    fn log(&mut self, frame: &ComputerFrame) {
        self.frame = frame.input.frame;
        if frame.output.released {
            self.released_at = self.frame;
        }
        let mut bytes = [0; MOST_RECORD_BYTES];
        let mut room = &mut bytes[..];
        // A longer record than there can be is appended empty, which a replay reports.
        let fits = frame.encode(&mut room).is_ok();
        let left = if fits { room.len() } else { MOST_RECORD_BYTES };
        self.parts.chip.append(self.frame, &bytes[..MOST_RECORD_BYTES - left]);
    }
}

/// A vector in other axes: the only place where a sensor's axes become those of body or world.
fn turned(axes: &Axes, vector: [f64; 3]) -> Vector3<f64> {
    Vector3::from(axes.map(|(axis, sign)| sign * vector[axis]))
}
