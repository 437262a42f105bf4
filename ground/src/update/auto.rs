//! The automatic mode, for runs without a crew: arms and starts a simulated vehicle.

use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::log::record::EventLevel;

use super::commands;
use crate::model::command::CommandKind;
use crate::model::events::Speaker;
use crate::model::permits::why_nothing_moves;
use crate::model::seat::Seat;
use crate::model::{AutoStep, Model, words};

/// How long the vehicle may take to become ready, from its first heartbeat.
const READY_WITHIN: Duration = Duration::from_secs(10);
/// The same while another station uses our ids: one that ran before under the same ids is in the way for up to 15 s.
const FREE_WITHIN: Duration = Duration::from_secs(20);
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
            Some(TdPhase::TD_PHASE_PAD_ARMED) if armed && is_simulated(model) => start(model, now),
            // The flight has already begun, so there is nothing to start.
            Some(phase) if phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32 => {
                model.auto_step = AutoStep::Done;
            }
            _ => arm_if_ready(model, not_before, now),
        },
        AutoStep::WaitForArmed => {
            if armed && is_simulated(model) && phase == Some(TdPhase::TD_PHASE_PAD_ARMED) {
                start(model, now);
            }
        }
        AutoStep::Done => {}
    }
}

/// Whether the vehicle is known to be simulated.
fn is_simulated(model: &Model) -> bool {
    model.settings.demonstration || model.vehicle.is_simulated()
}

/// Whether the vehicle has reported what it is, and is not simulated.
fn is_live(model: &Model) -> bool {
    model.vehicle.boot.has_said_what_it_is() && !is_simulated(model)
}

fn refuse(model: &mut Model, now: Duration) {
    let why = "the vehicle is live: it does not report that it is simulated";
    model.say(now, Speaker::Ground, EventLevel::Error, format!("automatic mode refused: {why}"));
    model.auto_step = AutoStep::Done;
    model.outcome.refusal = Some((format!("the automatic mode: {why}"), now));
}

fn arm_if_ready(model: &mut Model, not_before: Duration, now: Duration) {
    let why_not = why_not_ready(model, not_before, now);
    let waited = model.link.first_heartbeat_at.map_or(Duration::ZERO, |at| now.saturating_sub(at));
    let within = if model.link.shares_our_id(now) { FREE_WITHIN } else { READY_WITHIN };
    match why_not {
        None => {
            model.info(now, "automatic mode: the checks pass; arming");
            model.auto_step = AutoStep::WaitForArmed;
            commands::submit(model, CommandKind::Arm, Seat::automatic(), now);
        }
        Some(why) if waited >= within => {
            let seconds = within.as_secs();
            model.warn(now, format!("automatic mode: gave up {seconds} s after first contact: {why}"));
            model.auto_step = AutoStep::Done;
            model.outcome.refusal = Some((format!("ARM not sent: {why}"), now));
        }
        Some(_) => {}
    }
}

fn why_not_ready(model: &Model, not_before: Duration, now: Duration) -> Option<String> {
    if let Some(why) = why_nothing_moves(model, now).filter(|_| model.vehicle.status.is_some()) {
        return Some(why);
    }
    let Some(status) = model.vehicle.status.as_ref() else {
        return Some("the vehicle has not reported its checks".to_owned());
    };
    if !is_simulated(model) {
        return Some("the vehicle has not reported that it is simulated".to_owned());
    }
    let failing = words::failed_checks(status.value.checks_failed);
    if status.is_stale(now) {
        Some("the vehicle no longer reports its checks".to_owned())
    } else if !failing.is_empty() {
        Some(format!("failing checks: {}", failing.join(", ")))
    } else if !model.link.uplink.is_proven(now) {
        Some(format!("the uplink is not proven: {}", model.link.uplink.why_unheard()))
    } else if status.value.phase != TdPhase::TD_PHASE_PAD_IDLE {
        Some(format!("phase {}", words::phase(status.value.phase)))
    } else if status.received_at < not_before {
        Some("temporarily refused, although no check fails".to_owned())
    } else {
        None
    }
}

fn start(model: &mut Model, now: Duration) {
    if let Some(why) = why_nothing_moves(model, now) {
        model.auto_step = AutoStep::Done;
        model.outcome.refusal = Some((format!("START not sent: {why}"), now));
        return model.warn(now, format!("automatic mode: not started: {why}"));
    }
    model.info(now, "automatic mode: starting");
    model.auto_step = AutoStep::Done;
    if model.vehicle.countdown_s().is_none() {
        commands::submit(model, CommandKind::Start, Seat::automatic(), now);
    }
}
