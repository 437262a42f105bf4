//! Faults detected in flight from the computer's data, in order of time, each with the numbers that
//! support it.
//!
//! [`Findings::note`] examines the computer after each frame. Nothing on board depends on it: the
//! vehicle sends the findings, and a report begins with them. Simulated truth is not used, because
//! a real flight has none.
//!
//! Each [`Sign`] has one rule, in [`Watcher::seen`] and [`RULES`].

use alloc::format;
use alloc::string::{String, ToString as _};
use alloc::vec::Vec;

use nalgebra::Vector3;

use super::pad_check::{SURFACE_NAMES, SURFACES, surfaces_rad};
use super::{Computer, FRAME_S, SensedInput};
use crate::control::servo::{GIMBALS, ServoModel};
use crate::estimation::estimator::{Estimate, GRAVITY_M_S2, GnssFix, Health, ImuSample};
use crate::estimation::motor_estimate::MotorStage;
use crate::estimation::sensor_watch::{BAROMETER_LOST_S, GNSS_LOST_S, LIDAR_LOST_S, SENSORS};
use crate::guidance::powered::ControlLevel;
use crate::rules::outputs::PyroOutput;
use crate::rules::phase::{Latch, Phase};

/// A sign that no flight shows while its vehicle works correctly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sign {
    /// The computer was down for a while.
    Restart,
    Gnss,
    Barometer,
    Lidar,
    /// A sensor, by its index in [`SENSORS`], sends no plausible sample.
    Implausible(u8),
    /// A sensor repeats one sample.
    Repeats(u8),
    /// A sensor changes by more in one sample than any motion.
    Jumps(u8),
    /// The velocities of the inertial unit and of GNSS drift apart.
    Apart,
    /// The barometer disagrees with the other heights.
    HeightsDisagree,
    /// The lidar disagrees with the other heights.
    RangesDisagree,
    /// The estimate was unhealthy.
    Estimate,
    /// Gimbal pitch and yaw, then the fins: the surface does not follow its commands.
    Surface(u8),
    /// The gimbal turns more slowly than its servo's data.
    SlowGimbal,
    Battery,
    /// The ascent motor delivered less than its curve.
    AscentMotor,
    /// The booster is still attached after its charge was fired.
    Separation,
    /// The vehicle falls fast although the parachute was ejected.
    Parachute,
    /// The landing motor ignited later than any recorded delay.
    LateLight,
    /// The landing motor is weaker or stronger than the mission's.
    Impulse,
    /// The landing motor burned out early.
    BurntOutEarly,
    /// No plan lands, and no plan is left to fly.
    NoPlan,
    /// The nose points below the horizon while the motor burns.
    Tumbles,
    /// Ignition stayed inhibited.
    Gate,
    /// Another cause has latched an abort or inhibited the landing motor.
    Latched,
}

/// Every sign, and the time for which it must last to become a finding, s. Shorter signs are noise,
/// a dropped sample or a gust.
const RULES: [(Sign, f64); 38] = [
    (Sign::Restart, 0.0),
    (Sign::Gnss, 0.0),
    (Sign::Barometer, 0.0),
    (Sign::Lidar, 0.0),
    (Sign::Implausible(ACCELEROMETER), 0.0),
    (Sign::Implausible(GYRO), 0.0),
    (Sign::Repeats(ACCELEROMETER), 0.0),
    (Sign::Repeats(GYRO), 0.0),
    (Sign::Repeats(BAROMETER), 0.0),
    (Sign::Repeats(GNSS), 0.0),
    (Sign::Repeats(LIDAR), 0.0),
    (Sign::Jumps(ACCELEROMETER), 0.0),
    (Sign::Jumps(GYRO), 0.0),
    (Sign::Jumps(BAROMETER), 0.0),
    (Sign::Jumps(GNSS), 0.0),
    (Sign::Jumps(LIDAR), 0.0),
    (Sign::Apart, 0.0),
    (Sign::HeightsDisagree, 0.5),
    (Sign::RangesDisagree, 0.2),
    (Sign::Estimate, 0.2),
    (Sign::Surface(0), 0.1),
    (Sign::Surface(1), 0.1),
    (Sign::Surface(2), 0.3),
    (Sign::Surface(3), 0.3),
    (Sign::Surface(4), 0.3),
    (Sign::Surface(5), 0.3),
    (Sign::SlowGimbal, 0.0),
    (Sign::Battery, 0.1),
    (Sign::AscentMotor, 0.0),
    (Sign::Separation, 0.5),
    (Sign::Parachute, 0.0),
    (Sign::LateLight, 0.0),
    (Sign::Impulse, 0.2),
    (Sign::BurntOutEarly, 0.0),
    (Sign::NoPlan, 0.5),
    (Sign::Tumbles, 0.05),
    (Sign::Gate, 0.0),
    (Sign::Latched, 0.0),
];

/// A detected fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    pub sign: Sign,
    /// When it began, s since the release.
    pub since_s: f64,
    /// Total time for which it held, s.
    pub held_s: f64,
    /// The worst measured value, in the unit of the text.
    pub value: f64,
    /// The value it is compared with, or a second number.
    pub beside: f64,
    /// Additional text.
    pub detail: String,
    /// Another finding explains it.
    pub follows: bool,
}

impl Finding {
    /// The finding as a short sentence, without its time.
    pub fn words(&self) -> String {
        let Self { value, beside, ref detail, held_s, .. } = *self;
        match self.sign {
            Sign::Restart => format!("flight computer away for {value:.2} s"),
            Sign::Gnss => format!("GNSS lost for {value:.1} s"),
            Sign::Barometer => format!("barometer silent for {value:.1} s"),
            Sign::Lidar => format!("lidar silent from {beside:.0} m down"),
            Sign::Implausible(sensor) => {
                format!("{} sends no usable sample for {value:.2} s", name_of(sensor))
            }
            Sign::Repeats(sensor) => format!("{} repeats one sample for {value:.1} s", name_of(sensor)),
            Sign::Jumps(sensor) => {
                format!("{} jumps by {value:.1} {detail} in one sample", name_of(sensor))
            }
            Sign::Apart => {
                format!("accelerometer or gyro: velocity {value:.1} m/s from GNSS in {APART_FIXES} fixes")
            }
            Sign::RangesDisagree => format!("lidar {value:.1} m from the other heights"),
            Sign::HeightsDisagree => format!("barometer {value:.1} m from the other heights"),
            Sign::Estimate => format!("estimate unhealthy for {held_s:.1} s: {detail}"),
            Sign::Surface(surface) => {
                let name = SURFACE_NAMES.get(usize::from(surface)).unwrap_or(&"surface");
                format!("{name} {value:.1} deg from where its commands take it, at {beside:.1} deg{detail}")
            }
            Sign::SlowGimbal => format!("gimbal turns at {value:.0} deg/s at most, not {beside:.0}"),
            Sign::Battery => format!("battery down to {value:.2} V"),
            Sign::AscentMotor => format!("ascent motor gave {value:.2} of its impulse"),
            Sign::Separation => "booster did not separate".to_string(),
            Sign::Parachute => format!("falls at {value:.0} m/s under its parachute"),
            Sign::LateLight => {
                format!("landing ignition {value:.2} s after its command, not {beside:.2} s")
            }
            Sign::Impulse => format!("landing motor's impulse {value:.3} of the mission's"),
            Sign::BurntOutEarly => format!("landing motor went out {value:.1} s early"),
            Sign::NoPlan => format!("no plan that lands for {held_s:.1} s"),
            Sign::Tumbles => format!("nose below the horizon in the burn: tilt {value:.0} deg"),
            Sign::Gate if detail.is_empty() => "ignition gate stayed shut".to_string(),
            Sign::Gate => format!("ignition gate stayed shut: {detail}"),
            Sign::Latched => detail.clone(),
        }
    }
}

/// A sign in one frame: since when, s, and the numbers of the finding.
#[derive(Debug, Clone, Copy)]
struct Hit {
    since_s: f64,
    /// Severity: the worst is stored.
    size: f64,
    value: f64,
    beside: f64,
    detail: &'static str,
}

/// A sign that is being watched.
#[derive(Debug, Clone, Copy, Default)]
struct SignWatch {
    since_s: Option<f64>,
    /// Index of its finding.
    found: Option<usize>,
    worst: f64,
}

/// The findings of a flight.
#[derive(Debug, Clone)]
pub struct Findings {
    watcher: Option<Watcher>,
    watches: [SignWatch; RULES.len()],
    found: Vec<Finding>,
    thrust_over_weight: Option<f64>,
}

impl Default for Findings {
    fn default() -> Self {
        let watches = [SignWatch::default(); RULES.len()];
        Self { watcher: None, watches, found: Vec::new(), thrust_over_weight: None }
    }
}

impl Findings {
    /// Thrust over weight when a foot first touched the ground in the landing burn.
    pub fn thrust_over_weight_at_contact(&self) -> Option<f64> {
        self.thrust_over_weight
    }

    /// Looks at the computer after a frame.
    pub fn note(&mut self, computer: &Computer) {
        let Some((flown, estimate)) = computer.flown().zip(computer.pilot().estimate()) else { return };
        let watcher = self.watcher.get_or_insert_with(|| Watcher::new(computer, &flown));
        watcher.take(computer, &flown, estimate);
        if flown.contact && computer.pilot().ignited_at_s().is_some() && self.thrust_over_weight.is_none() {
            let (thrust_n, weight_n) = computer.pilot().thrust_and_weight_n(flown.time_s);
            self.thrust_over_weight = Some(thrust_n / weight_n);
        }
        for ((sign, lasts_s), watch) in RULES.into_iter().zip(&mut self.watches) {
            let Some(seen) = watcher.seen(sign, computer, &flown, estimate) else {
                watch.since_s = None;
                continue;
            };
            let since_s = *watch.since_s.get_or_insert(seen.since_s);
            // A multiple of the frame is not exact.
            if flown.time_s - since_s < lasts_s - 0.5 * FRAME_S {
                continue;
            }
            let &mut place = watch.found.get_or_insert_with(|| {
                let Hit { value, beside, detail, .. } = seen;
                let gave_up = computer.pilot().gave_up().filter(|_| sign == Sign::Gate);
                let detail = gave_up.unwrap_or(detail).to_string();
                self.found.push(Finding {
                    sign,
                    since_s,
                    held_s: flown.time_s - since_s,
                    value,
                    beside,
                    detail,
                    follows: false,
                });
                self.found.len() - 1
            });
            let finding = &mut self.found[place];
            finding.held_s += FRAME_S;
            if matches!(sign, Sign::Surface(_)) && finding.detail != seen.detail {
                finding.detail = seen.detail.to_string();
            }
            if seen.size > watch.worst {
                watch.worst = seen.size;
                (finding.value, finding.beside) = (seen.value, seen.beside);
            }
        }
    }

    /// The findings so far, in order of detection: an index stays valid.
    pub fn as_found(&self) -> &[Finding] {
        &self.found
    }

    /// The findings so far: causes, then what follows from them, each in order of time.
    pub fn found(&self) -> Vec<Finding> {
        let mut found = self.found.clone();
        found.sort_by(|a, b| a.since_s.total_cmp(&b.since_s).then(a.sign.cmp(&b.sign)));
        for place in 0..found.len() {
            let at = &found[place];
            let explains = |other: &Finding| {
                let in_time = other.since_s <= at.since_s || at.sign.of_motor() && other.sign.is_inertial();
                in_time && at.sign.follows_from(other.sign, other.since_s < at.since_s)
            };
            found[place].follows = found.iter().any(explains);
        }
        found.sort_by_key(|finding| finding.follows);
        found
    }
}

impl Sign {
    /// Whether it is the motor's, whose measurement needs an intact inertial unit.
    fn of_motor(self) -> bool {
        matches!(self, Self::LateLight | Self::Impulse | Self::BurntOutEarly | Self::Latched)
    }

    fn is_inertial(self) -> bool {
        use Sign::{Implausible, Jumps, Repeats};
        matches!(
            self,
            Implausible(ACCELEROMETER | GYRO) | Repeats(ACCELEROMETER | GYRO) | Jumps(ACCELEROMETER | GYRO)
        )
    }

    /// Whether another sign, which began `earlier` or in the same frame, explains this one.
    fn follows_from(self, other: Self, earlier: bool) -> bool {
        use Sign::{
            Battery, Estimate, Gate, Implausible, Jumps, NoPlan, Repeats, Restart, Separation, Tumbles,
        };
        let is_effect = |sign| matches!(sign, Estimate | NoPlan | Tumbles | Gate);
        match other {
            // What the computer did not measure is missing in every estimate from then on.
            Restart => !matches!(self, Restart | Self::Surface(_) | Battery),
            inertial if inertial.is_inertial() => {
                let independent =
                    matches!(self, Restart | Battery | Separation | Implausible(_) | Repeats(_));
                self.of_motor() || is_effect(self) || earlier && !independent
            }
            Self::Apart => is_effect(self) || self.of_motor(),
            Self::Surface(_) | Self::SlowGimbal => {
                is_effect(self) || self.of_motor() || matches!(self, Jumps(_) | Self::Apart)
            }
            other => is_effect(self) && !is_effect(other),
        }
    }
}

/// The sensors by their index in [`SENSORS`].
const ACCELEROMETER: u8 = 0;
const GYRO: u8 = 1;
const BAROMETER: u8 = 2;
const GNSS: u8 = 3;
const LIDAR: u8 = 4;

fn name_of(sensor: u8) -> &'static str {
    SENSORS.get(usize::from(sensor)).unwrap_or(&"sensor")
}

/// The same time if the last fix came before the end of the boost, s: none of three receivers holds
/// its fix in a boost.
const GNSS_LOST_IN_BOOST_S: f64 = 6.0;
/// Range in which the lidar must measure: from this slant range, m, down to the dust, with its beam
/// leaning less than 40 deg.
const LIDAR_SEES_M: [f64; 2] = [3.0, 7.0];
const LIDAR_COS_TILT: f64 = 0.766;
/// Tilt beyond which the attitude is off-nominal (60 deg): no plan leans so far.
const ASTRAY_COS_TILT: f64 = 0.5;
/// Deviation of a gimbal and of a fin from their modelled positions beyond which they do not
/// follow, rad. Feedback, play and half a frame of unknown delay amount to 1 deg for a gimbal; the
/// fin feedback is coarser.
const AWAY_RAD: [f64; 2] = [0.035, 0.14];
/// Share of its servo's rate that a slow gimbal never reaches in the frames that demand more. A
/// healthy one reaches at least 0.6 (388 flights of mk2 and mk3 in `real`).
const SLOW: f64 = 0.55;
const SLOW_FRAMES: u32 = 40;
/// Voltage at which common 5 V regulators drop out, V.
const BATTERY_LOW_V: f64 = 6.6;
/// Share of the ascent motor's certified impulse below which it is weak.
const ASCENT_WEAK: f64 = 0.8;
/// Time in which a parachute fills, s, and the largest descent rate under it, m/s.
const CHUTE_FILLS_S: f64 = 4.0;
const CHUTE_CARRIES_M_S: f64 = 15.0;
/// Ignition delay beyond the mission's that no recorded motor has exceeded, s.
const LATE_S: f64 = 0.3;
/// Longest duration of an impact in the accelerometer, s.
const SHOCK_S: f64 = 0.1;
/// Deviation of the impulse that no motor of this type shows, standard deviations of the prior.
const IMPULSE_SIGMAS: f64 = 3.0;
/// Uncertainty of the end of a tail-off, s.
const EARLY_S: f64 = 0.3;
/// Largest normal difference between the barometer and the other heights, m: 3 m from exhaust
/// pressure, and a slow offset.
const HEIGHTS_APART_M: f64 = 6.0;
/// Height below which a plan ends, m.
const PLANS_ABOVE_M: f64 = 2.0;

/// Changes from one sample to the next that no motion makes: a quarter to a half more than the
/// largest of 90 flights of three missions in `real` that stand. The gyro's in the burn is larger.
const JUMP: [f64; SENSORS.len()] = [3.6, 8.0, 4.0, 10.0, 1.0];
const JUMP_UNITS: [&str; SENSORS.len()] = ["m/s2", "deg/s", "m", "m", "m"];
const GYRO_JUMP_IN_BURN_DEG_S: f64 = 20.0;
/// Height below which legs touch the ground, m.
const LEGS_M: f64 = 1.0;
/// Longest time between two samples that are compared, s: inertial unit, barometer and lidar; GNSS.
const NEXT_SAMPLE_S: f64 = 0.1;
const NEXT_FIX_S: f64 = 0.5;
/// Jumping ranges, each of which counts 0.9 after the next one, beyond which it is no outlier.
const JUMPING_RANGES: f64 = 4.0;
/// Fixes in a row at another position that are no outlier.
const MOVED_FIXES: u32 = 3;
/// Change of the velocity of GNSS from one fix to the next beyond that of the inertial unit, m/s;
/// the same over this number of fixes. Largest of the same flights: 1.1 and 1.5.
const GNSS_JUMP_M_S: f64 = 1.35;
const APART_FIXES: usize = 4;
const APART_M_S: f64 = 2.0;
/// Number of frames for which the inertial velocity is stored: a fix is not older.
const HISTORY: usize = 64;
/// Time without a plausible inertial sample, s.
const IMPLAUSIBLE_S: f64 = 0.02;
/// Number of deviating frames from which on a surface's motion is explained, and the share of the
/// deviation that the explanation leaves.
const EXPLAINED_FRAMES: u32 = 12;
const EXPLAINED_SHARE: f64 = 0.3;
/// Explanations of a surface's motion: it follows another surface's command, or its own mirrored.
const FOLLOWS: [&str; SURFACES + 3] = [
    ": takes gimbal pitch's commands",
    ": takes gimbal yaw's commands",
    ": takes fin 1's commands",
    ": takes fin 2's commands",
    ": takes fin 3's commands",
    ": takes fin 4's commands",
    ": moves the wrong way",
    ": does not move",
    ": too slow",
];
const MIRRORED: usize = SURFACES;
const HELD: usize = SURFACES + 1;
const LAGS: usize = SURFACES + 2;

/// How a surface moves while it does not follow its commands.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    frames: u32,
    /// Sums of the squared deviations from each surface's modelled position, and from its own
    /// mirrored, rad^2.
    off_rad2: [f64; SURFACES + 1],
    /// Smallest and largest measured angle, rad.
    span_rad: Option<[f64; 2]>,
    last_rad: f64,
    /// Turned towards its commands, and altogether, rad.
    turned_rad: [f64; 2],
}

impl Motion {
    fn explained(&self, own: usize) -> &'static str {
        if self.frames < EXPLAINED_FRAMES {
            return "";
        }
        let limit = EXPLAINED_SHARE * EXPLAINED_SHARE * self.off_rad2[own];
        let best = (0..=MIRRORED).filter(|place| *place != own && self.off_rad2[*place] < limit);
        let best = best.min_by(|a, b| self.off_rad2[*a].total_cmp(&self.off_rad2[*b]));
        let width_rad = self.span_rad.map_or(0.0, |[low, high]| high - low);
        let is_held = width_rad < 0.5 * AWAY_RAD[usize::from(own >= GIMBALS)];
        let [towards_rad, all_rad] = self.turned_rad;
        let held = is_held.then_some(HELD);
        held.or(best).or((towards_rad > 0.8 * all_rad).then_some(LAGS)).map_or("", |place| FOLLOWS[place])
    }
}

/// Steps of the sensors that the estimated motion does not explain.
#[derive(Debug, Clone)]
struct Steps {
    imu: Option<ImuSample>,
    /// Changes of the last three inertial samples, the newest last: across the nose, m/s^2, where
    /// no motor acts, and the rotation, deg/s.
    changes: [[f64; 5]; 3],
    pressure_m: Option<(f64, f64)>,
    range_m: Option<(f64, f64)>,
    jumping_ranges: f64,
    /// Velocity gained by the inertial unit since the first frame, m/s; the same of the last
    /// frames.
    gained_m_s: Vector3<f64>,
    history_m_s: [Vector3<f64>; HISTORY],
    fix: Option<(GnssFix, Vector3<f64>)>,
    /// Sum of the motion of the fixes beyond their velocities, m, which is forgotten.
    moved_m: Vector3<f64>,
    moved_fixes: u32,
    /// Changes of the velocity of GNSS beyond that of the inertial unit, m/s, the newest last, and
    /// the times of their fixes, s.
    apart_m_s: [Vector3<f64>; APART_FIXES],
    fixed_at_s: [f64; APART_FIXES],
    /// Frames taken.
    frames: usize,
    /// Step of each sensor in this frame, with its time, s, and unit; and that of [`Sign::Apart`].
    found: [Option<(f64, f64, &'static str)>; SENSORS.len() + 1],
}

impl Default for Steps {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self {
            imu: None,
            changes: [[0.0; 5]; 3],
            pressure_m: None,
            range_m: None,
            jumping_ranges: 0.0,
            gained_m_s: zero,
            history_m_s: [zero; HISTORY],
            fix: None,
            moved_m: zero,
            moved_fixes: 0,
            apart_m_s: [zero; APART_FIXES],
            fixed_at_s: [0.0; APART_FIXES],
            frames: 0,
            found: [None; SENSORS.len() + 1],
        }
    }
}

impl Steps {
    /// Takes a frame. Steps of an ascent are not counted: shocks and a coarse attitude make some.
    fn take(&mut self, flown: &SensedInput, estimate: &Estimate, phase: Phase, sees_ground: bool) {
        let (measured, time_s) = (&flown.measured, flown.time_s);
        let climb_m_s = estimate.state.velocity_m_s.z;
        self.found = [None; SENSORS.len() + 1];
        let mut find = |sensor: usize, step: f64, at_s: f64| {
            self.found[sensor] = (step.abs() > JUMP[sensor]).then_some((step, at_s, JUMP_UNITS[sensor]));
        };
        let force_m_s2 = measured.imu.specific_force_m_s2;
        if let Some(before) = self.imu.replace(measured.imu) {
            let force = force_m_s2 - before.specific_force_m_s2;
            let turn = (measured.imu.gyro_rad_s - before.gyro_rad_s).map(f64::to_degrees);
            self.changes.rotate_left(1);
            self.changes[2] = [force.y, force.z, turn.x, turn.y, turn.z].map(f64::abs);
            let [before, now, after] = self.changes;
            // A motion goes on; a step is alone.
            let alone: [f64; 5] =
                core::array::from_fn(|axis| (now[axis] - before[axis] - after[axis]).max(0.0));
            find(usize::from(ACCELEROMETER), alone[0].max(alone[1]), time_s - FRAME_S);
            let turned = alone[2].max(alone[3]).max(alone[4]);
            if !phase.in_landing_burn() || turned > GYRO_JUMP_IN_BURN_DEG_S {
                find(usize::from(GYRO), turned, time_s - FRAME_S);
            }
        }
        let step = |last: &mut Option<(f64, f64)>, now_m: f64, rate_m_s: f64| {
            let (before_m, before_s) = last.replace((now_m, time_s))?;
            let passed_s = time_s - before_s;
            (passed_s < NEXT_SAMPLE_S).then_some(now_m - before_m - rate_m_s * passed_s)
        };
        if let Some(now_m) = measured.pressure_altitude_m
            && let Some(jump_m) = step(&mut self.pressure_m, now_m, climb_m_s)
        {
            find(usize::from(BAROMETER), jump_m, time_s);
        }
        if let Some(now_m) = measured.lidar_range_m.filter(|_| sees_ground)
            && let Some(jump_m) = step(&mut self.range_m, now_m, climb_m_s / estimate.state.nose_in_world().z)
        {
            let jumps = jump_m.abs() > JUMP[usize::from(LIDAR)];
            self.jumping_ranges = 0.9 * self.jumping_ranges + f64::from(u8::from(jumps));
            if self.jumping_ranges > JUMPING_RANGES {
                find(usize::from(LIDAR), jump_m, time_s);
            }
        }
        if !measured.imu.is_plausible() {
            // What was gained is unknown: the fixes begin again.
            self.frames = 0;
            return;
        }
        self.gained_m_s +=
            (estimate.state.world_from_body * force_m_s2 - Vector3::z() * GRAVITY_M_S2) * FRAME_S;
        self.history_m_s.rotate_left(1);
        self.history_m_s[HISTORY - 1] = self.gained_m_s;
        self.frames += 1;
        if let Some(fix) = measured.gnss {
            self.take_fix(fix, time_s);
        }
        if !(phase.in_descent() || phase.in_landing_burn()) {
            self.found = [None; SENSORS.len() + 1];
            (self.moved_m, self.apart_m_s) = (Vector3::zeros(), [Vector3::zeros(); APART_FIXES]);
        }
    }

    fn take_fix(&mut self, fix: GnssFix, time_s: f64) {
        let frames = libm::round((time_s - fix.valid_at_s) / FRAME_S).max(0.0) as usize;
        let repeats = self.fix.is_some_and(|(before, _)| before.position_m == fix.position_m);
        if frames >= self.frames.min(HISTORY) || repeats {
            (self.fix, self.fixed_at_s) = (None, [0.0; APART_FIXES]);
            return;
        }
        let gained_m_s = self.history_m_s[HISTORY - 1 - frames];
        let Some((before, before_m_s)) = self.fix.replace((fix, gained_m_s)) else { return };
        let passed_s = fix.valid_at_s - before.valid_at_s;
        if !(0.0..NEXT_FIX_S).contains(&passed_s) || passed_s <= 0.0 {
            return;
        }
        let mean_m_s = 0.5 * (fix.velocity_m_s + before.velocity_m_s);
        self.moved_m = 0.9 * self.moved_m + fix.position_m - before.position_m - mean_m_s * passed_s;
        let moved_m = self.moved_m.norm();
        self.moved_fixes = if moved_m > JUMP[usize::from(GNSS)] { self.moved_fixes + 1 } else { 0 };
        self.apart_m_s.rotate_left(1);
        self.fixed_at_s.rotate_left(1);
        let last = APART_FIXES - 1;
        self.apart_m_s[last] = fix.velocity_m_s - before.velocity_m_s - (gained_m_s - before_m_s);
        self.fixed_at_s[last] = time_s;
        // Steps at once, and goes on: the inertial unit. Steps once: GNSS.
        let [_, first, second, third] = &self.apart_m_s;
        let goes_on = |next: &Vector3<f64>| next.dot(first) > 0.5 * first.norm_squared();
        let (gnss, apart) = (usize::from(GNSS), SENSORS.len());
        if first.norm() > GNSS_JUMP_M_S && self.fixed_at_s[1] > 0.0 {
            let of = if goes_on(second) && goes_on(third) { apart } else { gnss };
            self.found[of] = Some((first.norm(), self.fixed_at_s[1], "m/s"));
        }
        if self.moved_fixes >= MOVED_FIXES {
            self.found[gnss] = Some((moved_m, self.fixed_at_s[last + 1 - MOVED_FIXES as usize], "m"));
        }
        let sum_m_s = self.apart_m_s.iter().sum::<Vector3<f64>>().norm();
        let largest_m_s = self.apart_m_s.iter().map(Vector3::norm).fold(0.0, f64::max);
        let all = self.fixed_at_s[0] > 0.0;
        if all && sum_m_s > APART_M_S && largest_m_s < 0.5 * sum_m_s {
            self.found[apart] = Some((sum_m_s, self.fixed_at_s[1], "m/s"));
        }
    }
}

/// Memory of the rules from earlier frames.
#[derive(Debug, Clone)]
struct Watcher {
    frame: u64,
    /// Frames that are missing before this one.
    missing: u64,
    /// Satellites were received after the boost.
    gnss_since_boost: bool,
    /// The barometer's last altitude, m.
    pressure_m: Option<f64>,
    surfaces: [ServoModel; SURFACES],
    motions: [Motion; SURFACES],
    steps: Steps,
    /// Gimbal angles in the frame before, rad.
    gimbal_rad: [f64; 2],
    /// In the burn: the number of frames in which each axis had to turn fast, and the largest turn
    /// in one frame, rad.
    turns: [(u32, f64); 2],
    /// Specific force along the nose over the boost, m/s.
    boost_m_s: f64,
    ejected_s: Option<f64>,
    /// Time at which the separation charge was fired.
    parted_s: Option<f64>,
    /// Time since when the lidar must measure, s.
    must_see_s: Option<f64>,
    /// The attitude was off-nominal in the burn: from then on the axial force says little about the
    /// motor.
    astray: bool,
    /// A foot has touched the ground: later signs are not part of the flight.
    down: bool,
}

impl Watcher {
    fn new(computer: &Computer, flown: &SensedInput) -> Self {
        let airframe = &computer.pilot().mission().airframe;
        Self {
            frame: flown.frame.saturating_sub(1),
            missing: 0,
            gnss_since_boost: false,
            pressure_m: None,
            surfaces: ServoModel::of_each(airframe, surfaces_rad(flown.gimbal_rad, flown.fins_rad)),
            motions: [Motion::default(); SURFACES],
            steps: Steps::default(),
            gimbal_rad: flown.gimbal_rad,
            turns: [(0, 0.0); 2],
            boost_m_s: 0.0,
            ejected_s: None,
            parted_s: None,
            must_see_s: None,
            astray: false,
            down: false,
        }
    }

    fn take(&mut self, computer: &Computer, flown: &SensedInput, estimate: &Estimate) {
        self.missing = flown.frame.saturating_sub(self.frame + 1);
        self.frame = flown.frame;
        let (time_s, phase) = (flown.time_s, computer.mode().phase);
        if self.missing > 0 {
            // Commands and measurements of missing frames are not available.
            let at_rad = surfaces_rad(flown.gimbal_rad, flown.fins_rad);
            self.surfaces = ServoModel::of_each(&computer.pilot().mission().airframe, at_rad);
            self.gimbal_rad = flown.gimbal_rad;
            self.steps = Steps::default();
        }
        self.pressure_m = flown.measured.pressure_altitude_m.or(self.pressure_m);
        if flown.measured.gnss.is_some() {
            self.gnss_since_boost = phase != Phase::Boost;
        }
        if phase == Phase::Boost {
            self.boost_m_s += flown.measured.imu.specific_force_m_s2.x * FRAME_S;
        }
        let commands = computer.commands();
        let told_rad = surfaces_rad(commands.gimbal_rad, commands.fins_rad);
        let before_rad = self.surfaces.each_ref().map(|servo| servo.at_rad);
        for (servo, command_rad) in self.surfaces.iter_mut().zip(told_rad) {
            servo.advance();
            servo.take(command_rad);
        }
        self.take_motions(computer, flown);
        let slow_rad = SLOW * computer.pilot().mission().airframe.gimbal.servo.rate_rad_s() * FRAME_S;
        for axis in (0..GIMBALS).filter(|_| phase == Phase::Powered && !self.down) {
            let (frames, turned_rad) = &mut self.turns[axis];
            *frames += u32::from((self.surfaces[axis].at_rad - before_rad[axis]).abs() > slow_rad);
            *turned_rad = turned_rad.max((flown.gimbal_rad[axis] - self.gimbal_rad[axis]).abs());
        }
        self.gimbal_rad = flown.gimbal_rad;
        for (output, since_s) in
            [(PyroOutput::Parachute, &mut self.ejected_s), (PyroOutput::Separation, &mut self.parted_s)]
        {
            if commands.outputs.is_on(output) {
                since_s.get_or_insert(time_s);
            }
        }
        let nose_up = estimate.state.nose_in_world().z;
        let near = estimate.state.position_m.z <= LIDAR_SEES_M[1] * nose_up && nose_up > LIDAR_COS_TILT;
        self.down |= flown.contact && !phase.before_apogee();
        self.astray |= phase.in_landing_burn() && nose_up < ASTRAY_COS_TILT;
        self.must_see_s = if near { self.must_see_s.or(Some(time_s)) } else { None };
        self.steps.take(flown, estimate, phase, near);
    }

    /// Compares surfaces that do not follow their commands with what would explain it.
    fn take_motions(&mut self, computer: &Computer, flown: &SensedInput) {
        let fins = &computer.pilot().mission().airframe.fins;
        let both_stops_rad = fins.closed_rad() + fins.open_rad();
        let measured_rad = surfaces_rad(flown.gimbal_rad, flown.fins_rad);
        let model_rad = self.surfaces.each_ref().map(|servo| servo.at_rad);
        for (own, (motion, at_rad)) in self.motions.iter_mut().zip(measured_rad).enumerate() {
            let is_fin = own >= GIMBALS;
            let off_rad = at_rad - model_rad[own];
            if off_rad.abs() <= AWAY_RAD[usize::from(is_fin)] {
                continue;
            }
            let mirrored_rad = if is_fin { both_stops_rad - model_rad[own] } else { -model_rad[own] };
            for (sum_rad2, expected_rad) in
                motion.off_rad2.iter_mut().zip(model_rad.into_iter().chain([mirrored_rad]))
            {
                *sum_rad2 += (at_rad - expected_rad) * (at_rad - expected_rad);
            }
            if let Some([low_rad, high_rad]) = motion.span_rad {
                let turned_rad = at_rad - motion.last_rad;
                motion.turned_rad[0] += if turned_rad * off_rad < 0.0 { turned_rad.abs() } else { 0.0 };
                motion.turned_rad[1] += turned_rad.abs();
                motion.span_rad = Some([low_rad.min(at_rad), high_rad.max(at_rad)]);
            } else {
                motion.span_rad = Some([at_rad; 2]);
            }
            motion.last_rad = at_rad;
            motion.frames += 1;
        }
    }

    /// Whether a sign shows in this frame.
    fn seen(&self, sign: Sign, computer: &Computer, last: &SensedInput, estimate: &Estimate) -> Option<Hit> {
        let (phase, time_s) = (computer.mode().phase, last.time_s);
        let pilot = computer.pilot();
        let mission = pilot.mission();
        let in_air = !phase.on_pad() && !matches!(phase, Phase::Touchdown | Phase::Safed) && !self.down;
        let now = |value: f64, beside| Hit { since_s: time_s, size: value, value, beside, detail: "" };
        let [barometer_s, gnss_s, _] = computer.sensors().silent_s();
        let silent = |silent_s: f64, longest_s: f64| {
            (in_air && silent_s > longest_s)
                .then_some(Hit { since_s: time_s - silent_s, ..now(silent_s, 0.0) })
        };
        match sign {
            Sign::Restart => {
                let away_s = self.missing as f64 * FRAME_S;
                (in_air && self.missing > 1).then(|| Hit { since_s: time_s - away_s, ..now(away_s, 0.0) })
            }
            Sign::Gnss => {
                let climbs = phase == Phase::Boost || !self.gnss_since_boost && mission.launch.is_some();
                silent(gnss_s, if climbs { GNSS_LOST_IN_BOOST_S } else { GNSS_LOST_S })
            }
            Sign::Barometer => silent(barometer_s, BAROMETER_LOST_S),
            Sign::Gate | Sign::Latched => {
                let detail = latched(computer.latch()?, sign)?;
                Some(Hit { detail, ..now(0.0, 0.0) })
            }
            _ if in_air => seen_in_flight(self, sign, computer, last, estimate),
            _ => None,
        }
    }
}

/// A sign that only a vehicle in the air has.
fn seen_in_flight(
    watcher: &Watcher,
    sign: Sign,
    computer: &Computer,
    flown: &SensedInput,
    estimate: &Estimate,
) -> Option<Hit> {
    let (pilot, mode, time_s) = (computer.pilot(), computer.mode(), flown.time_s);
    let (mission, motor) = (pilot.mission(), pilot.motor());
    let burns = mode.phase == Phase::Powered;
    let tilt_rad = libm::acos(estimate.state.nose_in_world().z.clamp(-1.0, 1.0));
    let height_m = estimate.state.position_m.z;
    let seen = |since_s, value: f64, beside, detail| Hit { since_s, size: value, value, beside, detail };
    let now = |value, beside| seen(time_s, value, beside, "");
    match sign {
        Sign::Lidar => {
            let [low_m, high_m] = LIDAR_SEES_M;
            let falls = mode.phase.in_descent() || mode.phase.in_landing_burn();
            let must_see_s = watcher.must_see_s.filter(|_| falls && height_m >= low_m)?;
            let [_, _, lidar_s] = computer.sensors().silent_s();
            let silent_s = lidar_s.min(time_s - must_see_s);
            (silent_s > LIDAR_LOST_S).then(|| seen(time_s - silent_s, silent_s, high_m, ""))
        }
        Sign::Implausible(sensor) => {
            let [silent_s, _] = computer.sensors().lost_s()[usize::from(sensor)];
            (silent_s > IMPLAUSIBLE_S).then(|| seen(time_s - silent_s, silent_s, 0.0, ""))
        }
        Sign::Repeats(sensor) => {
            let [_, repeats_s] = computer.sensors().lost_s()[usize::from(sensor)];
            (repeats_s > 0.0).then(|| seen(time_s - repeats_s, repeats_s, 0.0, ""))
        }
        Sign::Jumps(_) | Sign::Apart if height_m < LEGS_M => None,
        Sign::Jumps(sensor) => {
            let (jump, at_s, unit) = watcher.steps.found[usize::from(sensor)]?;
            Some(Hit { size: jump.abs(), ..seen(at_s, jump, 0.0, unit) })
        }
        Sign::Apart => {
            let (apart_m_s, at_s, _) = watcher.steps.found[SENSORS.len()]?;
            Some(seen(at_s, apart_m_s, 0.0, ""))
        }
        Sign::RangesDisagree => {
            let (range_m, measured_s) = watcher.steps.range_m.filter(|_| watcher.must_see_s.is_some())?;
            let range_height_m = range_m * estimate.state.nose_in_world().z;
            (time_s - measured_s < NEXT_SAMPLE_S && pilot.estimator().others_contradict_m(range_height_m))
                .then(|| now((range_height_m - height_m).abs(), 0.0))
        }
        Sign::HeightsDisagree => {
            let falls = mode.phase.in_descent() || mode.phase.in_landing_burn();
            // A rejected barometer is no longer a source of heights.
            let apart_m = (estimate.heights.disagreement_m())
                .or_else(|| Some((watcher.pressure_m? - height_m).abs()))
                .filter(|_| falls)?;
            (apart_m > HEIGHTS_APART_M).then(|| now(apart_m, 0.0))
        }
        Sign::Estimate => match estimate.health {
            Health::Unhealthy(issue) if mode.phase.is_landing() => Some(seen(time_s, 0.0, 0.0, issue.name())),
            _ => None,
        },
        Sign::Surface(surface) => {
            let surface = usize::from(surface);
            let at_rad = surfaces_rad(flown.gimbal_rad, flown.fins_rad)[surface];
            let away_rad = (at_rad - watcher.surfaces[surface].at_rad).abs();
            (away_rad > AWAY_RAD[usize::from(surface >= GIMBALS)]).then(|| Hit {
                detail: watcher.motions[surface].explained(surface),
                ..now(away_rad.to_degrees(), at_rad.to_degrees())
            })
        }
        Sign::SlowGimbal => {
            let servo = &mission.airframe.gimbal.servo;
            let turns = watcher.turns.iter().filter(|(frames, _)| *frames >= SLOW_FRAMES);
            let rate_rad_s = turns.map(|(_, turned_rad)| turned_rad / FRAME_S).reduce(f64::min)?;
            (rate_rad_s < SLOW * servo.rate_rad_s()).then(|| now(rate_rad_s.to_degrees(), servo.rate_deg_s))
        }
        Sign::Battery => {
            let volts = flown.battery_v.filter(|volts| *volts < BATTERY_LOW_V)?;
            Some(Hit { size: BATTERY_LOW_V - volts, ..now(volts, BATTERY_LOW_V) })
        }
        Sign::AscentMotor => {
            let booster = &mission.launch.as_ref()?.booster;
            let burnt_kg = 0.5 * booster.motor_curve.propellant_mass_kg();
            let mass_kg = mission.airframe.mass.loaded_kg + booster.dry_kg + burnt_kg;
            let share = watcher.boost_m_s * mass_kg / booster.motor_curve.total_impulse_n_s();
            let sensed = mode.phase == Phase::Coast;
            (sensed && share < ASCENT_WEAK).then(|| now(share, 1.0))
        }
        Sign::Separation => (flown.booster_attached && watcher.parted_s.is_some()).then(|| now(1.0, 0.0)),
        Sign::Parachute => {
            let sinks_m_s = -estimate.state.velocity_m_s.z;
            let since_s = watcher.ejected_s? + CHUTE_FILLS_S;
            (time_s > since_s && sinks_m_s > CHUTE_CARRIES_M_S).then(|| now(sinks_m_s, CHUTE_CARRIES_M_S))
        }
        Sign::LateLight => {
            // The shock of an impact is shorter than any burn.
            let took_s =
                motor.ignition_s().filter(|lit_s| time_s - lit_s > SHOCK_S)? - pilot.ignited_at_s()?;
            let known_s = mission.ignition.delay_s;
            (took_s > known_s + LATE_S)
                .then(|| seen(pilot.ignited_at_s().unwrap_or(time_s), took_s, known_s, ""))
        }
        Sign::Impulse => {
            let sigma = motor.sigmas()[0];
            let impulse = pilot.motor().impulse_scale();
            let off = (impulse - 1.0).abs();
            let known = burns
                && !watcher.astray
                && off > IMPULSE_SIGMAS * mission.motor.impulse_sigma
                && off > 2.0 * sigma;
            let lit_s = motor.ignition_s().unwrap_or(time_s);
            known.then(|| Hit { size: off, ..seen(lit_s, impulse, 1.0, "") })
        }
        Sign::BurntOutEarly => {
            let MotorStage::EndedEarly { at_s } = motor.stage() else { return None };
            let ends_s =
                motor.ignition_s()? + motor.burn_time_stretch() * pilot.mission().motor_curve.burn_time_s();
            (ends_s - at_s > EARLY_S).then(|| seen(at_s, ends_s - at_s, 0.0, ""))
        }
        Sign::NoPlan => {
            let none = computer.level() == ControlLevel::Stabiliser;
            (burns && none && height_m > PLANS_ABOVE_M).then(|| now(1.0, 0.0))
        }
        Sign::Tumbles => {
            (burns && tilt_rad > core::f64::consts::FRAC_PI_2).then(|| now(tilt_rad.to_degrees(), 90.0))
        }
        Sign::Restart | Sign::Gnss | Sign::Barometer | Sign::Gate | Sign::Latched => None,
    }
}

/// The latch as text; the pilot has the reason for an abandoned landing.
fn latched(latch: Latch, sign: Sign) -> Option<&'static str> {
    let words = match latch {
        Latch::Gate => "",
        Latch::Commanded => "abort of the crew",
        Latch::UncommandedLiftOff => "lifted off unarmed",
        Latch::UncommandedRelease => "released without clearance",
        Latch::NoSeparation => "abort: the booster stayed on",
        Latch::NoLight => "landing motor did not light in time",
        Latch::Other => "ascent motor did not lift the vehicle off",
    };
    ((latch == Latch::Gate) == (sign == Sign::Gate)).then_some(words)
}
