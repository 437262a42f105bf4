//! Reports changes of the vehicle's state as events and in the book, and updates the outcome of the
//! flight.

use std::time::Duration;

use protocol::dialect::{MavMessage, TD_BOOK_KEPT_DATA, TD_CREW_DATA, TdAct, TdHold, TdLanding, TdPhase};
use protocol::identity::Address;
use protocol::log::record::EventLevel;

use super::{commands, pad};
use crate::model::{
    Action, Approach, CommandKind, Danger, Ending, FlightSoFar, FlownMission, History, KeepAway, Model,
    RestOfWord, Role, Sample, Seat, Speaker, TIMELINE_MAX, Uplink, Vehicle, Verdict, hold_words, is_aborted,
    is_flight, is_on_pad, latch_words, words,
};

/// The part of the vehicle's state whose changes are reported.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Announced {
    phase: Option<TdPhase>,
    armed: Option<bool>,
    counting: bool,
    /// The phase by the flight status, which names its boot, and whether it counted down. A
    /// heartbeat may be of another boot.
    status: Option<(TdPhase, bool)>,
    aborted: bool,
    hold: Option<TdHold>,
    verdict: Option<Verdict>,
    /// Its reports of its crew and its mission.
    crew: TD_CREW_DATA,
    mission: Option<FlownMission>,
}

impl Announced {
    pub(super) fn of(vehicle: &Vehicle) -> Self {
        let on_pad = vehicle.phase_now() == Some(TdPhase::TD_PHASE_PAD_ARMED);
        Self {
            phase: vehicle.phase_now(),
            armed: vehicle.armed().map(|armed| armed.value),
            counting: on_pad && vehicle.countdown_s().is_some(),
            status: vehicle.status.as_ref().map(|status| (status.value.phase, vehicle.counts_down())),
            aborted: vehicle.interlocks().is_some_and(is_aborted)
                || vehicle.heartbeat.is_some_and(|heartbeat| heartbeat.value.terminated),
            hold: vehicle.status.as_ref().map(|status| status.value.hold),
            verdict: vehicle.verdict().map(|verdict| verdict.value),
            crew: vehicle.last().map(|crew| crew.value).unwrap_or_default(),
            mission: vehicle.mission(),
        }
    }

    /// The vehicle's state when it was reset.
    pub(super) fn words_of_reset(&self) -> &'static str {
        match self.status {
            Some((TdPhase::TD_PHASE_PAD_ARMED, true)) => " in the countdown",
            Some((TdPhase::TD_PHASE_PAD_ARMED, false)) => " while it was armed",
            Some((phase, _)) if is_flight(phase) => " in flight",
            _ => "",
        }
    }
}

/// The vehicle's text about a restart of its flight computer.
pub const RESTARTED: &str = "the flight computer has restarted";
/// The end of that text, unless it happened on the pad.
pub(super) const IN_FLIGHT: &str = " IN FLIGHT";
/// Reports of one reset arrive within this time.
const ONE_RESET: Duration = Duration::from_secs(5);

/// Shows another boot if one takes the screen.
pub(super) fn settle(model: &mut Model, now: Duration) {
    let Some(former) = model.boots.shown() else { return };
    let Some(shown) = model.boots.settle(now) else { return };
    let vehicle = model.others.remove(&shown).unwrap_or_default();
    let mut before = std::mem::replace(&mut model.vehicle, vehicle);
    let away = KeepAway::of(&before, now);
    model.vehicle.before = away.map(|away| Sample::new(away, now)).or(model.vehicle.before);
    model.vehicle.foreign = before.foreign.take();
    let is_reset = model.boots.follows(shown, former);
    let did = is_reset.then(|| Announced::of(&before).words_of_reset());
    model.others.insert(former, before);
    let Model { boots, others, .. } = model;
    others.retain(|id, _| boots.age(*id, now).is_some());
    on_shown(model, did, now);
    let after = Announced::of(&model.vehicle);
    on_change(model, &Announced::default(), &after, now);
}

/// Has the unfinished state stored when it has changed. A demonstration ends with its vehicle.
pub(super) fn store_unfinished(model: &mut Model, now: Duration) {
    model.vehicle.end_before(now);
    // Commanded again, or observed: the one before is no longer open.
    if model.vehicle.interlocks().is_some_and(is_aborted) || model.commands.of(CommandKind::Abort).is_some() {
        model.abort_before = None;
    }
    if model.settings.role != Role::Station || model.settings.demonstration {
        return;
    }
    let present = model.unfinished(now);
    // Once a position is stored, nothing is stored explicitly, too: then a missing file shows.
    let is_missing = model.stored_unfinished.is_none() && model.place.is_some();
    if is_missing || present != model.stored_unfinished.clone().unwrap_or_default() {
        model.stored_unfinished = Some(present.clone());
        model.outbox.push(Action::StoreUnfinished(present));
    }
}

/// The crew shows and commands this boot, of several vehicles under one id.
pub(super) fn choose(model: &mut Model, boot: u32, by: &Seat, now: Duration) {
    let name = words::boot(boot);
    if model.boots.choose(boot, now) {
        model.record_operator(now, "chose", by, &format!("the vehicle of boot {name}{}", by.in_brackets()));
        model.warn(now, format!("boot {name} was chosen: it is shown and commanded"));
        settle(model, now);
    } else {
        let why = "it is not received, or more than one vehicle has it";
        model.warn(now, format!("boot {name} is not chosen: {why}"));
    }
}

/// The flight computer has restarted within one power-up, by its text, or by a return to its
/// self-test. Both report one reset.
pub(super) fn note_reset(model: &mut Model, did: &'static str, now: Duration) {
    if model.rebooted.as_ref().is_some_and(|(_, at)| now.saturating_sub(*at) < ONE_RESET) {
        return;
    }
    let text = format!("the flight computer has restarted{did}");
    model.error(now, text);
    model.rebooted = Some((did, now));
    model.outbox.push(Action::SyncLog);
}

/// Another boot is shown: after a reset, with the vehicle's state then, or of another vehicle.
fn on_shown(model: &mut Model, reset: Option<&'static str>, now: Duration) {
    let number = model.vehicle.boot.number();
    let which = number.map_or_else(String::new, |number| format!(", boot {}", words::boot(number)));
    let text = match reset {
        Some(did) => format!("the vehicle has rebooted{did}{which}: all earlier values are dropped"),
        None => format!("another vehicle is shown{which}"),
    };
    model.warn(now, text);
    model.outcome = FlightSoFar { error: model.outcome.error.take(), ..FlightSoFar::default() };
    model.history = History::default();
    model.link.uplink = Uplink::default();
    model.link.round_trip = None;
    // It has time to report its uplink.
    model.link.alive_since = None;
    model.link.content = protocol::link_stats::ContentAge::default();
    // A vehicle that was switched on again has a new log, without any entry of the book.
    model.book.confirmed = 0;
    model.alarms.vehicle_rebooted(now);
    model.rebooted = reset.map(|did| (did, now));
    // An open dialog was opened for the former boot.
    model.rest_of_word = model.dialog.take().and_then(|dialog| {
        let why = format!("{}: cancelled by the reboot", dialog.prompt.name());
        RestOfWord::of(&dialog, None, why, now)
    });
    let void = commands::restart_after_reboot(model, now);
    if !void.is_empty() {
        let void = void.join(", ");
        model.warn(now, format!("void since then: {void}"));
    }
}

pub(super) fn on_change(model: &mut Model, before: &Announced, after: &Announced, now: Duration) {
    if after == before {
        return;
    }
    if after.armed != before.armed
        && let Some(armed) = after.armed
    {
        model.info(now, if armed { "armed (HEARTBEAT)" } else { "disarmed (HEARTBEAT)" });
    }
    // Only a restart leads there.
    let tests_itself =
        |status: Option<(TdPhase, bool)>| status.map(|(phase, _)| phase == TdPhase::TD_PHASE_SAFE);
    if (tests_itself(before.status), tests_itself(after.status)) == (Some(false), Some(true)) {
        note_reset(model, before.words_of_reset(), now);
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
        let words = latch_words(model).unwrap_or_else(|| "ABORT LATCHED".to_owned());
        model.error(now, format!("the vehicle reports {words}"));
        model.outbox.push(Action::SyncLog);
    }
    if let Some(verdict) = after.verdict
        && after.verdict != before.verdict
    {
        on_verdict(model, &verdict, now);
    }
    if after.hold != before.hold
        && let Some(text) = hold_words(model)
    {
        model.error(now, text);
        model.outbox.push(Action::SyncLog);
    }
}

/// Reports whether people may approach, because the log must show when they may not. A waiting time
/// ends without a message of the vehicle, too.
pub(super) fn watch_approach(model: &mut Model, now: Duration) {
    let away = KeepAway::of(&model.vehicle, now);
    let approach = Approach::of(&model.vehicle, now);
    let approach_now = (away.map(|away| away.danger), approach.map(|approach| approach.headline()));
    if std::mem::replace(&mut model.reported_approach, approach_now) == approach_now {
        return;
    }
    match (approach, away) {
        (Some(Approach::May(why)), _) => model.info(now, format!("MAY BE APPROACHED: {why}")),
        (_, Some(away)) => {
            let level = if away.danger == Danger::Hot { EventLevel::Warning } else { EventLevel::Error };
            model.add_event(now, Speaker::Ground, level, away.sentence());
        }
        (Some(Approach::Away(_)) | None, None) => {}
    }
}

fn on_phase(model: &mut Model, before: Option<TdPhase>, phase: TdPhase, now: Duration) {
    let from = before.map_or_else(String::new, |before| format!("{} -> ", words::phase(before)));
    if is_flight(phase) && !before.is_some_and(is_flight) && !model.outcome.started {
        model.history.silence = Duration::ZERO;
    }
    let timeline = &mut model.history.timeline;
    if timeline.len() < TIMELINE_MAX && timeline.last().is_none_or(|(last, _)| *last != phase) {
        timeline.push((phase, now));
    }
    model.info(now, format!("phase {from}{}", words::phase(phase)));
    model.outbox.push(Action::SyncLog);
    // The flight itself may have passed in silence.
    let after_it = !is_on_pad(phase) && before.is_some_and(is_on_pad);
    if after_it || (is_flight(phase) && !before.is_some_and(is_flight)) {
        if !model.outcome.started {
            model.vehicle.flown.clear();
        }
        model.outcome.started = true;
        pad::reopen_checklist(model, now);
    }
    if phase == TdPhase::TD_PHASE_SAFED {
        model.outcome.safed_at = Some(now);
    }
}

fn on_verdict(model: &mut Model, verdict: &Verdict, now: Duration) {
    let stands = verdict.landing.contains(TdLanding::TD_LANDING_STANDS);
    let level = if stands { EventLevel::Info } else { EventLevel::Error };
    let ending = Ending::of(&model.vehicle, now);
    let text = ending.map_or_else(String::new, |ending| ending.sentence(&model.vehicle));
    model.add_event(now, Speaker::Ground, level, text);
    model.outcome.started = true;
    model.outcome.verdict = Some((stands, now));
    model.outbox.push(Action::SyncLog);
}

// Sends the vehicle the end of the station's book until it has confirmed it, and enters the
// vehicle's reports of its crew.

/// How often the end is sent at most.
const SENT_EVERY: Duration = Duration::from_secs(2);

/// Sends the end again while telemetry arrives and the vehicle has not confirmed it.
pub(super) fn send_book_end(model: &mut Model, now: Duration) {
    let confirmed = model.book.confirmed;
    let Some(head) = model.book.head.filter(|signed| signed.head.entries > confirmed) else { return };
    let due = model.book.sent_at.is_none_or(|at| now.saturating_sub(at) >= SENT_EVERY);
    if due && model.link.state(now).carries() {
        model.book.sent_at = Some(now);
        let message = head.message(model.settings.vehicle);
        model.outbox.push(Action::send(MavMessage::TD_BOOK_HEAD(message)));
    }
}

pub(super) fn on_book_confirmed(model: &mut Model, report: &TD_BOOK_KEPT_DATA) {
    let target = Address { system_id: report.target_system, component_id: report.target_component };
    let ours = model
        .book
        .head
        .is_some_and(|signed| signed.head.book == report.book && report.entries <= signed.head.entries);
    if model.settings.us.accepts(target) && ours {
        model.book.confirmed = model.book.confirmed.max(report.entries);
    }
}

/// Enters the vehicle's reports of its crew and its mission, if they have changed.
pub(super) fn enter_crew_changes(model: &mut Model, before: &Announced, after: &Announced, now: Duration) {
    let (mission, former) = (&after.mission, &before.mission);
    let holds = [before, after].map(|state| (state.hold, state.crew.held_by));
    let (after, before) = (&after.crew, &before.crew);
    let mut lines: Vec<(u8, String)> = Vec::new();
    if after.people != before.people {
        lines.push((0, format!("an arming and a start take {} of the crew", after.people)));
    }
    let proposal = |crew: &TD_CREW_DATA| (crew.act, crew.ask_number, crew.asked_by);
    if after.act != TdAct::TD_ACT_NONE && proposal(after) != proposal(before) {
        let act = if after.act == TdAct::TD_ACT_START { "start" } else { "arm" };
        lines.push((after.asked_by, format!("requests to {act} (request {})", after.ask_number)));
    }
    let roles = [
        (after.commanded_by, before.commanded_by, "is in command"),
        (after.tapped_by, before.tapped_by, "confirmed the start and taps"),
    ];
    for (after, before, words) in roles {
        if after != before && after > 0 {
            lines.push((after, words.to_owned()));
        }
    }
    if let Some(mission) = mission.as_ref().filter(|_| mission != former) {
        lines.push((0, format!("it flies the mission {} {}", mission.in_words(), mission.hash)));
    }
    if holds[0] != holds[1]
        && let (Some(hold), by @ 1..) = holds[1]
    {
        // A silence is no act of a person.
        let whose = format!("of {} (key {by})", model.operator(by));
        match hold {
            TdHold::TD_HOLD_COMMANDED => lines.push((by, "requested the hold".to_owned())),
            TdHold::TD_HOLD_TAP_OVERDUE => lines.push((0, format!("HOLD: no tap {whose}"))),
            TdHold::TD_HOLD_UPLINK_SILENT => lines.push((0, format!("HOLD: station {whose} not received"))),
            TdHold::TD_HOLD_STATION_DEAF => {
                lines.push((0, format!("HOLD: station {whose} receives nothing")));
            }
            TdHold::TD_HOLD_NONE | TdHold::TD_HOLD_CHECK_FAILED => {}
        }
    }
    for (by, words) in lines {
        let boot = model.boot_beside_others(now);
        let who = if by > 0 { format!("{} {boot}", model.operator(by)).trim_end().to_owned() } else { boot };
        let text = if by > 0 { format!("key {by}: {words}") } else { words };
        model.enter("vehicle says", &who, &text);
    }
}
