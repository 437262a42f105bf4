//! Plays recorded sensors to the flight computer: what it would have decided on board of a rocket that flew without it.
//!
//! The computer is stepped as on a board that is powered up with the first row: nobody arms it, it waits on its rail, and
//! it detects the lift-off by itself. Nothing is connected to it. Servos are where they were commanded, the pin is out,
//! igniters have continuity, the wire to the booster breaks with the command to separate. No phase is forced.

mod axes;
pub mod sensor_file;

use std::collections::VecDeque;

use flight::computer::news::{CrewMessage, Severity};
use flight::computer::{Computer, FRAME_S, Input, KeptInput, LogState, Output, flight_time_s};
use flight::estimation::estimator::{Aids, Measurements};
use flight::rules::arming::{Check, UPLINK_CHECK, Uplink};
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use protocol::log::record::Record;
use sim::outside::Watch as _;
use sim::wire::record::{self, LastFrame};

pub use self::axes::{Axes, NotAxes};
pub use self::sensor_file::RecordedSensors;

/// Arming checks of what is not recorded, or of what a computer without a vehicle does not have.
const NOT_APPLICABLE: [&str; 11] = [
    "abort latch",
    "pin",
    "self-test",
    "fins answering",
    "igniter continuity",
    "log",
    "log space",
    "controller warm",
    "predicted touchdown",
    UPLINK_CHECK,
    "battery",
];
/// The arming checks are made once a second, and those of the last ten seconds on the pad count.
const CHECK_FRAMES: u64 = 200;
const CHECKS_KEPT: usize = 10;
/// The lift-off begins up to so many frames before it is detected.
const LIFTING_OFF_FRAMES: u64 = 100;
/// A climb from a barometer is a line through the samples of so many frames before and after, half a second.
const CLIMB_FRAMES: usize = 100;
/// A parachute or a separation at a higher climb, m/s, breaks what a rocket of this size is built of.
pub const CLIMB_MAX_M_S: f64 = 30.0;

/// An arming check over the last seconds on the pad.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PadCheck {
    pub name: &'static str,
    /// In how many of those seconds it refused, and why in the last of them.
    pub refused_s: usize,
    pub refusal: Option<String>,
    pub applies: bool,
}

/// A decision of the computer, and the heights at that time, above the pad.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    pub name: &'static str,
    /// Time since the first row, and T+ (from the detected lift-off), s.
    pub recording_s: f64,
    pub flight_s: f64,
    /// Estimated height, m, and vertical speed, up, m/s.
    pub height_m: f64,
    pub climb_m_s: f64,
    /// By a line through the barometer's samples: height, m, and climb, m/s.
    pub barometer: Option<(f64, f64)>,
    /// Height of the last fix, m.
    pub gnss_m: Option<f64>,
    /// It switched an output.
    pub fires: bool,
}

impl Moment {
    /// It fires something while the vehicle climbs too fast for it.
    pub fn breaks_the_vehicle(&self) -> bool {
        self.fires && self.barometer.map_or(self.climb_m_s, |(_, climb_m_s)| climb_m_s) > CLIMB_MAX_M_S
    }
}

/// What the computer made of a recorded flight.
#[derive(Debug, Clone, Default)]
pub struct Played {
    /// The arming checks, and over how many seconds before the lift-off.
    pub checks: Vec<PadCheck>,
    pub checked_s: usize,
    pub moments: Vec<Moment>,
    /// What the estimator used and rejected from the lift-off on.
    pub aids: Aids,
    /// Samples in flight: barometer, fixes, lidar.
    pub received: [u32; 3],
    /// Highest sample of the barometer in flight: T+, s, and height, m.
    pub highest: Option<(f64, f64)>,
    /// Largest difference of the estimated height from the barometer's up to apogee: T+, s, and m.
    pub apart: Option<(f64, f64)>,
    /// Frames whose estimate was not a number, and restarts of the estimator.
    pub not_finite: u64,
    pub restarts: u32,
}

impl Played {
    pub fn moment(&self, name: &str) -> Option<&Moment> {
        self.moments.iter().find(|moment| moment.name == name)
    }
}

/// Plays the sensors to the computer of a mission that starts on its pad, and gives each record of its log with its time,
/// ns from power-up.
pub fn play(sensors: &[Measurements], mission: &Mission, mut log: impl FnMut(Record, u64)) -> Played {
    let mut player = Player {
        computer: Computer::at_power_up(mission, &RigidState::upright(0.0)),
        sensors,
        attached: true,
        plan_ready_at: None,
        checks: VecDeque::new(),
        played: Played::default(),
    };
    let mut last = LastFrame::default();
    log(start(&player.computer), 0);
    for frame in 1..=sensors.len() as u64 {
        let phase = player.computer.mode().phase;
        let flies = player.computer.released_at_s().is_some();
        let output = player.step(frame, &mut last);
        let time_ns = (flight_time_s(frame) * 1e9).round() as u64;
        let frame_record = last.take().map(Record::ComputerFrame);
        let released = output.released.then(|| start(&player.computer));
        let news = output.news.iter().map(|message| match message {
            CrewMessage::Said { severity, words } => record::text_event(*severity, words),
            CrewMessage::PhaseChanged { from, to } => record::phase_event(*from, *to),
        });
        let estimate = flies.then(|| record::thought(player.computer.pilot())).flatten();
        frame_record
            .into_iter()
            .chain(released)
            .chain(news)
            .chain(estimate)
            .for_each(|record| log(record, time_ns));
        player.note(frame, phase, &output);
    }
    player.finish()
}

fn start(computer: &Computer) -> Record {
    Record::ComputerStart(Box::new(record::start(computer)))
}

/// The event that begins a log of recorded sensors.
pub fn beginning(words: &str) -> Record {
    record::text_event(Severity::Notice, words)
}

struct Player<'a> {
    computer: Computer,
    sensors: &'a [Measurements],
    /// The booster is attached: nothing has commanded its separation.
    attached: bool,
    plan_ready_at: Option<u64>,
    /// The last arming checks on the pad, each with its frame.
    checks: VecDeque<(u64, Vec<Check>)>,
    played: Played,
}

impl Player<'_> {
    fn step(&mut self, frame: u64, last: &mut LastFrame) -> Output {
        let mut measured = self.sensors[frame as usize - 1];
        // From the release on a fix is on the clock of the flight.
        if let (Some(fix), Some(released_s)) = (&mut measured.gnss, self.computer.released_at_s()) {
            fix.valid_at_s -= released_s;
        }
        let commands = self.computer.commands();
        let kept = KeptInput {
            frame,
            time_s: flight_time_s(frame),
            measured,
            gimbal_rad: commands.gimbal_rad,
            fins_rad: commands.fins_rad,
            igniter_continuity: true,
            booster_attached: self.attached,
            pin_out: true,
            log: LogState { running: true, space_bytes: u64::MAX },
            uplink: Uplink::NotNeeded,
            ..KeptInput::NONE
        };
        let plan_ready = self.plan_ready_at.take_if(|at| frame >= *at).is_some();
        let input = Input { kept, requests: &[], rehearsed: None, plan_ready };
        let output = self.computer.step(&input);
        if let Some(frames) = self.computer.solve_posed() {
            self.plan_ready_at = Some(frame + frames);
        }
        last.decided(&input, &output, &self.computer);
        output
    }

    /// Notes what a frame has decided, from the phase before it.
    fn note(&mut self, frame: u64, before: Phase, output: &Output) {
        let Some(flown) = self.computer.flown() else {
            if output.released {
                self.moment("lift-off", frame, false);
            } else if frame.is_multiple_of(CHECK_FRAMES) {
                if self.checks.len() == CHECKS_KEPT + 1 {
                    self.checks.pop_front();
                }
                self.checks.push_back((frame, self.computer.arming_checks()));
            }
            return;
        };
        let now = self.computer.mode().phase;
        if before == Phase::Boost && now == Phase::Coast {
            self.moment("burnout", frame, false);
        }
        if before.before_apogee() && !now.before_apogee() {
            self.moment("apogee", frame, false);
        }
        for (output_of, name) in [
            (PyroOutput::Separation, "separation"),
            (PyroOutput::Parachute, "parachute"),
            (PyroOutput::AscentIgniter, "ascent igniter"),
            (PyroOutput::LandingIgniter, "landing igniter"),
        ] {
            let fired = self.played.moment(name).is_some();
            if !fired && output.commands.outputs.is_on(output_of) {
                self.moment(name, frame, true);
            }
        }
        self.attached &= !output.commands.outputs.is_on(PyroOutput::Separation);
        let Some(estimate) = self.computer.pilot().estimate() else { return };
        let played = &mut self.played;
        played.not_finite += u64::from(!estimate.state.is_finite());
        let Measurements { pressure_altitude_m, gnss, lidar_range_m, .. } = flown.measured;
        let received = [pressure_altitude_m.is_some(), gnss.is_some(), lidar_range_m.is_some()];
        for (count, has) in played.received.iter_mut().zip(received) {
            *count += u32::from(has);
        }
        if let Some(height_m) = pressure_altitude_m {
            if played.highest.is_none_or(|(_, highest_m)| height_m > highest_m) {
                played.highest = Some((flown.time_s, height_m));
            }
            let apart_m = estimate.state.position_m.z - height_m;
            if now.before_apogee() && played.apart.is_none_or(|(_, most_m)| apart_m.abs() > most_m.abs()) {
                played.apart = Some((flown.time_s, apart_m));
            }
        }
    }

    fn moment(&mut self, name: &'static str, frame: u64, fires: bool) {
        let state = self.computer.pilot().estimator().estimate().state;
        let since = frame as usize;
        let fixes = self.sensors[since.saturating_sub(2 * CLIMB_FRAMES)..since].iter().rev();
        self.played.moments.push(Moment {
            name,
            recording_s: flight_time_s(frame),
            flight_s: flight_time_s(frame) - self.computer.released_at_s().unwrap_or(0.0),
            height_m: state.position_m.z,
            climb_m_s: state.velocity_m_s.z,
            barometer: self.barometer(since),
            gnss_m: fixes.filter_map(|measured| measured.gnss).map(|fix| fix.position_m.z).next(),
            fires,
        });
    }

    /// Height and climb at the end of a frame, by least squares.
    fn barometer(&self, frame: usize) -> Option<(f64, f64)> {
        let from = frame.saturating_sub(CLIMB_FRAMES);
        let near = self.sensors.iter().enumerate().take(frame + CLIMB_FRAMES).skip(from);
        let samples: Vec<(f64, f64)> = near
            .filter_map(|(index, measured)| {
                Some(((index as f64 + 1.0 - frame as f64) * FRAME_S, measured.pressure_altitude_m?))
            })
            .collect();
        let count = samples.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| samples.iter().map(of).sum::<f64>() / count;
        let (mean_s, mean_m) = (mean(&|sample| sample.0), mean(&|sample| sample.1));
        let spread_s2 = mean(&|sample| (sample.0 - mean_s) * (sample.0 - mean_s));
        let climb_m_s = mean(&|sample| (sample.0 - mean_s) * (sample.1 - mean_m)) / spread_s2;
        climb_m_s.is_finite().then_some((mean_m - climb_m_s * mean_s, climb_m_s))
    }

    fn finish(self) -> Played {
        let Self { computer, checks, mut played, .. } = self;
        let lift_off = played.moment("lift-off").map_or(u64::MAX, |at| (at.recording_s / FRAME_S) as u64);
        let on_pad = checks.iter().filter(|(frame, _)| frame + LIFTING_OFF_FRAMES <= lift_off);
        let seconds: Vec<&Vec<Check>> = on_pad.map(|(_, checks)| checks).rev().take(CHECKS_KEPT).collect();
        played.checked_s = seconds.len();
        for (index, check) in seconds.first().into_iter().flat_map(|newest| newest.iter().enumerate()) {
            let mut refusals = seconds.iter().filter_map(|second| second[index].refusal());
            let refusal = refusals.next();
            played.checks.push(PadCheck {
                name: check.name,
                refused_s: refusals.count() + usize::from(refusal.is_some()),
                refusal,
                applies: !NOT_APPLICABLE.contains(&check.name),
            });
        }
        played.aids = *computer.pilot().estimator().aids();
        played.restarts = computer.pilot().estimator().restarts();
        played
    }
}
