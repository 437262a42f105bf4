//! One line of the check: an item, the value found, the limits and the verdict.

use alloc::format;
use alloc::string::String;

use super::PadSwitches;
use crate::computer::memory::{Memory, Remembers};
use crate::vehicle::mission::Mission;
use crate::vehicle::mission::{ArmingLimits, StartPoint};

/// The surfaces: gimbal pitch and yaw, fins 1 to 4.
pub const SURFACES: usize = 6;

/// What was looked at. Values are SI: rad, s, rad/s, m/s^2, m, m/s, V, bytes; a switch is 1 or 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// How far a surface went, from end to end.
    Range(usize),
    /// How far a surface stood from its command, at most.
    Error(usize),
    /// How much later a surface arrived than one that turns at once at its airframe's rate.
    Lag(usize),
    /// Mean rotation rate at rest: what the estimator starts with.
    GyroBias,
    GyroNoise,
    /// Mean length of the specific force.
    Gravity,
    AccelerometerNoise,
    BarometerNoise,
    /// Satellite fixes in the time that the sensors were watched.
    GnssFixes,
    GnssSpeed,
    /// The last range; on a pad it may be too near to be measured.
    LidarRange,
    IgniterContinuity,
    BoosterWire,
    PinOut,
    BatteryVoltage,
    LogRunning,
    LogSpace,
}

impl Item {
    /// Its number on the wire, as in the dialect's TD_PAD_CHECK_ITEM: three for each surface, then the others.
    pub fn number(self) -> u8 {
        let of_surface = |surface: usize, which: u8| 3 * u8::try_from(surface).unwrap_or(u8::MAX / 4) + which;
        match self {
            Self::Range(surface) => of_surface(surface, 0),
            Self::Error(surface) => of_surface(surface, 1),
            Self::Lag(surface) => of_surface(surface, 2),
            Self::GyroBias => 32,
            Self::GyroNoise => 33,
            Self::Gravity => 34,
            Self::AccelerometerNoise => 35,
            Self::BarometerNoise => 36,
            Self::GnssFixes => 37,
            Self::GnssSpeed => 38,
            Self::LidarRange => 39,
            Self::IgniterContinuity => 48,
            Self::BoosterWire => 49,
            Self::PinOut => 50,
            Self::BatteryVoltage => 51,
            Self::LogRunning => 52,
            Self::LogSpace => 53,
        }
    }

    fn name(self) -> String {
        let surface = |surface: usize| match surface {
            0 => "gimbal pitch".into(),
            1 => "gimbal yaw".into(),
            fin => format!("fin {}", fin - 1),
        };
        match self {
            Self::Range(of) => format!("{} range", surface(of)),
            Self::Error(of) => format!("{} error", surface(of)),
            Self::Lag(of) => format!("{} lag", surface(of)),
            Self::GyroBias => "gyro bias".into(),
            Self::GyroNoise => "gyro noise".into(),
            Self::Gravity => "gravity".into(),
            Self::AccelerometerNoise => "accelerometer noise".into(),
            Self::BarometerNoise => "barometer noise".into(),
            Self::GnssFixes => "GNSS fixes".into(),
            Self::GnssSpeed => "GNSS speed".into(),
            Self::LidarRange => "lidar".into(),
            Self::IgniterContinuity => "igniter continuity".into(),
            Self::BoosterWire => "booster wire".into(),
            Self::PinOut => "pin".into(),
            Self::BatteryVoltage => "battery".into(),
            Self::LogRunning => "log".into(),
            Self::LogSpace => "log space".into(),
        }
    }
}

impl Remembers for Item {
    fn remember(&self, memory: &mut Memory) {
        self.number().remember(memory);
    }
}

/// What a value means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Verdict {
    /// Shown only: here nothing is wrong with any value.
    NotJudged = 0,
    Ok = 1,
    NotOk = 2,
}

impl Remembers for Verdict {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

/// A value with its limits; NaN is no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    pub item: Item,
    /// NaN: there was none.
    pub value: f64,
    pub least: f64,
    pub most: f64,
    pub verdict: Verdict,
}

impl Finding {
    /// A value that must not be less. One that is not a number fails.
    pub(super) fn at_least(item: Item, value: f64, least: f64) -> Self {
        Self { item, value, least, most: f64::NAN, verdict: judged(value >= least) }
    }

    /// A value that must not be more. One that is not a number fails.
    pub(super) fn at_most(item: Item, value: f64, most: f64) -> Self {
        Self { item, value, least: f64::NAN, most, verdict: judged(value <= most) }
    }

    pub(super) fn between(item: Item, value: f64, least: f64, most: f64) -> Self {
        Self { item, value, least, most, verdict: judged((least..=most).contains(&value)) }
    }

    pub(super) fn only_shown(item: Item, value: f64) -> Self {
        Self { item, value, least: f64::NAN, most: f64::NAN, verdict: Verdict::NotJudged }
    }
}

/// The larger of two; not a number, unlike with `max`, if one of them is not.
pub(super) fn larger(one: f64, other: f64) -> f64 {
    if one.is_nan() || one >= other { one } else { other }
}

fn judged(ok: bool) -> Verdict {
    if ok { Verdict::Ok } else { Verdict::NotOk }
}

/// Switches, battery and log.
pub(super) fn of_switches(
    switches: &PadSwitches,
    mission: &Mission,
    arming: &ArmingLimits,
) -> impl Iterator<Item = Finding> {
    let closed = |item, closed: bool| Finding::at_least(item, f64::from(u8::from(closed)), 1.0);
    let on_a_rail = mission.start.at == StartPoint::Pad;
    [
        Some(closed(Item::IgniterContinuity, switches.igniter_continuity)),
        on_a_rail.then(|| closed(Item::BoosterWire, switches.booster_attached)),
        // In while people work at the vehicle, out before it is armed: both are right in their time.
        Some(Finding::only_shown(Item::PinOut, f64::from(u8::from(switches.pin_out)))),
        switches.battery_v.map(|volts| Finding::at_least(Item::BatteryVoltage, volts, arming.battery_min_v)),
        Some(closed(Item::LogRunning, switches.log_running)),
        Some(Finding::at_least(
            Item::LogSpace,
            switches.log_space_bytes as f64,
            arming.log_space_min_bytes as f64,
        )),
    ]
    .into_iter()
    .flatten()
}

/// How many values are outside their limits, and which is the first.
pub(super) fn words(findings: &[Finding]) -> String {
    let mut failed = findings.iter().filter(|found| found.verdict == Verdict::NotOk);
    match (failed.next(), failed.count()) {
        (None, _) => format!("check passed: {} values found", findings.len()),
        (Some(first), 0) => format!("check FAILED: {}", first.item.name()),
        (Some(first), more) => format!("check FAILED: {} and {more} more", first.item.name()),
    }
}
