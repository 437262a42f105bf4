//! Faults detected in flight from the computer's data, in order of time, each with the numbers that
//! support it.
//!
//! [`Findings::note`] examines the computer after each frame. Nothing on board depends on it: the
//! vehicle sends the findings, and a report begins with them. Simulated truth is not used, because
//! a real flight has none.
//!
//! Each [`Sign`] has one rule, in [`Watcher::seen`].

use alloc::borrow::{Cow, ToOwned as _};
use alloc::collections::{BTreeMap, VecDeque};
use alloc::format;
use alloc::string::{String, ToString as _};
use alloc::vec::Vec;

use nalgebra::Vector3;

use super::events::FlightEvents;
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
    pub detail: Cow<'static, str>,
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
            Sign::Lidar => format!("lidar silent from {:.0} m down", LIDAR_SEES_M[1]),
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
            Sign::Latched => detail.to_string(),
        }
    }

    fn severity(&self) -> f64 {
        match self.sign {
            Sign::Battery | Sign::Impulse => (self.value - self.beside).abs(),
            _ => self.value.abs(),
        }
    }
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
#[derive(Debug, Clone, Default)]
pub struct Findings {
    watcher: Watcher,
    watches: BTreeMap<Sign, SignWatch>,
    found: Vec<Finding>,
    thrust_over_weight: Option<f64>,
    /// The events of the flight so far.
    pub events: FlightEvents,
}

impl Findings {
    /// Thrust over weight when a foot first touched the ground in the landing burn.
    pub fn thrust_over_weight_at_contact(&self) -> Option<f64> {
        self.thrust_over_weight
    }

    /// Looks at the computer after a frame.
    pub fn note(&mut self, computer: &Computer) {
        let Some((flown, estimate)) = computer.flown().zip(computer.pilot().estimate()) else { return };
        self.events.note(computer, &flown, estimate);
        self.watcher.take(computer, &flown, estimate);
        if flown.contact && computer.pilot().ignited_at_s().is_some() && self.thrust_over_weight.is_none() {
            let (thrust_n, weight_n) = computer.pilot().thrust_and_weight_n(flown.time_s);
            self.thrust_over_weight = Some(thrust_n / weight_n);
        }
        let seen = self.watcher.seen(computer, &flown, estimate);
        for (sign, watch) in &mut self.watches {
            watch.since_s = watch.since_s.filter(|_| seen.iter().any(|seen| seen.sign == *sign));
        }
        for mut seen in seen {
            let watch = self.watches.entry(seen.sign).or_default();
            seen.since_s = *watch.since_s.get_or_insert(seen.since_s);
            seen.held_s = flown.time_s - seen.since_s;
            // A multiple of the frame is not exact.
            if seen.held_s < seen.sign.lasts_s() - 0.5 * FRAME_S {
                continue;
            }
            let place = *watch.found.get_or_insert(self.found.len());
            if place == self.found.len() {
                self.found.push(seen.clone());
            }
            let finding = &mut self.found[place];
            finding.held_s += FRAME_S;
            if seen.severity() > watch.worst {
                watch.worst = seen.severity();
                (finding.value, finding.beside) = (seen.value, seen.beside);
            }
            if matches!(seen.sign, Sign::Surface(_)) {
                finding.detail = seen.detail;
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
    /// Time for which it must last to become a finding, s. Shorter signs are noise, a dropped
    /// sample or a gust.
    fn lasts_s(self) -> f64 {
        match self {
            Self::HeightsDisagree | Self::Separation | Self::NoPlan => 0.5,
            Self::Surface(fin) if usize::from(fin) >= GIMBALS => 0.3,
            Self::RangesDisagree | Self::Estimate | Self::Impulse => 0.2,
            Self::Surface(_) | Self::Battery => 0.1,
            Self::Tumbles => 0.05,
            _ => 0.0,
        }
    }

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
/// largest of 90 flights of three missions in `real` that stand. The gyro's in the burn is larger:
/// 20 in a landing of mk2.
const JUMP: [f64; SENSORS.len()] = [3.6, 8.0, 4.0, 10.0, 1.0];
const JUMP_UNITS: [&str; SENSORS.len()] = ["m/s2", "deg/s", "m", "m", "m"];
const GYRO_JUMP_IN_BURN_DEG_S: f64 = 25.0;
/// Height below which legs touch the ground, m.
pub(super) const LEGS_M: f64 = 1.0;
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
const FOLLOWS: [&str; SURFACES + 1] = [
    ": takes gimbal pitch's commands",
    ": takes gimbal yaw's commands",
    ": takes fin 1's commands",
    ": takes fin 2's commands",
    ": takes fin 3's commands",
    ": takes fin 4's commands",
    ": moves the wrong way",
];

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
        let best = (0..FOLLOWS.len()).filter(|place| *place != own && self.off_rad2[*place] < limit);
        let best = best.min_by(|a, b| self.off_rad2[*a].total_cmp(&self.off_rad2[*b]));
        let width_rad = self.span_rad.map_or(0.0, |[low, high]| high - low);
        let [towards_rad, all_rad] = self.turned_rad;
        if width_rad < 0.5 * AWAY_RAD[usize::from(own >= GIMBALS)] {
            ": does not move"
        } else if let Some(best) = best {
            FOLLOWS[best]
        } else if towards_rad > 0.8 * all_rad {
            ": too slow"
        } else {
            ""
        }
    }
}

/// Steps of the sensors that the estimated motion does not explain.
#[derive(Debug, Clone, Default)]
struct Steps {
    imu: Option<ImuSample>,
    /// Changes of the last three inertial samples, the newest last: across the nose, m/s^2, where
    /// no motor acts, and the rotation, deg/s.
    changes: [[f64; 5]; 3],
    pressure_m: Option<(f64, f64)>,
    range_m: Option<(f64, f64)>,
    jumping_ranges: f64,
    /// Velocity gained by the inertial unit since the first frame, m/s; the same of the last
    /// frames, the newest first.
    gained_m_s: Vector3<f64>,
    history_m_s: VecDeque<Vector3<f64>>,
    fix: Option<(GnssFix, Vector3<f64>)>,
    /// Sum of the motion of the fixes beyond their velocities, m, which is forgotten.
    moved_m: Vector3<f64>,
    moved_fixes: u32,
    /// Changes of the velocity of GNSS beyond that of the inertial unit, m/s, the newest last, and
    /// the times of their fixes, s.
    apart_m_s: [Vector3<f64>; APART_FIXES],
    fixed_at_s: [f64; APART_FIXES],
    /// Step of each sensor in this frame, with its time, s, and unit; and that of [`Sign::Apart`].
    found: [Option<(f64, f64, &'static str)>; SENSORS.len() + 1],
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
            self.history_m_s.clear();
            return;
        }
        self.gained_m_s +=
            (estimate.state.world_from_body * force_m_s2 - Vector3::z() * GRAVITY_M_S2) * FRAME_S;
        self.history_m_s.truncate(HISTORY - 1);
        self.history_m_s.push_front(self.gained_m_s);
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
        let Some(gained_m_s) = self.history_m_s.get(frames).copied().filter(|_| !repeats) else {
            (self.fix, self.fixed_at_s) = (None, [0.0; APART_FIXES]);
            return;
        };
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

/// Reports a sign of this frame: since when, s, its value and what it is compared with, and text.
type See<'a> = &'a mut dyn FnMut(Sign, f64, f64, f64, &'static str);

/// Memory of the rules from earlier frames.
#[derive(Debug, Clone, Default)]
struct Watcher {
    frame: Option<u64>,
    /// Frames that are missing before this one.
    missing: u64,
    /// Satellites were received after the boost.
    gnss_since_boost: bool,
    /// The barometer's last altitude, m.
    pressure_m: Option<f64>,
    surfaces: Option<[ServoModel; SURFACES]>,
    motions: [Motion; SURFACES],
    steps: Steps,
    /// Gimbal angles in the frame before, rad.
    gimbal_rad: Option<[f64; 2]>,
    /// In the burn: the number of frames in which each axis had to turn fast, and the largest turn
    /// in one frame, rad.
    turns: [(u32, f64); 2],
    /// Specific force along the nose over the boost, m/s.
    boost_m_s: f64,
    ejected_s: Option<f64>,
    /// The separation charge was fired.
    parted: bool,
    /// Time since when the lidar must measure, s.
    must_see_s: Option<f64>,
    /// The attitude was off-nominal in the burn: from then on the axial force says little about the
    /// motor.
    astray: bool,
    /// A foot has touched the ground: later signs are not part of the flight.
    down: bool,
}

impl Watcher {
    fn take(&mut self, computer: &Computer, flown: &SensedInput, estimate: &Estimate) {
        let before = self.frame.replace(flown.frame);
        self.missing = before.map_or(0, |before| flown.frame.saturating_sub(before + 1));
        let (time_s, phase) = (flown.time_s, computer.mode().phase);
        if self.missing > 0 {
            // Commands and measurements of missing frames are not available.
            (self.surfaces, self.gimbal_rad, self.steps) = (None, None, Steps::default());
        }
        self.pressure_m = flown.measured.pressure_altitude_m.or(self.pressure_m);
        if flown.measured.gnss.is_some() {
            self.gnss_since_boost = phase != Phase::Boost;
        }
        if phase == Phase::Boost {
            self.boost_m_s += flown.measured.imu.specific_force_m_s2.x * FRAME_S;
        }
        self.take_surfaces(computer, flown);
        let outputs = &computer.commands().outputs;
        self.parted |= outputs.is_on(PyroOutput::Separation);
        self.ejected_s = self.ejected_s.or(outputs.is_on(PyroOutput::Parachute).then_some(time_s));
        let nose_up = estimate.state.nose_in_world().z;
        let near = estimate.state.position_m.z <= LIDAR_SEES_M[1] * nose_up && nose_up > LIDAR_COS_TILT;
        self.down |= flown.contact && !phase.before_apogee();
        self.astray |= phase.in_landing_burn() && nose_up < ASTRAY_COS_TILT;
        self.must_see_s = if near { self.must_see_s.or(Some(time_s)) } else { None };
        self.steps.take(flown, estimate, phase, near);
    }

    /// Follows the surfaces' models, and compares surfaces that do not follow their commands with
    /// what would explain it.
    fn take_surfaces(&mut self, computer: &Computer, flown: &SensedInput) {
        let (airframe, commands) = (&computer.pilot().mission().airframe, computer.commands());
        let told_rad = surfaces_rad(commands.gimbal_rad, commands.fins_rad);
        let measured_rad = surfaces_rad(flown.gimbal_rad, flown.fins_rad);
        let servos = self.surfaces.get_or_insert_with(|| ServoModel::of_each(airframe, measured_rad));
        let before_rad = servos.each_ref().map(|servo| servo.at_rad);
        for (servo, command_rad) in servos.iter_mut().zip(told_rad) {
            servo.advance();
            servo.take(command_rad);
        }
        let model_rad = servos.each_ref().map(|servo| servo.at_rad);
        let slow_rad = SLOW * airframe.gimbal.servo.rate_rad_s() * FRAME_S;
        let gimbal_before_rad = self.gimbal_rad.replace(flown.gimbal_rad).unwrap_or(flown.gimbal_rad);
        for axis in (0..GIMBALS).filter(|_| computer.mode().phase == Phase::Powered && !self.down) {
            let (frames, turned_rad) = &mut self.turns[axis];
            *frames += u32::from((model_rad[axis] - before_rad[axis]).abs() > slow_rad);
            *turned_rad = turned_rad.max((flown.gimbal_rad[axis] - gimbal_before_rad[axis]).abs());
        }
        let both_stops_rad = airframe.fins.closed_rad() + airframe.fins.open_rad();
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

    /// The signs of this frame.
    fn seen(&self, computer: &Computer, flown: &SensedInput, estimate: &Estimate) -> Vec<Finding> {
        let phase = computer.mode().phase;
        let mut seen = Vec::new();
        let mut see = |sign, since_s, value, beside, detail: &'static str| {
            let detail = Cow::Borrowed(detail);
            seen.push(Finding { sign, since_s, held_s: 0.0, value, beside, detail, follows: false });
        };
        if !phase.on_pad() && !matches!(phase, Phase::Touchdown | Phase::Safed) && !self.down {
            self.see_sensors(computer, flown, estimate, &mut see);
            self.see_actuators(computer, flown, &mut see);
            self.see_motors(computer, flown, estimate, &mut see);
        }
        let gave_up = computer.pilot().gave_up();
        let latched = computer.latch().map(|latch| match latch {
            Latch::Gate => (Sign::Gate, ""),
            Latch::Commanded => (Sign::Latched, "abort of the crew"),
            Latch::UncommandedLiftOff => (Sign::Latched, "lifted off unarmed"),
            Latch::UncommandedRelease => (Sign::Latched, "released without clearance"),
            Latch::NoSeparation => (Sign::Latched, "abort: the booster stayed on"),
            Latch::NoLight => (Sign::Latched, "landing motor did not light in time"),
            Latch::Other => (Sign::Latched, "ascent motor did not lift the vehicle off"),
        });
        if let Some((sign, words)) = latched {
            see(sign, flown.time_s, 0.0, 0.0, words);
        }
        // The pilot has the reason for an abandoned landing.
        if let Some((finding, gave_up)) = seen.last_mut().filter(|last| last.sign == Sign::Gate).zip(gave_up)
        {
            finding.detail = Cow::Owned(gave_up.to_owned());
        }
        seen
    }

    fn see_sensors(&self, computer: &Computer, flown: &SensedInput, estimate: &Estimate, see: See<'_>) {
        let (pilot, sensors) = (computer.pilot(), computer.sensors());
        let (phase, time_s) = (computer.mode().phase, flown.time_s);
        let (height_m, nose_up) = (estimate.state.position_m.z, estimate.state.nose_in_world().z);
        let falls = phase.in_descent() || phase.in_landing_burn();
        let climbs = phase == Phase::Boost || !self.gnss_since_boost && pilot.mission().launch.is_some();
        let mut silent = |sign, silent_s: f64, longest_s: f64| {
            if silent_s > longest_s {
                see(sign, time_s - silent_s, silent_s, 0.0, "");
            }
        };
        let [barometer_s, gnss_s, lidar_s] = sensors.silent_s();
        silent(Sign::Restart, self.missing as f64 * FRAME_S, 1.5 * FRAME_S);
        silent(Sign::Gnss, gnss_s, if climbs { GNSS_LOST_IN_BOOST_S } else { GNSS_LOST_S });
        silent(Sign::Barometer, barometer_s, BAROMETER_LOST_S);
        if let Some(since_s) = self.must_see_s.filter(|_| falls && height_m >= LIDAR_SEES_M[0]) {
            silent(Sign::Lidar, lidar_s.min(time_s - since_s), LIDAR_LOST_S);
        }
        for (sensor, [silent_s, repeats_s]) in (ACCELEROMETER..).zip(sensors.lost_s()) {
            if sensor <= GYRO {
                silent(Sign::Implausible(sensor), silent_s, IMPLAUSIBLE_S);
            }
            silent(Sign::Repeats(sensor), repeats_s, 0.0);
        }
        for (sensor, step) in (ACCELEROMETER..).zip(self.steps.found) {
            if let Some((step, at_s, unit)) = step.filter(|_| height_m >= LEGS_M) {
                see(if sensor <= LIDAR { Sign::Jumps(sensor) } else { Sign::Apart }, at_s, step, 0.0, unit);
            }
        }
        // A rejected barometer is no longer a source of heights.
        let apart_m = (estimate.heights.disagreement_m())
            .or_else(|| Some((self.pressure_m? - height_m).abs()))
            .filter(|apart_m| falls && *apart_m > HEIGHTS_APART_M);
        if let Some(apart_m) = apart_m {
            see(Sign::HeightsDisagree, time_s, apart_m, 0.0, "");
        }
        if let Some((range_m, measured_s)) = self.steps.range_m.filter(|_| self.must_see_s.is_some())
            && time_s - measured_s < NEXT_SAMPLE_S
            && pilot.estimator().others_contradict_m(range_m * nose_up)
        {
            see(Sign::RangesDisagree, time_s, (range_m * nose_up - height_m).abs(), 0.0, "");
        }
        if let (Health::Unhealthy(issue), true) = (estimate.health, phase.is_landing()) {
            see(Sign::Estimate, time_s, 0.0, 0.0, issue.name());
        }
    }

    fn see_actuators(&self, computer: &Computer, flown: &SensedInput, see: See<'_>) {
        let (time_s, measured_rad) = (flown.time_s, surfaces_rad(flown.gimbal_rad, flown.fins_rad));
        for (surface, servo) in (0..).zip(self.surfaces.iter().flatten()) {
            let own = usize::from(surface);
            let away_rad = (measured_rad[own] - servo.at_rad).abs();
            if away_rad > AWAY_RAD[usize::from(own >= GIMBALS)] {
                let [away_deg, at_deg] = [away_rad, measured_rad[own]].map(f64::to_degrees);
                see(Sign::Surface(surface), time_s, away_deg, at_deg, self.motions[own].explained(own));
            }
        }
        let servo = &computer.pilot().mission().airframe.gimbal.servo;
        let turns = self.turns.iter().filter(|(frames, _)| *frames >= SLOW_FRAMES);
        let fastest_rad_s = turns.map(|(_, turned_rad)| turned_rad / FRAME_S).reduce(f64::min);
        if let Some(rate_rad_s) = fastest_rad_s.filter(|rate_rad_s| *rate_rad_s < SLOW * servo.rate_rad_s()) {
            see(Sign::SlowGimbal, time_s, rate_rad_s.to_degrees(), servo.rate_deg_s, "");
        }
        if let Some(volts) = flown.battery_v.filter(|volts| *volts < BATTERY_LOW_V) {
            see(Sign::Battery, time_s, volts, BATTERY_LOW_V, "");
        }
    }

    fn see_motors(&self, computer: &Computer, flown: &SensedInput, estimate: &Estimate, see: See<'_>) {
        let (pilot, phase, time_s) = (computer.pilot(), computer.mode().phase, flown.time_s);
        let (mission, motor) = (pilot.mission(), pilot.motor());
        let burns = phase == Phase::Powered;
        if let Some(launch) = mission.launch.as_ref().filter(|_| phase == Phase::Coast) {
            let booster = &launch.booster;
            let burnt_kg = 0.5 * booster.motor_curve.propellant_mass_kg();
            let mass_kg = mission.airframe.mass.loaded_kg + booster.dry_kg + burnt_kg;
            let share = self.boost_m_s * mass_kg / booster.motor_curve.total_impulse_n_s();
            if share < ASCENT_WEAK {
                see(Sign::AscentMotor, time_s, share, 1.0, "");
            }
        }
        if flown.booster_attached && self.parted {
            see(Sign::Separation, time_s, 1.0, 0.0, "");
        }
        let sinks_m_s = -estimate.state.velocity_m_s.z;
        if self.ejected_s.is_some_and(|at_s| time_s > at_s + CHUTE_FILLS_S) && sinks_m_s > CHUTE_CARRIES_M_S {
            see(Sign::Parachute, time_s, sinks_m_s, CHUTE_CARRIES_M_S, "");
        }
        // The shock of an impact is shorter than any burn.
        let lit_s = motor.ignition_s().filter(|lit_s| time_s - lit_s > SHOCK_S);
        let delay_s = mission.ignition.delay_s;
        if let Some((lit_s, ignited_at_s)) = lit_s.zip(pilot.ignited_at_s())
            && lit_s - ignited_at_s > delay_s + LATE_S
        {
            see(Sign::LateLight, ignited_at_s, lit_s - ignited_at_s, delay_s, "");
        }
        let (impulse, sigma) = (motor.impulse_scale(), motor.sigmas()[0]);
        let normal = (IMPULSE_SIGMAS * mission.motor.impulse_sigma).max(2.0 * sigma);
        if burns && !self.astray && (impulse - 1.0).abs() > normal {
            see(Sign::Impulse, motor.ignition_s().unwrap_or(time_s), impulse, 1.0, "");
        }
        if let (MotorStage::EndedEarly { at_s }, Some(lit_s)) = (motor.stage(), motor.ignition_s()) {
            let early_s = lit_s + motor.burn_time_stretch() * mission.motor_curve.burn_time_s() - at_s;
            if early_s > EARLY_S {
                see(Sign::BurntOutEarly, at_s, early_s, 0.0, "");
            }
        }
        let no_plan = computer.level() == ControlLevel::Stabiliser;
        if burns && no_plan && estimate.state.position_m.z > PLANS_ABOVE_M {
            see(Sign::NoPlan, time_s, 1.0, 0.0, "");
        }
        let tilt_deg = estimate.state.tilt_rad().to_degrees();
        if burns && tilt_deg > 90.0 {
            see(Sign::Tumbles, time_s, tilt_deg, 90.0, "");
        }
    }
}
