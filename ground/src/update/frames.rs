//! Handles every frame from the link.

use std::time::Duration;

use mavlink::MessageData as _;
use protocol::command::CommandAnswer;
use protocol::dialect::{
    GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavMessage, RADIO_STATUS_DATA, TD_UPLINK_DATA, TIMESYNC_DATA,
};
use protocol::frame::Frame;
use protocol::identity::{Address, RADIO};
use protocol::log::record::EventLevel;
use protocol::reported::boot_of;
use protocol::text::Text;

use super::{commands, pad, vehicle_changes};
use crate::model::{
    Action, Degrees, Model, Role, Sample, Speaker, StatusReport, Tracker, is_busy, may_be_ours, telemetry,
    time_boot_ms,
};

/// Maximum age, ms, of a frame by which another station still counts as using our address.
const SAME_ID_WITHIN_MS: u16 = 5_000;
/// The vehicle reports a station for 5 s after it has ended. The rest is for the report's latency.
const OUR_PAST_FOR: Duration = Duration::from_secs(7);
/// Number of other systems that are stored, so that each is reported once.
const STRANGERS_MAX: usize = 8;

pub(super) fn on_frame(model: &mut Model, frame: &Frame, now: Duration) {
    model.link.stats.on_frame(frame, now);
    if frame.message_id() == RADIO_STATUS_DATA::ID {
        if frame.source() == RADIO
            && let Ok(MavMessage::RADIO_STATUS(radio)) = frame.decode()
        {
            if let Some(test) = &mut model.range_test {
                test.note_radio(&radio);
            }
            model.link.radio = Some((radio, now));
        }
    } else if frame.source() == model.settings.us {
        // An echo of ours, unless its session is another.
        if let Ok(MavMessage::HEARTBEAT(beat)) = frame.decode()
            && beat.custom_mode != model.settings.session
            && model.settings.role != Role::Replaying
        {
            model.link.same_id_at = Some(now);
        }
    } else if frame.source() == model.settings.vehicle {
        on_vehicle_frame(model, frame, now);
        // After the frame is applied: it may show that the abort is latched.
        if model.commands.sender.on_received(now) {
            commands::poll(model, now);
        }
    } else if frame.message_id() == GLOBAL_POSITION_INT_DATA::ID
        && frame.source().system_id != model.settings.vehicle.system_id
    {
        note_tracker(model, frame, now);
    } else if frame.message_id() == HEARTBEAT_DATA::ID {
        note_stranger(model, frame.source(), now);
    }
}

/// Notes the position of another system. It is drawn, and has no other effect.
fn note_tracker(model: &mut Model, frame: &Frame, now: Duration) {
    let Ok(MavMessage::GLOBAL_POSITION_INT(data)) = frame.decode() else { return };
    let (id, at) = (frame.source().system_id, Degrees::of_e7(data.lat, data.lon));
    let (is_new, has_room) = (!model.trackers.contains_key(&id), model.trackers.len() < STRANGERS_MAX);
    let Some(at) = at.filter(|_| has_room || !is_new) else { return };
    let height_m = f64::from(data.relative_alt) * 1e-3;
    model.trackers.insert(id, Tracker { at: Sample::new(at, now), height_m });
    if is_new {
        model.info(now, format!("system {id} reports its position: map and page Find show it"));
    }
}

fn note_stranger(model: &mut Model, source: Address, now: Duration) {
    let strangers = &mut model.link.strangers;
    if strangers.len() < STRANGERS_MAX && !strangers.contains(&source) {
        strangers.push(source);
        let Address { system_id, component_id } = source;
        let which = format!("system {system_id} component {component_id}");
        model.info(now, format!("{which} is also on the link; not shown"));
    }
}

fn on_vehicle_frame(model: &mut Model, frame: &Frame, now: Duration) {
    model.link.last_frame_at = Some(now);
    if let Some(answer) = CommandAnswer::from_frame(frame) {
        if model.settings.us.accepts(answer.target) {
            commands::on_answer(model, answer, now);
        }
        return;
    }
    let Ok(message) = frame.decode() else {
        model.link.undecodable += 1;
        return;
    };
    let named = boot_of(frame);
    // From a sender that is not identified yet, only texts and another autopilot's heartbeat are
    // accepted.
    let is_unidentified = match &message {
        MavMessage::HEARTBEAT(beat) if !may_be_ours(beat) => false,
        MavMessage::TD_FLIGHT_STATUS(_) | MavMessage::STATUSTEXT(_) => false,
        message => {
            // Our vehicles' heartbeats always name a boot: one without is another vehicle's.
            let named = named.or(matches!(message, MavMessage::HEARTBEAT(_)).then_some(0));
            named.is_some_and(|boot| model.boots.is_stray(boot))
                || model.boots.is_strange(model.link.source, now)
        }
    };
    if is_unidentified {
        return;
    }
    // Which vehicle has sent it, and since which power-up; `None` before the first flight status.
    let sender = match &message {
        MavMessage::TD_FLIGHT_STATUS(status) => {
            let report = StatusReport {
                uid: status.vehicle_uid,
                boot: status.boot_number,
                clock_ms: status.time_boot_ms,
                sequence: frame.sequence(),
                source: model.link.source,
            };
            if model.boots.disowns(&report, now) {
                return;
            }
            Some(model.boots.identify(&report, now))
        }
        // Another autopilot's heartbeat beside ours is stored with the shown vehicle.
        MavMessage::HEARTBEAT(beat) if !may_be_ours(beat) => model.boots.shown(),
        message => {
            let evidence = (named, time_boot_ms(message), frame.sequence());
            model.boots.sender(model.link.source, evidence, now)
        }
    };
    if let Some(other) = sender.filter(|boot| model.boots.shown() != Some(*boot)) {
        // Answers and texts go to the crew, whoever sends them; all else of another vehicle is
        // stored beside.
        if !matches!(message, MavMessage::STATUSTEXT(_)) {
            let vehicle = model.others.entry(other).or_default();
            telemetry::apply(vehicle, &message, now);
            model.boots.note(other, is_busy(vehicle, now));
            vehicle_changes::settle(model, now);
            return;
        }
    }
    model.link.date(&message, model.vehicle.boot.is_simulated(), now);
    match &message {
        MavMessage::STATUSTEXT(chunk) => {
            for text in model.texts.push(frame.source(), chunk, now) {
                add_vehicle_text(model, &text, now);
            }
            return;
        }
        MavMessage::TD_BOOK_KEPT(data) => return vehicle_changes::on_book_confirmed(model, data),
        MavMessage::TD_UPLINK(data) => return on_uplink(model, data, now),
        MavMessage::TIMESYNC(data) => return on_timesync(model, data, frame.source(), now),
        MavMessage::HEARTBEAT(_) => {
            model.link.first_heartbeat_at.get_or_insert(now);
            if std::mem::take(&mut model.link.loss_reported) {
                model.info(now, "link restored: telemetry again");
            }
        }
        _ => {}
    }
    let before = vehicle_changes::Announced::of(&model.vehicle);
    telemetry::apply(&mut model.vehicle, &message, now);
    if let Some(shown) = model.boots.shown() {
        model.boots.note(shown, is_busy(&model.vehicle, now));
    }
    let after = vehicle_changes::Announced::of(&model.vehicle);
    vehicle_changes::on_change(model, &before, &after, now);
    model.vehicle.events.date(&mut model.history.timeline);
    vehicle_changes::enter_crew_changes(model, &before, &after, now);
    pad::enter_check(model, now);
    commands::observe(model, now);
}

pub(super) fn add_vehicle_text(model: &mut Model, text: &Text, now: Duration) {
    if text.text.starts_with(vehicle_changes::RESTARTED) {
        let in_flight = text.text.ends_with(vehicle_changes::IN_FLIGHT);
        model.vehicle.reset_in_flight |= in_flight;
        let on_pad = || vehicle_changes::Announced::of(&model.vehicle).words_of_reset();
        let did = if in_flight { vehicle_changes::IN_FLIGHT } else { on_pad() };
        vehicle_changes::note_reset(model, did, now);
    }
    model.vehicle.note_check_text(&text.text);
    let level = EventLevel::of_severity(text.severity);
    model.add_event(now, Speaker::Vehicle, level, text.text.clone());
}

/// A report of the vehicle about its uplink. Without a target it concerns every station: the
/// vehicle has not accepted any frame yet. A station accepts a report about its session only:
/// another station may have its address. The session is unknown in a replay.
fn on_uplink(model: &mut Model, data: &TD_UPLINK_DATA, now: Duration) {
    let target = Address { system_id: data.target_system, component_id: data.target_component };
    let to_all = target == Address { system_id: 0, component_id: 0 };
    let Model { settings, link, .. } = model;
    if !settings.us.accepts(target) {
        return link.uplink.on_other_report(data);
    }
    let is_ours = to_all || data.session == settings.session || settings.role == Role::Replaying;
    let another = data.session != 0 && data.accepted_age_ms <= SAME_ID_WITHIN_MS;
    // Until then it may be this station before it was started again; meanwhile the vehicle refuses
    // to arm.
    let is_past_grace = now >= OUR_PAST_FOR && settings.role != Role::Replaying;
    if is_past_grace && (data.same_id > 0 || (!is_ours && another)) {
        let age = if is_ours { 0 } else { data.accepted_age_ms };
        let at = now.saturating_sub(Duration::from_millis(age.into()));
        link.same_id_at = link.same_id_at.max(Some(at));
    }
    if is_ours {
        link.uplink.on_report(data, now);
    } else {
        link.uplink.on_other_report(data);
    }
}

fn on_timesync(model: &mut Model, data: &TIMESYNC_DATA, source: Address, now: Duration) {
    let ours = i64::try_from(now.as_nanos()).unwrap_or(i64::MAX);
    // A request or answer for another station does not concern us.
    let target = Address { system_id: data.target_system, component_id: data.target_component };
    if !model.settings.us.accepts(target) {
        return;
    }
    if data.tc1 == 0 {
        model.outbox.push(Action::send(MavMessage::TIMESYNC(TIMESYNC_DATA {
            tc1: ours,
            ts1: data.ts1,
            target_system: source.system_id,
            target_component: source.component_id,
        })));
    } else if model.settings.role == Role::Station && !model.link.timesync_stamps.contains(&data.ts1) {
        // The answer to another station under our id: with it, new telemetry would look old.
    } else if let Some(nanoseconds) = ours.checked_sub(data.ts1).and_then(|round| u64::try_from(round).ok()) {
        let round_trip = Duration::from_nanos(nanoseconds);
        // A longer time belongs to a request that was given up.
        if let Some(test) = &mut model.range_test {
            test.answered(data.ts1);
        }
        if round_trip < Duration::from_secs(10) {
            if let Ok(clock_ns) = u64::try_from(data.tc1) {
                let requested_at = now.saturating_sub(round_trip);
                model.link.content.answered(Duration::from_nanos(clock_ns), requested_at, now);
            }
            model.link.round_trip = Some(round_trip);
            model.link.uplink.answered(now.saturating_sub(round_trip));
        }
    }
}
