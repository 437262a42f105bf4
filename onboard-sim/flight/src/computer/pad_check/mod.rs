//! The check that a crew asks for on the pad: every surface goes through its range, the sensors stand still, and what
//! they find is compared with limits.
//!
//! It moves actuators only while the vehicle is disarmed and unreleased: [`PadCheck::step`] is called nowhere else, and
//! whatever else the crew asks for ends it first.
//!
//! The gyro is not calibrated here: [the watch on the pad](super::pad) finds its bias in every second at rest, and the
//! flight begins with the last one. The check shows that bias.

mod finding;
mod still;
mod sweep;
#[cfg(test)]
mod tests;

use alloc::string::String;
use alloc::vec::Vec;

pub use self::finding::{Finding, Item, SURFACES, Verdict};
use self::still::Still;
use self::sweep::Sweep;
use crate::computer::memory::{Memory, Remembers, remembers};
use crate::estimation::estimator::Measurements;
use crate::rules::operator::Operator;
use crate::vehicle::airframe::Airframe;
use crate::vehicle::mission::Mission;
use crate::vehicle::mission::{ArmingLimits, StartPoint};

/// How the last check stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum CheckState {
    /// There was none since power-up.
    #[default]
    NotRun = 0,
    Running = 1,
    /// Nothing was found outside a limit.
    Passed = 2,
    Failed = 3,
    /// It was ended before it had seen everything.
    Stopped = 4,
}

/// After an early end the surfaces return to rest: frames in which the vehicle is not ready to be armed, 1 s. A servo at
/// a third of mk2's rate returns in that time from anywhere.
const RETURN_FRAMES: u64 = 200;

/// What is being done.
#[derive(Debug, Clone, PartialEq)]
enum Stage {
    Resting,
    Sweeping(Sweep),
    Still(Still),
}

/// The last check, and the running one.
#[derive(Debug, Clone, PartialEq)]
pub struct PadCheck {
    run: u16,
    state: CheckState,
    stage: Stage,
    by: Option<Operator>,
    /// Frames that the sweep has taken, before the sensors are watched.
    swept_frames: u64,
    /// The surfaces return to rest until this frame.
    returns_until: u64,
    findings: Vec<Finding>,
}

remembers!(PadCheck { run, state, stage, by, swept_frames, returns_until, findings });
remembers!(Finding { item, value, least, most, verdict });

impl Remembers for CheckState {
    fn remember(&self, memory: &mut Memory) {
        (*self as u8).remember(memory);
    }
}

impl Remembers for Stage {
    fn remember(&self, memory: &mut Memory) {
        match self {
            Self::Resting => 0u8.remember(memory),
            Self::Sweeping(sweep) => {
                1u8.remember(memory);
                sweep.remember(memory);
            }
            Self::Still(still) => {
                2u8.remember(memory);
                still.remember(memory);
            }
        }
    }
}

/// One frame on the pad, as the check sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    /// Where the surfaces are: gimbal (pitch, yaw), fins 1 to 4, rad.
    pub(super) surfaces_rad: [f64; SURFACES],
    pub(super) measured: &'a Measurements,
    pub(super) switches: PadSwitches,
}

/// What is read once, at the end of the check.
#[derive(Debug, Clone, Copy)]
pub(super) struct PadSwitches {
    pub(super) igniter_continuity: bool,
    pub(super) booster_attached: bool,
    pub(super) pin_out: bool,
    /// `None`: not measured.
    pub(super) battery_v: Option<f64>,
    pub(super) log_running: bool,
    pub(super) log_space_bytes: u64,
}

/// Where a surface is told to go: its number, and its angle, rad. All others rest.
pub(super) type Told = (usize, f64);

impl Default for PadCheck {
    fn default() -> Self {
        Self {
            run: 0,
            state: CheckState::NotRun,
            stage: Stage::Resting,
            by: None,
            swept_frames: 0,
            returns_until: 0,
            findings: Vec::new(),
        }
    }
}

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

    /// One frame of a running check: where a surface is told to go, if one moves.
    pub(super) fn step(&mut self, seen: &Seen<'_>, mission: &Mission, arming: &ArmingLimits) -> Option<Told> {
        match &mut self.stage {
            Stage::Resting => return None,
            Stage::Sweeping(sweep) => {
                let (told, found) = sweep.step(&seen.surfaces_rad);
                self.findings.extend(found.into_iter().flatten());
                if told.is_none() {
                    self.swept_frames = sweep.frames().0;
                    self.stage = Stage::Still(Still::default());
                }
                return told;
            }
            Stage::Still(still) => {
                still.take(seen.measured);
                if !still.is_over() {
                    return None;
                }
                let hangs = mission.start.at == StartPoint::Drone;
                self.findings.extend(still.findings(mission, arming, hangs));
            }
        }
        self.findings.extend(finding::of_switches(&seen.switches, mission, arming));
        let failed = self.findings.iter().any(|found| found.verdict == Verdict::NotOk);
        self.state = if failed { CheckState::Failed } else { CheckState::Passed };
        self.stage = Stage::Resting;
        None
    }

    pub fn is_running(&self) -> bool {
        self.state == CheckState::Running
    }

    /// Whether surfaces move, or will.
    pub(super) fn is_busy(&self, frame: u64) -> bool {
        self.is_running() || frame < self.returns_until
    }

    pub fn state(&self) -> CheckState {
        self.state
    }

    /// Counts the checks since power-up; 0 before the first.
    pub fn run(&self) -> u16 {
        self.run
    }

    /// Who asked for it; `None` without operators.
    pub fn by(&self) -> Option<Operator> {
        self.by
    }

    /// What has been found so far, in the order in which it was found.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// How much of the running check is done, percent.
    pub fn progress_percent(&self) -> u8 {
        let still_frames = u64::from(still::FRAMES);
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

    /// Its end in words, for the crew.
    pub(super) fn words(&self) -> String {
        finding::words(&self.findings)
    }
}
