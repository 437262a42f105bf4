//! Whether the ground may command to arm and to start.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::vehicle::is_on_pad;
use super::{Model, words};

/// Why the ground does not command to arm. Failing checks are left for the vehicle to refuse, with its own text.
pub fn why_not_arm(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("the vehicle is not heard".to_owned());
    }
    if model.vehicle.armed().is_some_and(|armed| armed.value) {
        return Some("armed already".to_owned());
    }
    if !model.link.uplink.is_proven(now) {
        let why = model.link.uplink.why_unheard();
        return Some(format!("the uplink is not proven: {why}"));
    }
    let Some(phase) = model.vehicle.phase().map(|phase| phase.value) else {
        return Some("the phase is unknown".to_owned());
    };
    (!is_on_pad(phase)).then(|| format!("phase {}", words::phase(phase)))
}

/// Why the ground does not command to start the countdown.
pub fn why_not_start(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("the vehicle is not heard".to_owned());
    }
    if !model.vehicle.armed().is_some_and(|armed| armed.value) {
        return Some("not armed".to_owned());
    }
    let Some(phase) = model.vehicle.phase().map(|phase| phase.value) else {
        return Some("the phase is unknown".to_owned());
    };
    (phase != TdPhase::TD_PHASE_PAD_ARMED).then(|| format!("phase {}", words::phase(phase)))
}
