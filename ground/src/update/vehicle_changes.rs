//! Reports changes of the vehicle's state as events, and updates the outcome of the flight.

use std::time::Duration;

use protocol::dialect::{TdHold, TdPhase};
use protocol::log::record::EventLevel;

use super::{Action, checklist, commands};
use crate::model::command::is_aborted;
use crate::model::dialog::{Dialog, RestOfWord};
use crate::model::ending::Ending;
use crate::model::events::Speaker;
use crate::model::flight_so_far::FlightSoFar;
use crate::model::flown_path::FlownPath;
use crate::model::history::{History, Maxima};
use crate::model::motor::{Approach, Danger, KeepAway, hold_words};
use crate::model::parameters::Parameters;
use crate::model::uplink::Uplink;
use crate::model::vehicle::{Vehicle, Verdict, is_flight, is_on_pad};
use crate::model::{Model, latch, words};

/// The part of the vehicle's state whose changes are reported.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Announced {
    phase: Option<TdPhase>,
    armed: Option<bool>,
    counting: bool,
    aborted: bool,
    hold: Option<TdHold>,
    verdict: Option<Verdict>,
}

impl Announced {
    pub(super) fn of(vehicle: &Vehicle) -> Self {
        let on_pad = vehicle.phase().is_some_and(|phase| phase.value == TdPhase::TD_PHASE_PAD_ARMED);
        Self {
            phase: vehicle.phase().map(|phase| phase.value),
            armed: vehicle.armed().map(|armed| armed.value),
            counting: on_pad && vehicle.countdown_s().is_some(),
            aborted: vehicle.interlocks().is_some_and(is_aborted)
                || vehicle.heartbeat.is_some_and(|heartbeat| heartbeat.value.terminated),
            hold: vehicle.status.as_ref().map(|status| status.value.hold),
            verdict: vehicle.verdict.map(|verdict| verdict.value),
        }
    }
}

pub(super) fn on_reboot(model: &mut Model, now: Duration) {
    let number = model.vehicle.boot.number();
    let which = number.map_or_else(String::new, |number| format!(", boot {}", words::boot(number)));
    let what = if model.vehicle.boot.is_back() { "is heard alone again" } else { "has rebooted" };
    let text = format!("the vehicle {what}{which}: all earlier values are dropped");
    model.warn(now, text);
    model.outcome = FlightSoFar { error: model.outcome.error.take(), ..FlightSoFar::default() };
    model.history = History::default();
    model.parameters = Parameters::default();
    model.link.uplink = Uplink::default();
    model.link.round_trip = None;
    model.link.content = protocol::link_stats::ContentAge::default();
    model.alarms.vehicle_rebooted(now);
    model.rebooted_at = Some(now).filter(|_| !model.vehicle.boot.is_back());
    // An open dialog was opened for the former boot.
    let why = format!("{}: cancelled by the reboot", model.dialog.name());
    model.rest_of_word = RestOfWord::of(&model.dialog, None, why, now);
    model.dialog = Dialog::Closed;
    let void = commands::restart_after_reboot(model, now);
    if !void.is_empty() {
        let void = void.join(", ");
        model.warn(now, format!("void since the reboot: {void}"));
    }
}

pub(super) fn on_change(model: &mut Model, before: Announced, now: Duration) {
    let after = Announced::of(&model.vehicle);
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
        model.outcome.aborted_at = Some(now);
        let words = latch::words(model).unwrap_or_else(|| "ABORT LATCHED".to_owned());
        model.say(now, Speaker::Ground, EventLevel::Error, format!("the vehicle says {words}"));
        model.outbox.push(Action::SyncLog);
    }
    if let Some(verdict) = after.verdict
        && after.verdict != before.verdict
    {
        on_verdict(model, &verdict, now);
    }
    if after.hold != before.hold
        && let Some(text) = hold_words(&model.vehicle, model.link.uplink.armed_by_us)
    {
        model.say(now, Speaker::Ground, EventLevel::Error, text);
        model.outbox.push(Action::SyncLog);
    }
}

/// Reports whether people may approach, because the log must show when they may not. A waiting time ends without a word of
/// the vehicle, too.
pub(super) fn watch_approach(model: &mut Model, now: Duration) {
    let away = KeepAway::of(&model.vehicle, now);
    let approach = Approach::of(&model.vehicle, now);
    let told = (away.map(|away| away.danger), approach.map(|approach| approach.headline()));
    if std::mem::replace(&mut model.approach_told, told) == told {
        return;
    }
    match (approach, away) {
        (Some(Approach::May(why)), _) => model.info(now, format!("MAY BE APPROACHED: {why}")),
        (_, Some(away)) => {
            let level = if away.danger == Danger::Hot { EventLevel::Warning } else { EventLevel::Error };
            model.say(now, Speaker::Ground, level, format!("DO NOT APPROACH{}", away.reason()));
        }
        (Some(Approach::DoNot(_)) | None, None) => {}
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
    // The flight itself may have passed unheard.
    let after_it = !is_on_pad(phase) && before.is_some_and(is_on_pad);
    if after_it || (is_flight(phase) && !before.is_some_and(is_flight)) {
        if !model.outcome.started {
            model.vehicle.flown = FlownPath::default();
            model.vehicle.burn = FlownPath::default();
        }
        model.outcome.started = true;
        checklist::on_liftoff(model, now);
    }
    if phase == TdPhase::TD_PHASE_SAFED {
        model.outcome.safed_at = Some(now);
    }
}

fn on_verdict(model: &mut Model, verdict: &Verdict, now: Duration) {
    let level = if verdict.landed { EventLevel::Info } else { EventLevel::Error };
    let ending = Ending::of(&model.vehicle, now);
    let text = ending.map_or_else(String::new, |ending| ending.sentence(&model.vehicle));
    model.say(now, Speaker::Ground, level, text);
    model.outcome.started = true;
    model.outcome.verdict = Some((verdict.landed, now));
    model.outbox.push(Action::SyncLog);
}
