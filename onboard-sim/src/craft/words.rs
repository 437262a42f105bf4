//! What the crew is told as the phase table does something.

use flight::arming::{Check, UPLINK_CHECK};
use flight::phase::{Effect, HOLD_LIMIT_S};

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

/// An abort under thrust, in words.
pub(crate) const DEGRADED: &str = "ABORT: no cut-off exists; holding upright at full vertical thrust";

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
