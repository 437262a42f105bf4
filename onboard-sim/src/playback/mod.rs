//! Plays recorded sensors to the flight computer, to determine its decisions aboard a rocket that
//! flew without it.
//!
//! The computer is stepped as on a board that is powered up with the first row: it is not armed,
//! waits on its rail, and detects the lift-off by itself. Nothing is connected to it. Servos are
//! where they were commanded, the pin is out, igniters have continuity, the wire to the booster
//! breaks with the command to separate. No phase is forced.

mod axes;
pub mod sensor_file;

use flight::computer::{Computer, FRAME_S, Input, LogState, Output, SensedInput, flight_time_s};
use flight::estimation::estimator::{Aids, Measurements};
use flight::estimation::sensor_watch::SENSORS;
use flight::rules::arming::{Check, Uplink};
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::text::Text;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use protocol::log::record::Record;
use sim::outside::Watch as _;
use sim::wire::record::{self, LastFrame};

pub use self::axes::{Axes, NotAxes};

/// Beside those of the sensors, the arming checks that depend on recorded samples alone.
const RECORDED_CHECKS: [&str; 4] = ["rotation", "tilt from vertical", "speed", "estimator"];
/// The arming checks are made once a second; of the seconds before the lift-off the last ones
/// count.
const CHECK_FRAMES: u64 = 200;
const CHECKED_S: usize = 10;
/// Largest number of frames between the start of a lift-off and its detection.
const LIFTING_OFF_FRAMES: u64 = 100;
/// Frames averaged before and after for a climb rate from the barometer, half a second each.
const CLIMB_FRAMES: usize = 100;
/// A faster climb tears a parachute or a stack that separates, m/s.
pub const CLIMB_MAX_M_S: f64 = 30.0;

/// A decision of the computer, with the heights above the pad at that time.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    pub name: &'static str,
    /// Time since the first sample, and T+ (from the detected lift-off), s.
    pub recording_s: f64,
    pub flight_s: f64,
    /// Estimated height, m, and vertical speed, up, m/s.
    pub height_m: f64,
    pub climb_m_s: f64,
    /// The same by the barometer.
    pub barometer: Option<(f64, f64)>,
    /// Height of the last fix of the second before, m.
    pub gnss_m: Option<f64>,
    /// It switched an output on, in a climb that is too fast for it.
    pub too_fast: bool,
}

/// Decisions of the computer in a recorded flight.
#[derive(Debug, Clone, Default)]
pub struct Played {
    /// For each arming check its refusals in the last seconds on the pad, the newest first.
    pub checks: Vec<(&'static str, Vec<Text>)>,
    /// How many seconds these are.
    pub checked_s: usize,
    pub moments: Vec<Moment>,
    /// Measurements used and rejected by the estimator from lift-off on, and its restarts after NaN
    /// states.
    pub aids: Aids,
    pub restarts: u32,
    /// Samples from the lift-off on: barometer, fixes, lidar.
    pub received: [u32; 3],
    /// Highest sample of the barometer from the lift-off on: T+, s, and height, m.
    pub highest: Option<(f64, f64)>,
    /// Largest difference of the estimated height from the barometer's up to apogee: T+, s, and m.
    pub apart: Option<(f64, f64)>,
}

impl Played {
    pub fn moment(&self, name: &str) -> Option<&Moment> {
        self.moments.iter().find(|moment| moment.name == name)
    }
}

/// Whether an arming check depends on recorded samples alone.
pub fn applies(check: &str) -> bool {
    SENSORS.contains(&check) || RECORDED_CHECKS.contains(&check)
}

/// Plays the sensors to the computer of a mission that starts on its pad, and gives each record of
/// its log with its time, ns from power-up.
pub fn play(sensors: &[Measurements], mission: &Mission, mut log: impl FnMut(Record, u64)) -> Played {
    let computer = Computer::at_power_up(mission, &RigidState::upright(0.0));
    let mut player =
        Player { computer, sensors, plan_ready_at: None, checks: Vec::new(), played: Played::default() };
    let start = |computer: &Computer| Record::ComputerStart(Box::new(record::start(computer)));
    log(start(&player.computer), 0);
    let mut last = LastFrame::default();
    for frame in 1..=sensors.len() as u64 {
        let (before, flies) = (player.computer.mode().phase, player.computer.released_at_s().is_some());
        let output = player.step(frame, &mut last);
        let messages = output.messages.iter().map(record::message_event);
        let records = last.take().map(Record::ComputerFrame).into_iter();
        let records = records.chain(output.released.then(|| start(&player.computer))).chain(messages);
        let estimate = flies.then(|| record::estimate(player.computer.pilot())).flatten();
        records.chain(estimate).for_each(|record| log(record, (1e9 * flight_time_s(frame)).round() as u64));
        player.note(frame, before, &output);
    }
    player.finish()
}

struct Player<'a> {
    computer: Computer,
    sensors: &'a [Measurements],
    plan_ready_at: Option<u64>,
    /// The arming checks on the pad, with their frames.
    checks: Vec<(u64, Vec<Check>)>,
    played: Played,
}

impl Player<'_> {
    fn step(&mut self, frame: u64, last: &mut LastFrame) -> Output {
        let mut measured = self.sensors[frame as usize - 1];
        // From the release on a fix is on the clock of the flight.
        if let (Some(fix), Some(released_s)) = (&mut measured.gnss, self.computer.released_at_s()) {
            fix.valid_at_s -= released_s;
        }
        let sensed = SensedInput {
            frame,
            time_s: flight_time_s(frame),
            measured,
            gimbal_rad: self.computer.commands().gimbal_rad,
            fins_rad: self.computer.commands().fins_rad,
            igniter_continuity: true,
            booster_attached: self.played.moment("separation").is_none(),
            pin_out: true,
            log: LogState { running: true, space_bytes: u64::MAX },
            uplink: Uplink::NotNeeded,
            ..SensedInput::default()
        };
        let plan_ready = self.plan_ready_at.take_if(|at| frame >= *at).is_some();
        let input = Input { sensed, requests: &[], rehearsed: None, plan_ready };
        let output = self.computer.step(&input);
        if let Some(frames) = self.computer.solve_requested() {
            self.plan_ready_at = Some(frame + frames);
        }
        last.decided(&input, &output, &self.computer);
        output
    }

    /// Notes the decisions of a frame, from the phase before it.
    fn note(&mut self, frame: u64, before: Phase, output: &Output) {
        let now = self.computer.mode().phase;
        if output.released {
            self.moment("lift-off", frame, false);
        }
        let Some(flown) = self.computer.flown() else {
            if frame.is_multiple_of(CHECK_FRAMES) {
                self.checks.push((frame, self.computer.arming_checks().to_vec()));
            }
            return;
        };
        if before == Phase::Boost && now == Phase::Coast {
            self.moment("burnout", frame, false);
        }
        if before.before_apogee() && !now.before_apogee() {
            self.moment("apogee", frame, false);
        }
        for (which, name) in [
            (PyroOutput::Separation, "separation"),
            (PyroOutput::Parachute, "parachute"),
            (PyroOutput::AscentIgniter, "ascent igniter"),
            (PyroOutput::LandingIgniter, "landing igniter"),
        ] {
            if output.commands.outputs.is_on(which) && self.played.moment(name).is_none() {
                self.moment(name, frame, true);
            }
        }
        let Self { played, computer, .. } = self;
        let Measurements { pressure_altitude_m, gnss, lidar_range_m, .. } = flown.measured;
        let received = [pressure_altitude_m.is_some(), gnss.is_some(), lidar_range_m.is_some()];
        played.received.iter_mut().zip(received).for_each(|(count, has)| *count += u32::from(has));
        if let Some(height_m) = pressure_altitude_m {
            let apart_m = computer.pilot().estimator().estimate().state.position_m.z - height_m;
            if played.highest.is_none_or(|(_, highest_m)| height_m > highest_m) {
                played.highest = Some((flown.time_s, height_m));
            }
            if now.before_apogee() && played.apart.is_none_or(|(_, most_m)| apart_m.abs() > most_m.abs()) {
                played.apart = Some((flown.time_s, apart_m));
            }
        }
    }

    fn moment(&mut self, name: &'static str, frame: u64, fires: bool) {
        let state = self.computer.pilot().estimator().estimate().state;
        let (recording_s, frames) = (flight_time_s(frame), frame as usize);
        let fixes = self.sensors[frames.saturating_sub(2 * CLIMB_FRAMES)..frames].iter().rev();
        let barometer = self.barometer(frames);
        let climb_m_s = barometer.map_or(state.velocity_m_s.z, |(_, climb_m_s)| climb_m_s);
        self.played.moments.push(Moment {
            name,
            recording_s,
            flight_s: recording_s - self.computer.released_at_s().unwrap_or(0.0),
            height_m: state.position_m.z,
            climb_m_s: state.velocity_m_s.z,
            barometer,
            gnss_m: fixes.filter_map(|measured| measured.gnss).map(|fix| fix.position_m.z).next(),
            too_fast: fires && climb_m_s > CLIMB_MAX_M_S,
        });
    }

    /// Height, m, and climb, m/s, after this many frames.
    fn barometer(&self, frames: usize) -> Option<(f64, f64)> {
        let mean_m = |from: usize| {
            let near = self.sensors.iter().skip(from).take(CLIMB_FRAMES);
            let heights = near.filter_map(|measured| measured.pressure_altitude_m);
            let (sum_m, count) = heights.fold((0.0, 0.0), |(sum_m, count), m| (sum_m + m, count + 1.0));
            (count > 0.0).then_some(sum_m / count)
        };
        let (before_m, after_m) = mean_m(frames.checked_sub(CLIMB_FRAMES)?).zip(mean_m(frames))?;
        Some((0.5 * (before_m + after_m), (after_m - before_m) / (CLIMB_FRAMES as f64 * FRAME_S)))
    }

    fn finish(self) -> Played {
        let Self { computer, checks, mut played, .. } = self;
        let lift_off_s = computer.released_at_s().unwrap_or(f64::INFINITY);
        let on_pad = |frame: u64| flight_time_s(frame + LIFTING_OFF_FRAMES) <= lift_off_s;
        let seconds: Vec<_> =
            checks.iter().rev().filter(|(frame, _)| on_pad(*frame)).take(CHECKED_S).collect();
        played.checked_s = seconds.len();
        if let Some((_, newest)) = seconds.first() {
            let refusals =
                |index: usize| seconds.iter().filter_map(move |(_, checks)| checks[index].refusal());
            let each = newest.iter().enumerate();
            played.checks = each.map(|(index, check)| (check.name, refusals(index).collect())).collect();
        }
        let estimator = computer.pilot().estimator();
        Played { aids: *estimator.aids(), restarts: estimator.restarts(), ..played }
    }
}
