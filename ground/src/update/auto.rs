//! The automatic mode: arms and starts without a hand, for runs without a crew.

use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::log::record::EventLevel;

use super::commands;
use crate::model::command::CommandKind;
use crate::model::events::Speaker;
use crate::model::seat::Seat;
use crate::model::{AutoStep, Model, words};

/// The vehicle has this long, from when it was first heard, to become ready.
const PATIENCE: Duration = Duration::from_secs(10);
/// After a refusal for now, what the vehicle says about its checks is believed again only after this.
const ASK_AGAIN_AFTER: Duration = Duration::from_secs(1);

pub(super) fn step(model: &mut Model, now: Duration) {
    if !model.settings.auto || !model.link.state(now).carries() {
        return;
    }
    if model.auto_step != AutoStep::Done && is_live(model) {
        return refuse(model, now);
    }
    let armed = model.vehicle.armed().is_some_and(|armed| armed.value);
    let phase = model.vehicle.phase().map(|phase| phase.value);
    match model.auto_step {
        AutoStep::WaitForReady { not_before } => match phase {
            Some(TdPhase::TD_PHASE_PAD_ARMED) if armed && is_ours(model) => start(model, now),
            // Flying or flown already: there is nothing to start.
            Some(phase) if phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32 => {
                model.auto_step = AutoStep::Done;
            }
            _ => arm_if_ready(model, not_before, now),
        },
        AutoStep::WaitForArmed => {
            if armed && is_ours(model) && phase == Some(TdPhase::TD_PHASE_PAD_ARMED) {
                start(model, now);
            }
        }
        AutoStep::Done => {}
    }
}

/// Whether the vehicle is known to be a simulated one.
fn is_ours(model: &Model) -> bool {
    model.settings.demonstration || model.vehicle.is_simulated()
}

/// Whether the vehicle has said what it is, and not that it is a simulated one.
fn is_live(model: &Model) -> bool {
    model.vehicle.boot.has_said_what_it_is() && !is_ours(model)
}

fn refuse(model: &mut Model, now: Duration) {
    let why = "the vehicle is live: it does not say that it is simulated";
    model.say(now, Speaker::Ground, EventLevel::Error, format!("automatic mode refused: {why}"));
    model.auto_step = AutoStep::Done;
    model.outcome.refusal = Some((format!("the automatic mode: {why}"), now));
}

/// An arming was refused for now. Returns whether the automatic mode will ask again, once the checks pass:
/// a new submission with its own reason, never the old frame sent again.
pub(super) fn ask_again(model: &mut Model, now: Duration) -> bool {
    let asked = model.settings.auto && model.auto_step == AutoStep::WaitForArmed;
    if asked {
        model.info(now, "automatic mode: refused for now; asks again when the checks pass");
        model.auto_step = AutoStep::WaitForReady { not_before: now + ASK_AGAIN_AFTER };
    }
    asked
}

fn arm_if_ready(model: &mut Model, not_before: Duration, now: Duration) {
    let why_not = why_not_ready(model, not_before, now);
    let waited = model.link.first_heartbeat_at.map_or(Duration::ZERO, |at| now.saturating_sub(at));
    match why_not {
        None => {
            model.info(now, "automatic mode: the checks pass; arming");
            model.auto_step = AutoStep::WaitForArmed;
            commands::submit(model, CommandKind::Arm, Seat::automatic(), now);
        }
        Some(why) if waited >= PATIENCE => {
            let seconds = PATIENCE.as_secs();
            model.warn(now, format!("automatic mode: gives up {seconds} s after first contact: {why}"));
            model.auto_step = AutoStep::Done;
            model.outcome.refusal = Some((format!("ARM not asked for: {why}"), now));
        }
        Some(_) => {}
    }
}

fn why_not_ready(model: &Model, not_before: Duration, now: Duration) -> Option<String> {
    let Some(status) = model.vehicle.status.as_ref() else {
        return Some("the vehicle has not said how its checks stand".to_owned());
    };
    if !is_ours(model) {
        return Some("the vehicle has not said that it is simulated".to_owned());
    }
    let failing = words::failed_checks(status.value.checks_failed);
    if status.is_stale(now) {
        Some("the vehicle no longer says how its checks stand".to_owned())
    } else if !failing.is_empty() {
        Some(format!("failing checks: {}", failing.join(", ")))
    } else if !model.link.uplink.is_proven(now) {
        Some(format!("the uplink is not proven: {}", model.link.uplink.why_unheard()))
    } else if status.value.phase != TdPhase::TD_PHASE_PAD_IDLE {
        Some(format!("phase {}", words::phase(status.value.phase)))
    } else if status.received_at < not_before {
        Some("refused for now, although no check fails".to_owned())
    } else {
        None
    }
}

fn start(model: &mut Model, now: Duration) {
    model.info(now, "automatic mode: starting");
    model.auto_step = AutoStep::Done;
    if model.vehicle.countdown_s().is_none() {
        commands::submit(model, CommandKind::Start, Seat::automatic(), now);
    }
}
