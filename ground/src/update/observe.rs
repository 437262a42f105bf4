//! What changed on the vehicle, said in words, and what it means for the flight's outcome.

use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::log::record::EventLevel;

use super::{Action, commands};
use crate::model::command::{CommandKind, is_aborted};
use crate::model::events::Speaker;
use crate::model::flown::Flown;
use crate::model::history::{History, Maxima};
use crate::model::outcome::Outcome;
use crate::model::parameters::Parameters;
use crate::model::vehicle::{Vehicle, Verdict, is_flight};
use crate::model::{Model, words};

/// What of the vehicle's state is announced when it changes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Facts {
    phase: Option<TdPhase>,
    armed: Option<bool>,
    counting: bool,
    aborted: bool,
    verdict: Option<Verdict>,
}

impl Facts {
    pub(super) fn of(vehicle: &Vehicle) -> Self {
        let on_pad = vehicle.phase().is_some_and(|phase| phase.value == TdPhase::TD_PHASE_PAD_ARMED);
        Self {
            phase: vehicle.phase().map(|phase| phase.value),
            armed: vehicle.armed().map(|armed| armed.value),
            counting: on_pad && vehicle.countdown_s().is_some(),
            aborted: vehicle.interlocks().is_some_and(is_aborted),
            verdict: vehicle.verdict.map(|verdict| verdict.value),
        }
    }
}

pub(super) fn on_reboot(model: &mut Model, now: Duration) {
    model.warn(now, "the vehicle has rebooted: everything known of it before is forgotten");
    model.outcome = Outcome { error: model.outcome.error.take(), ..Outcome::default() };
    model.history = History::default();
    model.parameters = Parameters::default();
    model.rebooted_at = Some(now);
    // What was asked of the vehicle before its reboot is not asked of it afterwards; an abort is.
    let aborting = model.commands.is_aborting();
    model.commands.sender.withdraw_all(now);
    model.commands.tracks.retain(|track| track.kind == CommandKind::Abort && aborting);
    if aborting {
        model.commands.abort_again_at = Some(now);
        commands::poll(model, now);
    }
}

pub(super) fn on_change(model: &mut Model, before: Facts, now: Duration) {
    let after = Facts::of(&model.vehicle);
    if after == before {
        return;
    }
    if after.armed != before.armed
        && let Some(armed) = after.armed
    {
        model.info(now, if armed { "armed (HEARTBEAT)" } else { "disarmed (HEARTBEAT)" });
    }
    if let Some(phase) = after.phase
        && after.phase != before.phase
    {
        on_phase(model, before.phase, phase, now);
    }
    if after.counting && !before.counting {
        model.info(now, "countdown runs");
    }
    if after.aborted && !before.aborted {
        model.say(now, Speaker::Ground, EventLevel::Error, "the vehicle has latched an abort");
        model.outcome.aborted_at = Some(now);
        model.outbox.push(Action::SyncLog);
    }
    if let Some(verdict) = after.verdict
        && after.verdict != before.verdict
    {
        on_verdict(model, &verdict, now);
    }
}

fn on_phase(model: &mut Model, before: Option<TdPhase>, phase: TdPhase, now: Duration) {
    let from = before.map_or_else(String::new, |before| format!("{} -> ", words::phase(before)));
    if is_flight(phase) && !before.is_some_and(is_flight) && !model.outcome.started {
        model.history.maxima = Maxima::default();
    }
    model.history.note_phase(phase, now);
    model.info(now, format!("phase {from}{}", words::phase(phase)));
    model.outbox.push(Action::SyncLog);
    if is_flight(phase) && !before.is_some_and(is_flight) {
        if !model.outcome.started {
            model.vehicle.flown = Flown::default();
            model.vehicle.burn = Flown::default();
        }
        model.outcome.started = true;
    }
    if phase == TdPhase::TD_PHASE_SAFED {
        model.outcome.safed_at = Some(now);
    }
}

fn on_verdict(model: &mut Model, verdict: &Verdict, now: Duration) {
    let (level, text) = match (verdict.landed, verdict.touchdown.violations()) {
        (true, _) => (EventLevel::Info, "LANDED inside every limit".to_owned()),
        (false, Some(names)) => (EventLevel::Error, format!("NOT LANDED: outside {names}")),
        (false, None) => (EventLevel::Error, "NOT LANDED".to_owned()),
    };
    model.say(now, Speaker::Ground, level, text);
    model.outcome.started = true;
    model.outcome.verdict = Some((verdict.landed, now));
    model.outbox.push(Action::SyncLog);
}
