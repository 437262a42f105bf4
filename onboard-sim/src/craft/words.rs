//! What the crew is told as the phase table does something.

use flight::arming::{Check, UPLINK_CHECK};
use flight::phase::{Effect, HOLD_LIMIT_S, Interlocks};

use super::Severity;

/// A log that stops in flight, in words.
pub(crate) const LOG_STOPPED: &str = "the log has stopped: this flight is no longer recorded whole";

/// The words for an effect; `None` where the change of phase says it.
pub(crate) fn words_of(effect: Effect, countdown_s: f64) -> Option<(Severity, String)> {
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
        // No ascent is flown here, and fins are seen.
        Effect::FinsOpen | Effect::IgniteAscentMotor => return None,
    };
    Some((severity, words.to_owned()))
}

/// The words for an abort that found the landing motor lit, if it came between two moments.
pub(crate) fn words_of_landing_here(before: Interlocks, after: Interlocks) -> Option<(Severity, String)> {
    let aborted = after.lands_here && !before.lands_here;
    let words = if after.no_light_latched {
        "ABORT: the landing motor has not lit"
    } else {
        "ABORT: no cut-off exists; landing on the ground below"
    };
    aborted.then(|| (Severity::Critical, words.to_owned()))
}

/// A self-test that has failed, in words.
pub(crate) fn self_test_failed(fins_answering: usize) -> String {
    format!("self-test failed: an actuator does not answer ({fins_answering} of 4 fins do)")
}

/// What the crew on the pad was last told to stand in the way of arming.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Readiness(Option<&'static str>);

impl Readiness {
    /// What stands in the way now, in words, if that has changed. The uplink comes and goes with every lost heartbeat,
    /// and each station is told of its own without being asked: it is not spoken of here.
    pub(crate) fn news(&mut self, checks: &[Check]) -> Option<String> {
        let failing = checks.iter().find(|check| !check.passed && check.name != UPLINK_CHECK);
        let complaint = failing.map(|check| check.name);
        let changed = complaint != std::mem::replace(&mut self.0, complaint);
        failing.filter(|_| changed).and_then(Check::refusal).map(|reason| format!("not ready: {reason}"))
    }
}
