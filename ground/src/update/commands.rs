//! Commands on their way: sent, answered, given up, observed.

use std::time::Duration;

use protocol::command::{CommandAnswer, CommandEvent, Ticket, result_words};
use protocol::dialect::MavResult;
use protocol::log::record::EventLevel;

use super::{Action, auto, keys};
use crate::model::command::{Acknowledged, CommandKind, Track};
use crate::model::events::Speaker;
use crate::model::seat::Seat;
use crate::model::{AutoStep, Model};

/// Of an abort's many attempts, the first is said and each of so many.
const ABORT_SAID_EVERY: u32 = 20;

/// Asks the vehicle, and begins to follow what becomes of it.
pub(super) fn submit(model: &mut Model, kind: CommandKind, by: Seat, now: Duration) {
    let commands = &mut model.commands;
    let aborting = commands.is_aborting();
    if kind == CommandKind::Abort || (kind == CommandKind::Disarm && !aborting) {
        // An abort or a disarming ends whatever else is still being resent: a start that arrives
        // after it would undo it. Nor will its effect be seen; nobody needs to be told.
        commands.sender.withdraw_all(now);
        for track in &mut commands.tracks {
            track.not_observed_said = true;
            if is_open(track.acknowledged) {
                track.acknowledged = Acknowledged::Nothing;
            }
        }
        // The automatic mode yields to the hand.
        model.auto_step = AutoStep::Done;
    }
    // Pressed again while it is under way, an abort is sent at once and its attempts go on counting.
    let earlier = commands.of(kind).filter(|_| kind == CommandKind::Abort && aborting).cloned();
    let ticket = send(model, kind, now);
    let commands = &mut model.commands;
    commands.tracks.retain(|track| track.kind != kind);
    commands.tracks.push(Track {
        kind,
        by,
        commanded_at: earlier.as_ref().map_or(now, |track| track.commanded_at),
        attempts: earlier.map_or(0, |track| track.attempts),
        acknowledged: Acknowledged::Waiting,
        acknowledged_at: None,
        observed_at: None,
        ticket,
        not_observed_said: false,
    });
    model.outcome.refusal = None;
    poll(model, now);
}

fn send(model: &mut Model, kind: CommandKind, now: Duration) -> Ticket {
    let (command, param1) = kind.wire();
    let params = [param1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    model.commands.sender.submit(model.settings.vehicle, command, params, kind.resend(), now)
}

fn is_open(acknowledged: Acknowledged) -> bool {
    matches!(acknowledged, Acknowledged::Waiting | Acknowledged::InProgress)
}

/// Sends what is due and takes note of what happened.
pub(super) fn poll(model: &mut Model, now: Duration) {
    let messages = model.commands.sender.poll(now);
    model.outbox.extend(messages.into_iter().map(Action::send));
    for event in model.commands.sender.take_events() {
        on_event(model, event, now);
    }
}

pub(super) fn on_answer(model: &mut Model, answer: CommandAnswer, now: Duration) {
    let awaited = model.commands.sender.on_answer(&answer, now);
    let given_up =
        track_of(model, answer.command).is_some_and(|track| track.acknowledged == Acknowledged::Nothing);
    if !awaited && given_up {
        // Slow radio: the answer to a command that is waited for no longer is still a fact.
        let (command, result) = (answer.command, answer.result);
        on_event(model, CommandEvent::Answered { command, result }, now);
        return;
    }
    poll(model, now);
}

/// The latest command of this number: arming and disarming share one.
fn track_of(model: &mut Model, command: u16) -> Option<&mut Track> {
    model.commands.tracks.iter_mut().rfind(|track| track.kind.wire().0 as u16 == command)
}

fn on_event(model: &mut Model, event: CommandEvent, now: Duration) {
    // Where there are several links, the operator is told which one carried the answer.
    let over = model.link.heard_over().map_or_else(String::new, |link| format!(", over {link}"));
    let track = match event {
        CommandEvent::Sent { command, .. }
        | CommandEvent::InProgress { command, .. }
        | CommandEvent::Answered { command, .. }
        | CommandEvent::TimedOut { command, .. } => track_of(model, command),
        CommandEvent::AnsweredLate { ticket, .. } => {
            model.commands.tracks.iter_mut().find(|track| track.ticket == ticket)
        }
    };
    let Some(track) = track else { return };
    let kind = track.kind;
    let name = kind.name();
    let by = track.by.in_brackets();
    let (operator_kind, level, text) = match event {
        CommandEvent::Sent { .. } => {
            track.attempts += 1;
            let attempt = track.attempts;
            if kind == CommandKind::Abort && attempt > 1 {
                // Answered or not, it goes on; and so many lines would drown everything else.
                if attempt % ABORT_SAID_EVERY != 0 {
                    return;
                }
            } else {
                track.acknowledged = Acknowledged::Waiting;
            }
            ("commanded", EventLevel::Info, format!("{name} commanded, attempt {attempt}{by}"))
        }
        CommandEvent::InProgress { .. } => {
            track.acknowledged = Acknowledged::InProgress;
            ("acknowledged", EventLevel::Info, format!("{name} acknowledged: in progress"))
        }
        CommandEvent::Answered { result, .. } | CommandEvent::AnsweredLate { result, .. } => {
            track.acknowledged = Acknowledged::Answered(result);
            track.acknowledged_at = Some(now);
            let words = result_words(result);
            let late = if matches!(event, CommandEvent::AnsweredLate { .. }) { " (late)" } else { "" };
            if track.accepted() {
                ("acknowledged", EventLevel::Info, format!("{name} acknowledged{late}: {words}{over}"))
            } else {
                ("refused", EventLevel::Error, format!("{name} REFUSED{late}: {words}{over}"))
            }
        }
        CommandEvent::TimedOut { attempts, .. } => {
            track.acknowledged = Acknowledged::Nothing;
            ("unanswered", EventLevel::Error, format!("{name} not acknowledged after {attempts} attempts"))
        }
    };
    let answered = match event {
        CommandEvent::Answered { result, .. } | CommandEvent::AnsweredLate { result, .. } => Some(result),
        _ => None,
    };
    let told = if matches!(event, CommandEvent::Sent { .. }) { text.clone() } else { format!("{text}{by}") };
    keys::record_operator(model, operator_kind, &told, now);
    model.say(now, Speaker::Ground, level, text);
    if let Some(result) = answered {
        on_final_answer(model, kind, result, now);
    }
}

fn on_final_answer(model: &mut Model, kind: CommandKind, result: u8, now: Duration) {
    let refused = result != MavResult::MAV_RESULT_ACCEPTED as u8;
    let for_now = result == MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
    match kind {
        CommandKind::Arm if for_now && auto::ask_again(model, now) => {}
        CommandKind::Arm | CommandKind::Start if refused => {
            model.outcome.refusal = Some((format!("{} {}", kind.name(), result_words(result)), now));
        }
        // "Not now" is no answer to an abort: it goes on.
        CommandKind::Abort if for_now => {
            if let Some(track) = model.commands.tracks.iter_mut().find(|track| track.kind == kind) {
                track.acknowledged = Acknowledged::Waiting;
                track.acknowledged_at = None;
            }
        }
        // There is nothing to abort, or it will not be done: more of them change nothing.
        CommandKind::Abort if refused => stop_aborting(model, now),
        CommandKind::Abort => stop_if_latched(model, now),
        _ => {}
    }
}

/// An abort is sent until both are there, the latch in the vehicle's own state and an answer.
fn stop_if_latched(model: &mut Model, now: Duration) {
    let done = model.commands.of(CommandKind::Abort).is_some_and(|track| {
        let answered = matches!(track.acknowledged, Acknowledged::Answered(_));
        answered && track.observed_at.is_some()
    });
    if done {
        stop_aborting(model, now);
    }
}

fn stop_aborting(model: &mut Model, now: Duration) {
    if let Some(ticket) = model.commands.of(CommandKind::Abort).map(|track| track.ticket) {
        model.commands.sender.withdraw_one(ticket, now);
    }
}

/// The vehicle has begun anew: an abort that was under way is meant for it still, and nothing else is. What was
/// acknowledged and observed was so by a vehicle that is no more. Returns what is void.
pub(super) fn begin_anew(model: &mut Model, now: Duration) -> Vec<&'static str> {
    let aborting = model.commands.is_aborting();
    let by = model.commands.of(CommandKind::Abort).map(|track| track.by.clone()).unwrap_or_default();
    model.commands.sender.withdraw_all(now);
    let void = model.commands.tracks.iter().map(|track| track.kind.name()).collect();
    model.commands.tracks.clear();
    if aborting {
        submit(model, CommandKind::Abort, by, now);
    }
    void
}

/// Compares the vehicle's own state with what was asked.
pub(super) fn observe(model: &mut Model, now: Duration) {
    let mut seen = Vec::new();
    for track in &mut model.commands.tracks {
        if track.observed_at.is_none() && track.kind.is_observed(&model.vehicle, track.commanded_at) {
            track.observed_at = Some(now);
            seen.push((
                EventLevel::Info,
                format!("{} observed: {}", track.kind.name(), track.kind.observed_words()),
            ));
        } else if track.disagrees(now) && !track.not_observed_said {
            track.not_observed_said = true;
            let name = track.kind.name();
            seen.push((
                EventLevel::Error,
                format!("{name} acknowledged, not observed: the vehicle does not show it"),
            ));
        }
    }
    for (level, text) in seen {
        keys::record_operator(model, "observed", &text, now);
        model.say(now, Speaker::Ground, level, text);
    }
    stop_if_latched(model, now);
}
