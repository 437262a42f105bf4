//! Tells the vehicle the end of the station's book until it has confirmed it, and enters what the vehicle says of its
//! crew.

use std::time::Duration;

use protocol::book::SignedHead;
use protocol::dialect::{MavMessage, TD_BOOK_KEPT_DATA, TdAct};
use protocol::identity::Address;
use protocol::mission::MissionHash;

use super::Action;
use crate::model::Model;

/// How often the end is sent at most.
const SENT_EVERY: Duration = Duration::from_secs(2);

/// The station has signed a new end.
pub(super) fn on_head(model: &mut Model, head: SignedHead, is_signed: bool) {
    (model.book.head, model.book.is_signed) = (Some(head), is_signed);
}

/// Sends the end again while the vehicle is heard and has not confirmed it.
pub(super) fn pass(model: &mut Model, now: Duration) {
    let Some(head) = model.book.head.filter(|signed| signed.head.entries > model.book.kept) else { return };
    let due = model.book.sent_at.is_none_or(|at| now.saturating_sub(at) >= SENT_EVERY);
    if due && model.link.state(now).carries() {
        model.book.sent_at = Some(now);
        let message = head.message(model.settings.vehicle);
        model.outbox.push(Action::send(MavMessage::TD_BOOK_HEAD(message)));
    }
}

pub(super) fn on_kept(model: &mut Model, kept: &TD_BOOK_KEPT_DATA) {
    let target = Address { system_id: kept.target_system, component_id: kept.target_component };
    let ours = model
        .book
        .head
        .is_some_and(|signed| signed.head.book == kept.book && kept.entries <= signed.head.entries);
    if model.settings.us.accepts(target) && ours {
        model.book.kept = model.book.kept.max(kept.entries);
    }
}

/// A vehicle that was switched on again has a new log, which keeps nothing yet.
pub(super) fn on_reboot(model: &mut Model) {
    model.book.kept = 0;
}

/// What the vehicle says of its crew and its mission, as far as the book has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CrewTold {
    people: u8,
    ask: Option<(TdAct, u16, u8)>,
    tapped_by: u8,
    commanded_by: u8,
    held_by: u8,
    mission: Option<(MissionHash, String)>,
}

impl CrewTold {
    pub(super) fn of(model: &Model) -> Self {
        let crew = model.vehicle.crew.as_ref().map(|crew| &crew.value);
        Self {
            people: crew.map_or(0, |crew| crew.people),
            ask: crew
                .filter(|crew| crew.act != TdAct::TD_ACT_NONE)
                .map(|crew| (crew.act, crew.ask_number, crew.asked_by)),
            tapped_by: crew.map_or(0, |crew| crew.tapped_by),
            commanded_by: crew.map_or(0, |crew| crew.commanded_by),
            held_by: crew.map_or(0, |crew| crew.held_by),
            mission: model.vehicle.mission.clone(),
        }
    }
}

/// Enters what has changed.
pub(super) fn on_change(model: &mut Model, before: &CrewTold) {
    let after = CrewTold::of(model);
    if after == *before {
        return;
    }
    let mut lines: Vec<(u8, String)> = Vec::new();
    if after.people != before.people {
        lines.push((0, format!("an arming and a start take {} of the crew", after.people)));
    }
    if let Some((act, number, by)) = after.ask.filter(|_| after.ask != before.ask) {
        let act = if act == TdAct::TD_ACT_START { "start" } else { "arm" };
        lines.push((by, format!("asks to {act} (ask {number})")));
    }
    let roles = [
        (after.commanded_by, before.commanded_by, "is in command"),
        (after.tapped_by, before.tapped_by, "confirmed the start and taps"),
        (after.held_by, before.held_by, "held the countdown"),
    ];
    for (after, before, words) in roles {
        if after != before && after > 0 {
            lines.push((after, words.to_owned()));
        }
    }
    if let Some((hash, name)) = after.mission.filter(|mission| before.mission.as_ref() != Some(mission)) {
        lines.push((0, format!("it flies the mission {name} {hash}")));
    }
    for (by, words) in lines {
        let who = if by > 0 { model.operator(by) } else { String::new() };
        let text = if by > 0 { format!("key {by}: {words}") } else { words };
        model.enter("vehicle says", &who, &text);
    }
}
