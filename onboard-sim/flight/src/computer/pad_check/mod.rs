//! The vehicle check on the pad: every surface moves through its range, the sensors are observed at
//! rest, and the results are compared with limits.
//!
//! It moves actuators only while the vehicle is disarmed and unreleased: [`PadCheck::step`] is the
//! only place that commands them, and any other crew command ends the check first.
//!
//! The gyro is not calibrated here: the [pad monitor](super::pad) finds its bias in every second at
//! rest, and the flight begins with the last one. The check shows that bias.

mod sweep;
#[cfg(test)]
mod tests;

use arrayvec::ArrayVec;
use serde::Serialize;

use self::sweep::{Still, Sweep};
use super::crew::{Answer, CrewCommand, Ending, People};
use super::messages::Severity;
use super::pad::SelfTest;
use super::{Computer, SensedInput};
use crate::rules::arming::SEERS;
use crate::rules::operator::Operator;
use crate::rules::phase::Phase;
use crate::text::{Text, text};
use crate::vehicle::airframe::Airframe;
use crate::vehicle::mission::{ArmingLimits, Mission, StartPoint};

/// State of the last check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[repr(u8)]
pub enum CheckState {
    /// None since power-up.
    #[default]
    NotRun = 0,
    Running = 1,
    /// No value was outside a limit.
    Passed = 2,
    Failed = 3,
    /// Ended before it was complete.
    Stopped = 4,
}

/// Time for the surfaces to return to rest after an early end, frames (1 s), in which the vehicle
/// cannot be armed. A servo at a third of mk2's rate returns within this time from any position.
const RETURN_FRAMES: u64 = 200;

/// Stage of the running check.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
enum Stage {
    #[default]
    Resting,
    Sweeping(Sweep),
    Still(Still),
}

/// The last check, and the running one.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PadCheck {
    /// Number of checks since power-up; 0 before the first.
    pub run: u16,
    pub state: CheckState,
    stage: Stage,
    /// The operator who requested it; `None` without operators.
    pub by: Option<Operator>,
    /// Frames of the sweep, before the sensors are observed.
    swept_frames: u64,
    /// The lowest voltages of both packs since the check began, V: moving servos draw most.
    lowest_v: [Option<f64>; 2],
    /// Frame until which the surfaces return to rest.
    returns_until: u64,
    /// Findings so far, in order of detection.
    pub findings: ArrayVec<CheckedValue, 40>,
    /// The people who have seen every surface move as shown on the crew's page.
    seen_by: ArrayVec<Option<Operator>, 16>,
}

/// A surface command: its number, and its angle, rad. All other surfaces rest.
pub(super) type SurfaceCommand = (usize, f64);

impl PadCheck {
    /// Begins a check; with `moves` the surfaces are swept first.
    pub(super) fn begin(&mut self, airframe: &Airframe, moves: bool, by: Option<Operator>) {
        let stage =
            if moves { Stage::Sweeping(Sweep::new(airframe)) } else { Stage::Still(Still::default()) };
        let run = self.run.wrapping_add(1).max(1);
        *self = Self { run, state: CheckState::Running, stage, by, ..Self::default() };
    }

    /// Ends a running check early. Returns whether one ran.
    pub(super) fn stop(&mut self, frame: u64) -> bool {
        let ran = self.is_running();
        if ran {
            if matches!(self.stage, Stage::Sweeping(_)) {
                self.returns_until = frame + RETURN_FRAMES;
            }
            (self.state, self.stage) = (CheckState::Stopped, Stage::Resting);
        }
        ran
    }

    /// Executes one frame of a running check; returns the surface command, if one moves.
    pub(super) fn step(
        &mut self,
        input: &SensedInput,
        mission: &Mission,
        arming: &ArmingLimits,
    ) -> Option<SurfaceCommand> {
        for (lowest_v, volts) in self.lowest_v.iter_mut().zip([input.battery_v, input.servo_battery_v]) {
            *lowest_v = volts.map(|volts| -larger(-volts, -lowest_v.unwrap_or(volts)));
        }
        match &mut self.stage {
            Stage::Resting => return None,
            Stage::Sweeping(sweep) => {
                let (command, found) = sweep.step(&surfaces_rad(input.gimbal_rad, input.fins_rad));
                self.findings.extend(found.into_iter().flatten());
                if command.is_none() {
                    self.swept_frames = sweep.frames().0;
                    self.stage = Stage::Still(Still::default());
                }
                return command;
            }
            Stage::Still(still) => {
                still.take(&input.measured);
                if !still.is_over() {
                    return None;
                }
                let hangs = mission.start.at == StartPoint::Drone;
                self.findings.extend(still.findings(mission, arming, hangs));
                self.findings.extend(still.lean_from_the_rail(mission));
            }
        }
        self.findings.extend(findings_of_switches(input, self.lowest_v, mission, arming));
        let failed = self.findings.iter().any(|found| found.verdict == Verdict::NotOk);
        self.state = if failed { CheckState::Failed } else { CheckState::Passed };
        self.stage = Stage::Resting;
        None
    }

    /// Records that a person has seen every surface move as shown on the crew's page; `two`: people
    /// are distinguished. An error gives the reason why it does not count.
    fn see(&mut self, by: Option<Operator>, two: bool) -> Result<(), &'static str> {
        if self.state != CheckState::Passed || self.swept_frames == 0 {
            return Err("no check with motion has passed");
        }
        if two && self.seen_by.contains(&by) {
            return Err("another person has to say so, too");
        }
        let _ = self.seen_by.try_push(by);
        Ok(())
    }

    /// Number of people who have seen every surface of the last check move.
    pub fn seers(&self) -> usize {
        self.seen_by.len()
    }

    pub fn is_running(&self) -> bool {
        self.state == CheckState::Running
    }

    /// Whether surfaces move, or are about to.
    pub(super) fn is_busy(&self, frame: u64) -> bool {
        self.is_running() || frame < self.returns_until
    }

    /// Progress of the running check, percent.
    pub fn progress_percent(&self) -> u8 {
        let still_frames = u64::from(sweep::STILL_FRAMES);
        let (done, all) = match &self.stage {
            Stage::Resting => return if self.state == CheckState::NotRun { 0 } else { 100 },
            Stage::Sweeping(sweep) => {
                let (done, all) = sweep.frames();
                (done, all + still_frames)
            }
            Stage::Still(still) => (self.swept_frames + still.frames(), self.swept_frames + still_frames),
        };
        u8::try_from(100 * done / all.max(1)).unwrap_or(100).min(99)
    }

    /// The result as text for the crew.
    pub(super) fn words(&self) -> Text {
        let mut failed = self.findings.iter().filter(|found| found.verdict == Verdict::NotOk);
        match (failed.next(), failed.count()) {
            (None, _) => text!("check passed: {} values found", self.findings.len()),
            (Some(first), 0) => text!("check FAILED: {}", first.item.name()),
            (Some(first), more) => text!("check FAILED: {} and {more} more", first.item.name()),
        }
    }
}

// One line of the check: an item, the value found, the limits and the verdict.

/// The surfaces: gimbal pitch and yaw, fins 1 to 4.
pub const SURFACES: usize = 6;

/// Their names.
pub const SURFACE_NAMES: [&str; SURFACES] =
    ["gimbal pitch", "gimbal yaw", "fin 1", "fin 2", "fin 3", "fin 4"];

/// The surfaces in that order, rad.
pub fn surfaces_rad([pitch, yaw]: [f64; 2], [one, two, three, four]: [f64; 4]) -> [f64; SURFACES] {
    [pitch, yaw, one, two, three, four]
}

/// The checked quantity. Values are SI: rad, s, rad/s, m/s^2, m, m/s, V, bytes; a switch is 1 or 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Item {
    /// Measured range of a surface, from end to end.
    Range(usize),
    /// Largest deviation of a surface from its command.
    Error(usize),
    /// Arrival delay of a surface relative to a servo without delay at the airframe's rate.
    Lag(usize),
    /// Mean rotation rate at rest, the initial gyro bias of the estimator.
    GyroBias,
    GyroNoise,
    /// Mean length of the specific force.
    Gravity,
    AccelerometerNoise,
    BarometerNoise,
    /// Satellite fixes during the observation of the sensors.
    GnssFixes,
    GnssSpeed,
    /// The last range; on a pad it may be too short to be measured.
    LidarRange,
    /// On a rail: angle between the measured vertical and the vertical of the mission's rail.
    RailLean,
    IgniterContinuity,
    BoosterWire,
    PinOut,
    BatteryVoltage,
    LogRunning,
    LogSpace,
    ServoBatteryVoltage,
}

impl Item {
    /// Number on the wire, as in the dialect's TD_PAD_CHECK_ITEM: three for each surface, then the
    /// others.
    pub fn number(self) -> u8 {
        self.row().0
    }

    fn name(self) -> Text {
        self.row().1
    }

    /// Its number and name.
    fn row(self) -> (u8, Text) {
        let of = |surface: usize, which: u8, words: &str| {
            let number = 3 * u8::try_from(surface).unwrap_or(u8::MAX / 4) + which;
            (number, text!("{} {words}", SURFACE_NAMES.get(surface).unwrap_or(&"surface")))
        };
        let (number, name) = match self {
            Self::Range(surface) => return of(surface, 0, "range"),
            Self::Error(surface) => return of(surface, 1, "error"),
            Self::Lag(surface) => return of(surface, 2, "lag"),
            Self::GyroBias => (32, "gyro bias"),
            Self::GyroNoise => (33, "gyro noise"),
            Self::Gravity => (34, "gravity"),
            Self::AccelerometerNoise => (35, "accelerometer noise"),
            Self::BarometerNoise => (36, "barometer noise"),
            Self::GnssFixes => (37, "GNSS fixes"),
            Self::GnssSpeed => (38, "GNSS speed"),
            Self::LidarRange => (39, "lidar"),
            Self::RailLean => (40, "lean from the rail"),
            Self::IgniterContinuity => (48, "igniter continuity"),
            Self::BoosterWire => (49, "booster wire"),
            Self::PinOut => (50, "pin"),
            Self::BatteryVoltage => (51, "battery"),
            Self::LogRunning => (52, "log"),
            Self::LogSpace => (53, "log space"),
            Self::ServoBatteryVoltage => (54, "servo battery"),
        };
        (number, text!("{name}"))
    }
}

/// Verdict on a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[repr(u8)]
pub enum Verdict {
    /// Shown only: no value is a fault.
    NotJudged = 0,
    Ok = 1,
    NotOk = 2,
}

/// A value with its limits; NaN is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CheckedValue {
    pub item: Item,
    /// NaN if not available.
    pub value: f64,
    pub least: f64,
    pub most: f64,
    pub verdict: Verdict,
}

/// A value with a minimum. NaN fails.
fn at_least(item: Item, value: f64, least: f64) -> CheckedValue {
    CheckedValue { item, value, least, most: f64::NAN, verdict: judged(value >= least) }
}

/// A value with a maximum. NaN fails.
fn at_most(item: Item, value: f64, most: f64) -> CheckedValue {
    CheckedValue { item, value, least: f64::NAN, most, verdict: judged(value <= most) }
}

fn between(item: Item, value: f64, least: f64, most: f64) -> CheckedValue {
    CheckedValue { item, value, least, most, verdict: judged((least..=most).contains(&value)) }
}

fn only_shown(item: Item, value: f64) -> CheckedValue {
    CheckedValue { item, value, least: f64::NAN, most: f64::NAN, verdict: Verdict::NotJudged }
}

/// The larger of two; NaN if either is NaN, unlike `max`.
fn larger(one: f64, other: f64) -> f64 {
    if one.is_nan() || one >= other { one } else { other }
}

fn judged(ok: bool) -> Verdict {
    if ok { Verdict::Ok } else { Verdict::NotOk }
}

/// Switches, batteries and log.
fn findings_of_switches(
    input: &SensedInput,
    [battery_v, servo_battery_v]: [Option<f64>; 2],
    mission: &Mission,
    arming: &ArmingLimits,
) -> impl Iterator<Item = CheckedValue> {
    let closed = |item, closed: bool| at_least(item, f64::from(u8::from(closed)), 1.0);
    let on_a_rail = mission.start.at == StartPoint::Pad;
    [
        Some(closed(Item::IgniterContinuity, input.igniter_continuity)),
        on_a_rail.then(|| closed(Item::BoosterWire, input.booster_attached)),
        // In while people work at the vehicle, out before arming: both states are correct.
        Some(only_shown(Item::PinOut, f64::from(u8::from(input.pin_out)))),
        battery_v.map(|volts| at_least(Item::BatteryVoltage, volts, arming.battery_min_v)),
        servo_battery_v.map(|volts| at_least(Item::ServoBatteryVoltage, volts, arming.servo_battery_min_v)),
        Some(closed(Item::LogRunning, input.log.running)),
        Some(at_least(Item::LogSpace, input.log.space_bytes as f64, arming.log_space_min_bytes as f64)),
    ]
    .into_iter()
    .flatten()
}

// Permission to run the check, and its end.

impl Computer {
    /// The last check on the pad.
    pub fn pad_check(&self) -> &PadCheck {
        &self.pad_check
    }

    /// Why no check may run now; `None` if it may.
    fn why_no_check(&self) -> Option<&'static str> {
        let mode = self.table.mode();
        let locks = mode.interlocks;
        let reason = match mode.phase {
            _ if locks.abort_latched => "an abort is latched: restart to clear it",
            _ if self.release.is_some() || !mode.phase.on_pad() => "not on the pad",
            _ if locks.armed || mode.countdown_end_s.is_some() => "armed: disarm first",
            // A failed self-test is a reason to run the check.
            Phase::Safe if self.self_test != SelfTest::Failed => "the self-test is not over",
            _ => return None,
        };
        Some(reason)
    }

    /// Begins a check. A running one continues: a repeated request does not restart it.
    pub(super) fn begin_check(&mut self, command: CrewCommand, by: Option<Operator>) -> Answer {
        if let Some(reason) = self.why_no_check() {
            return Answer { ending: Ending::NotNow, ..self.deny(command, reason) };
        }
        if self.pad_check.is_running() {
            return Answer::ACCEPTED;
        }
        let moves = command == CrewCommand::Check;
        self.pad_check.begin(&self.pilot.mission().airframe, moves, by);
        let who = by.map_or_else(Text::new, |by| text!("{by}: "));
        let what = if moves { "gimbal and fins MOVE" } else { "nothing moves" };
        self.table.report(Severity::Notice, text!("{who}check of the vehicle begins: {what}"));
        Answer::ACCEPTED
    }

    /// Records one person's confirmation that every surface of the last check moved correctly.
    pub(super) fn see_check(&mut self, command: CrewCommand, by: Option<Operator>) -> Answer {
        let two = matches!(self.input.people, Some(People::Two { .. }));
        if let Err(reason) = self.pad_check.see(by, two) {
            return Answer { ending: Ending::NotNow, ..self.deny(command, reason) };
        }
        let who = by.map_or_else(|| text!("one person"), |by| text!("{by}"));
        let words =
            text!("{who} saw all surfaces move as they should: {} of {SEERS}", self.pad_check.seers());
        self.table.report(Severity::Notice, words);
        Answer::ACCEPTED
    }

    /// Ends a running check and returns the surfaces to rest. Returns whether one ran.
    pub(super) fn end_check(&mut self, why: &str) -> bool {
        let ran = self.pad_check.stop(self.input.frame);
        if ran {
            self.rest_surfaces();
            self.table.report(Severity::Warning, text!("check of the vehicle ended early: {why}"));
        }
        ran
    }

    fn rest_surfaces(&mut self) {
        (self.commands.gimbal_rad, self.commands.fins_rad) = ([0.0; 2], [self.closed_rad(); 4]);
    }

    /// Executes one frame of a running check. It ends here at the latest, whatever has happened in
    /// this frame.
    pub(super) fn check_itself(&mut self, input: &SensedInput) {
        if !self.pad_check.is_running() {
            return;
        }
        if let Some(reason) = self.why_no_check() {
            // In the air the pilot commands the surfaces from the next frame on.
            self.end_check(reason);
            return;
        }
        let command = self.pad_check.step(input, self.pilot.mission(), &self.arming);
        self.rest_surfaces();
        match command {
            Some((surface @ 0..2, angle_rad)) => self.commands.gimbal_rad[surface] = angle_rad,
            Some((surface, angle_rad)) => self.commands.fins_rad[surface - 2] = angle_rad,
            None => {}
        }
        match self.pad_check.state {
            CheckState::Passed => self.table.report(Severity::Notice, self.pad_check.words()),
            CheckState::Failed => self.table.report(Severity::Warning, self.pad_check.words()),
            CheckState::NotRun | CheckState::Running | CheckState::Stopped => {}
        }
    }
}
