//! What the flight computer reports: changes of phase, and messages to the crew.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;

use crate::computer::memory::{Memory, Remembers};
use crate::rules::arming::{Check, UPLINK_CHECK};
use crate::rules::phase::{Effect, HOLD_LIMIT_S, Interlocks, Phase};

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// As planned.
    Info,
    /// As planned, but worth noticing.
    Notice,
    /// Not as planned.
    Warning,
    /// Something failed, or was refused because of a fault.
    Error,
    /// The vehicle is in danger.
    Critical,
}

/// One report of the flight computer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News {
    /// A message to the crew.
    Said {
        severity: Severity,
        words: String,
    },
    PhaseChanged {
        from: Phase,
        to: Phase,
    },
}

/// The message for an effect; `None` if the change of phase already says it.
pub(super) fn words_of(effect: Effect, countdown_s: f64) -> Option<(Severity, String)> {
    let (severity, words) = match effect {
        Effect::IgniteLandingMotor => (Severity::Notice, "landing motor commanded to light"),
        Effect::InhibitLandingMotor => (Severity::Notice, "landing motor inhibited"),
        Effect::Disarm => (Severity::Notice, "disarmed"),
        Effect::StartCountdown => {
            return Some((Severity::Notice, format!("countdown started: release in {countdown_s} s")));
        }
        Effect::CancelCountdown => (Severity::Warning, "countdown cancelled"),
        Effect::HoldCountdown => {
            let words = format!("HOLD: no countdown; start anew or it disarms in {HOLD_LIMIT_S} s");
            return Some((Severity::Critical, words));
        }
        Effect::ShowPadWait => (Severity::Critical, "ABORT on the pad: keep away for 60 s"),
        Effect::RecordLoss => (Severity::Critical, "vehicle will be lost: landing motor inhibited"),
        Effect::DeployChute => (Severity::Critical, "parachute deployed"),
        Effect::IgniteAscentMotor => (Severity::Notice, "ascent motor commanded to light"),
        Effect::SeparateBooster => (Severity::Notice, "booster commanded to separate"),
        // The crew can see the fins.
        Effect::FinsOpen => return None,
    };
    Some((severity, words.to_owned()))
}

/// The message for an abort after the landing motor was commanded or lit, if the abort came between these two modes.
pub(super) fn words_of_landing_here(
    before: Interlocks,
    after: Interlocks,
) -> Option<(Severity, &'static str)> {
    let words = if after.no_light_latched {
        "ABORT: the landing motor has not lit"
    } else {
        "ABORT: no cut-off exists; landing on the ground below"
    };
    (after.lands_here && !before.lands_here).then_some((Severity::Critical, words))
}

/// The failing arming check that the crew on the pad was last told of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Readiness(Option<&'static str>);

impl Remembers for Readiness {
    fn remember(&self, memory: &mut Memory) {
        self.0.remember(memory);
    }
}

impl Readiness {
    /// A message with the check that fails now, if it is another one than before. The uplink is left out: it comes and
    /// goes with every lost heartbeat, and each station is told of its own uplink anyway.
    pub(super) fn news(&mut self, checks: &[Check]) -> Option<String> {
        let failing = checks.iter().find(|check| !check.passed && check.name != UPLINK_CHECK);
        let complaint = failing.map(|check| check.name);
        let changed = complaint != core::mem::replace(&mut self.0, complaint);
        failing.filter(|_| changed).and_then(Check::refusal).map(|reason| format!("not ready: {reason}"))
    }
}
