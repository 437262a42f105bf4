//! The work of each tick: heartbeats, resends, time limits, the loss of the link, the end of a run.

use std::time::Duration;

use protocol::dialect::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavState, MavType};
use protocol::log::record::Record;
use protocol::log::v1::Telemetry;

use super::{commands, frames, keys, pad, vehicle_changes};
use crate::model::{
    Action, LinkState, Model, Role, dead_reckoning::may_have_left, is_on_pad, link_hints, note_trace,
};

const HEARTBEAT_EVERY: Duration = Duration::from_secs(1);
/// An armed vehicle holds its countdown after 1 s without an uplink. With ten heartbeats in that
/// time and 25 % loss, all are lost once in a million times.
const FAST_HEARTBEAT_EVERY: Duration = Duration::from_millis(100);
const TIMESYNC_EVERY: Duration = Duration::from_secs(5);
/// For a vehicle whose answers are the only proof of the uplink.
const PROVING_TIMESYNC_EVERY: Duration = Duration::from_secs(1);
const SEEMS_OLD: Duration = Duration::from_secs(1);
const TELEMETRY_RECORD_EVERY: Duration = Duration::from_millis(100);
/// Silence of an armed vehicle after which the station reports its downlink as lost. The vehicle
/// must receive that report 1 s after the loss: the rest is for the next heartbeat's latency.
const DEAF_AFTER: Duration = Duration::from_millis(800);
/// Without a screen: how long the program waits for further messages after a flight.
const WAIT_AFTER_FLIGHT: Duration = Duration::from_secs(2);
/// Without a screen: how long the program waits for a lost link to return.
const LOST_FOR_GOOD: Duration = Duration::from_secs(10);

pub(super) fn on_tick(model: &mut Model, now: Duration) {
    // An attached screen has its own ticks for its keys; the ticks of the station are only repeated
    // there.
    if matches!(model.settings.role, Role::Station | Role::Replaying) {
        keys::pass(model, now);
    }
    heartbeat(model, now);
    let has_vehicle = model.link.first_heartbeat_at.is_some();
    // An age that seems large is measured again soon: the vehicle's clock may have lost time.
    let seems_old = !matches!(model.link.down(now), LinkState::Alive(age) if age < SEEMS_OLD);
    let often = seems_old || !model.link.uplink.is_reported;
    let timesync_every = if often { PROVING_TIMESYNC_EVERY } else { TIMESYNC_EVERY };
    if has_vehicle && is_due(&mut model.due.timesync, timesync_every, now) {
        model.request_time(i64::try_from(now.as_nanos()).unwrap_or(i64::MAX));
    }
    for text in model.texts.expire(now) {
        frames::add_vehicle_text(model, &text, now);
    }
    note_loss(model, now);
    if !model.link.hints_reported
        && let Some(hints) = link_hints(model, now)
    {
        model.link.hints_reported = true;
        model.warn(now, hints.join(" "));
    }
    note_trace(model, now);
    // Bells apart from each other can be counted.
    if model.called.bells_left > 0 {
        model.called.bells_left -= 1;
        model.outbox.push(Action::Bell);
    }
    commands::step_auto(model, now);
    commands::poll(model, now);
    commands::observe(model, now);
    commands::hold_if_unfit(model, now);
    pad::pass_range_test(model, None, now);
    vehicle_changes::send_book_end(model, now);
    store_place(model, now);
    vehicle_changes::store_unfinished(model, now);
    if has_vehicle && is_due(&mut model.due.telemetry_record, TELEMETRY_RECORD_EVERY, now) {
        let telemetry = Telemetry {
            link_age_s: model.link.last_frame_at.map(|at| now.saturating_sub(at).as_secs_f64()),
            link_loss: model.link.loss(now),
            link_rx_bytes_s: Some(model.link.stats.figures(now).rx_bytes_s),
            ..model.vehicle.reported.record(now.as_secs_f64())
        };
        model.outbox.push(Action::Record(Record::Telemetry(Box::new(telemetry))));
    }
    if !model.settings.interactive
        && let Some(why) = why_end(model, now)
    {
        model.info(now, why);
        model.outbox.push(Action::Quit);
    }
}

/// Counts from the time that was last due, so that late ticks do not lower the rate, and a shorter
/// interval is in force at once.
fn is_due(last: &mut Option<Duration>, every: Duration, now: Duration) -> bool {
    let due = last.map_or(now, |last| last.min(now) + every);
    if now < due {
        return false;
    }
    *last = Some(due.max(now.saturating_sub(every / 2)));
    true
}

/// Whether the vehicle must receive frequent heartbeats: it is armed on the pad, and not by another
/// station, or is about to be. A countdown may still run after the downlink is lost.
fn needs_fast_heartbeats(model: &Model, now: Duration) -> bool {
    let is_received = model.link.state(now).carries();
    let on_pad = model.vehicle.phase_now().is_some_and(is_on_pad);
    let counts = model.vehicle.countdown_s().is_some() && may_have_left(&model.vehicle, now).is_none();
    let armed = model.vehicle.is_armed() && model.link.uplink.armed_by_other.is_none();
    on_pad && ((armed && (is_received || counts)) || (is_received && model.dialog.is_some()))
}

/// Whether no telemetry arrives from a vehicle that is armed on the pad, or only stale data.
fn is_deaf(model: &Model, now: Duration) -> bool {
    let last = model.link.last_frame_at.map(|at| model.link.uplink.pace.of_the_vehicle(at, now));
    let silent = last.is_none_or(|at| now.saturating_sub(at) >= DEAF_AFTER);
    let old = matches!(model.link.down(now), LinkState::Lost(_));
    model.vehicle.is_armed() && (silent || old)
}

/// Heartbeats are sent from the run loop, so that a hanging ground station sends none.
fn heartbeat(model: &mut Model, now: Duration) {
    let every = if needs_fast_heartbeats(model, now) { FAST_HEARTBEAT_EVERY } else { HEARTBEAT_EVERY };
    if is_due(&mut model.due.heartbeat, every, now) {
        let system_status =
            if is_deaf(model, now) { MavState::MAV_STATE_CRITICAL } else { MavState::MAV_STATE_ACTIVE };
        model.outbox.push(Action::send(MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: model.settings.session,
            mavtype: MavType::MAV_TYPE_GCS,
            autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
            base_mode: MavModeFlag::empty(),
            system_status,
            mavlink_version: 3,
        })));
    }
}

fn note_loss(model: &mut Model, now: Duration) {
    let since = model.link.alive_since.unwrap_or(now);
    model.link.alive_since = model.link.state(now).carries().then_some(since);
    if let LinkState::Lost(age) = model.link.state(now)
        && !model.link.loss_reported
    {
        model.link.loss_reported = true;
        let text = format!("LINK LOST: no telemetry for {:.1} s", age.as_secs_f64());
        model.error(now, text);
    }
}

/// Why a run without a screen ends now; `None` while it continues.
fn why_end(model: &Model, now: Duration) -> Option<String> {
    let outcome = &model.outcome;
    let past = |at: Duration| now.saturating_sub(at) >= WAIT_AFTER_FLIGHT;
    let on_ground = model.vehicle.phase().is_some_and(|phase| !crate::model::is_flight(phase.value));
    let is_over = outcome.verdict.is_some_and(|(_, at)| past(at)) || outcome.safed_at.is_some_and(past);
    let refused = outcome.refusal.as_ref().filter(|(_, at)| model.settings.auto && past(*at));
    let why = match model.link.state(now) {
        _ if outcome.error.is_some() => "the run cannot continue",
        _ if is_over => "the flight has ended",
        _ if outcome.aborted_at.is_some_and(past) && on_ground => "the flight was aborted",
        _ if let Some((what, _)) = refused => return Some(format!("refused: {what}")),
        LinkState::Lost(age) if age >= LOST_FOR_GOOD => "the link is lost",
        LinkState::NeverReceived if model.settings.auto && now >= LOST_FOR_GOOD => "no vehicle was received",
        _ => {
            let limit = model.settings.time_limit.filter(|limit| now >= *limit)?;
            return Some(format!("time limit: the flight did not end within {:.0} s", limit.as_secs_f64()));
        }
    };
    Some(why.to_owned())
}

// Has the last position of the vehicle stored, so that a lost vehicle can be found also after a
// restart.

/// How often it is stored in flight.
const PLACE_STORED_EVERY: Duration = Duration::from_secs(2);

pub(super) fn store_place(model: &mut Model, now: Duration) {
    if model.place_due.is_some_and(|due| now < due) {
        return;
    }
    model.place_due = Some(now + PLACE_STORED_EVERY);
    let place = model.last_place(now).filter(|place| model.place.as_ref() != Some(place));
    let Some(place) = place else { return };
    model.place = Some(place);
    if model.settings.role == Role::Station {
        model.outbox.push(Action::StorePlace(Box::new(place)));
    }
}
