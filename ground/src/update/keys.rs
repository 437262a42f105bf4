//! The hand of the crew.
//!
//! Nothing dangerous on a single letter: arming, start and quitting in flight take a letter, a typed word and Enter,
//! disarming a letter and Enter, an abort Ctrl-X and Enter (or Ctrl-X twice); each within its time. But for the abort,
//! keys count only as a finger strikes them: neither pasted nor repeated by the keyboard.

use std::time::Duration;

use protocol::dialect::{MavMessage, PARAM_REQUEST_LIST_DATA, TdPhase};
use protocol::log::record::Record;
use protocol::log::v1::OperatorAction;

use super::{Action, commands};
use crate::attach::codec::Asked;
use crate::key::Key;
use crate::model::alarm::AlarmKind;
use crate::model::command::CommandKind;
use crate::model::dialog::Dialog;
use crate::model::hand::{FINGERS_APART, Touch};
use crate::model::page::Page;
use crate::model::seat::Seat;
use crate::model::vehicle::is_on_pad;
use crate::model::words;
use crate::model::{Model, Role};

/// Lines that a page key scrolls.
const SCROLL_PAGE: i32 = 10;
/// No list is longer.
const SCROLL_MAX: i32 = 4_000;

/// Keys that came in one read of the terminal: one by a finger, many by a paste, a held key or a slow line.
pub(super) fn on_keys(model: &mut Model, keys: &[Key], now: Duration) {
    for key in keys {
        let touch = match model.settings.role {
            // There is nothing to command, and time stands still while it is paused.
            Role::Replaying => Touch::Finger,
            _ => model.hand.touch(*key, keys.len() > 1, now),
        };
        on_key(model, *key, touch, now);
    }
}

/// What is pasted is meant for another window.
pub(super) fn on_paste(model: &mut Model, now: Duration) {
    record_operator(model, "key", "a paste", now);
    model.hand.pasted(now);
    model.quit_at = None;
    cancel(model, now);
    model.info(now, "a paste was dropped");
}

fn on_key(model: &mut Model, key: Key, touch: Touch, now: Duration) {
    if touch != Touch::Hurried || matches!(key, Key::CtrlX | Key::Enter) {
        record_operator(model, "key", &key.name(), now);
    }
    expire(model, now);
    if touch != Touch::Repeat {
        model.quit_at = None;
    }
    if on_abort_key(model, key, now) {
        return;
    }
    match touch {
        _ if key.scrolls() => {}
        Touch::Finger => {}
        Touch::Repeat => return,
        Touch::Hurried => {
            cancel(model, now);
            if model.hand.says(now) {
                model.info(now, "keys faster than a hand types them were dropped: a paste?");
            }
            return;
        }
    }
    if key == Key::CtrlL {
        model.outbox.push(Action::Redraw);
    }
    match std::mem::replace(&mut model.dialog, Dialog::Closed) {
        Dialog::Closed => on_free_key(model, key, now),
        dialog => on_offer_key(model, dialog, key, now),
    }
}

/// The abort, before everything else and whatever is thought of the keys: no paste, no speed, no dialog takes it away.
/// Returns whether the key is done with.
fn on_abort_key(model: &mut Model, key: Key, now: Duration) -> bool {
    if key == Key::CtrlX {
        if let Some(why) = model.settings.role.why_not_command() {
            model.info(now, why);
            return true;
        }
        // An Enter that comes too late for the abort must not start or arm what was offered before.
        model.dialog = Dialog::Closed;
        // Where the terminal tells repeats apart, a second Ctrl-X was pressed, however soon it came.
        if model.repeats_told && model.abort_chord.confirm(now) {
            abort(model, now);
        } else {
            model.abort_chord.press(now);
        }
        return true;
    }
    // Who has begun an abort means the abort; and twice Ctrl-X, once complete, nothing takes back.
    let complete = if key == Key::Enter { model.abort_chord.confirm(now) } else { model.abort_chord.end() };
    if complete {
        abort(model, now);
    }
    // While the abort is offered, another key neither takes it back nor does anything else.
    complete || model.abort_chord.is_begun(now)
}

/// The next letter of the offer's word, Enter behind the whole word; every other key cancels the offer.
fn on_offer_key(model: &mut Model, mut dialog: Dialog, key: Key, now: Duration) {
    match key {
        Key::Enter if dialog.is_complete() => climbed(model, &dialog, now),
        Key::Char(letter) if dialog.take(letter) => model.dialog = dialog,
        _ => {
            let (name, word) = (dialog.name(), dialog.word());
            let wanted = word.filter(|_| matches!(key, Key::Enter | Key::Char(_)));
            let wanted = wanted.map_or_else(String::new, |word| format!("; the word is {word}"));
            model.info(now, format!("{name}: cancelled, nothing was done{wanted}"));
        }
    }
}

/// The whole ladder of this offer.
fn climbed(model: &mut Model, dialog: &Dialog, now: Duration) {
    match dialog {
        Dialog::Closed => {}
        Dialog::Arm { .. } => ask(model, CommandKind::Arm, now),
        Dialog::Start { .. } => ask(model, CommandKind::Start, now),
        Dialog::Disarm { .. } => ask(model, CommandKind::Disarm, now),
        // A live station must not end with its screen; a demonstration and a screen of another station may.
        Dialog::Quit { .. } => {
            let stays = model.settings.role == Role::Station && !model.settings.demonstration;
            let leave = if stays && model.is_at_risk() { Action::LeaveScreen } else { Action::Quit };
            model.outbox.push(leave);
        }
    }
}

/// Closes an offer that something foreign came between.
fn cancel(model: &mut Model, now: Duration) {
    match std::mem::replace(&mut model.dialog, Dialog::Closed) {
        Dialog::Closed => {}
        dialog => model.info(now, format!("{}: cancelled, nothing was done", dialog.name())),
    }
}

/// Closes what has waited too long: an offer to arm does not stay open behind the crew's back.
fn expire(model: &mut Model, now: Duration) {
    if model.dialog.until().is_some_and(|until| now > until) {
        let dialog = std::mem::replace(&mut model.dialog, Dialog::Closed);
        model.info(now, format!("{}: time is up, nothing was done", dialog.name()));
    }
}

/// Time passes for the hand: offers end, a chord or a key to quit turns out to be complete.
pub(super) fn pass(model: &mut Model, now: Duration) {
    expire(model, now);
    pass_abort_chord(model, now);
    pass_quit(model, now);
}

/// Quits, once no other key has followed the one that asked for it.
fn pass_quit(model: &mut Model, now: Duration) {
    if model.quit_at.is_some_and(|at| now >= at) {
        model.quit_at = None;
        model.outbox.push(Action::Quit);
    }
}

pub(super) fn record_operator(model: &mut Model, kind: &str, detail: &str, now: Duration) {
    model.outbox.push(Action::Record(Record::OperatorAction(OperatorAction {
        time_s: now.as_secs_f64(),
        kind: kind.to_owned(),
        detail: detail.to_owned(),
    })));
}

fn on_free_key(model: &mut Model, key: Key, now: Duration) {
    if let (Some(why), Key::Char('A' | 'S' | 'D')) = (model.settings.role.why_not_command(), key) {
        return model.info(now, why);
    }
    match key {
        Key::Char('A') => match why_not_arm(model, now) {
            None => model.dialog = Dialog::arm(now),
            Some(why) => model.warn(now, format!("cannot arm: {why}")),
        },
        Key::Char('S') => match why_not_start(model, now) {
            None => model.dialog = Dialog::start(now),
            Some(why) => model.warn(now, format!("cannot start: {why}")),
        },
        Key::Char('D') => model.dialog = Dialog::disarm(now),
        Key::Char('a' | 's' | 'd') => model.info(now, "capital letters: A arms, S starts, D disarms"),
        Key::Char('q' | 'Q') | Key::CtrlC => quit(model, now),
        _ => on_page_key(model, key, now),
    }
}

/// Which screen, how far its list is scrolled, and that the alarms were seen.
fn on_page_key(model: &mut Model, key: Key, now: Duration) {
    let shown = model.page();
    match key {
        Key::Char('?') | Key::F1 if shown == Page::Help => model.pages.hold(None),
        Key::Char('?') | Key::F1 => model.pages.hold(Some(Page::Help)),
        Key::Escape | Key::Char('0') => model.pages.hold(None),
        Key::Char('h' | 'H') if model.pages.held.is_some() => model.pages.hold(None),
        Key::Char('h' | 'H') => model.pages.hold(Some(shown)),
        Key::Char(' ') => see_alarm(model, now),
        Key::Char('r') if shown == Page::Parameters => ask_parameters(model),
        Key::Up | Key::Down if shown == Page::Alarms => choose_alarm(model, key == Key::Up),
        Key::Up => scroll(model, 1),
        Key::Down => scroll(model, -1),
        Key::PageUp => scroll(model, SCROLL_PAGE),
        Key::PageDown => scroll(model, -SCROLL_PAGE),
        Key::Home => scroll(model, SCROLL_MAX),
        Key::End => scroll(model, -SCROLL_MAX),
        Key::Char(digit) => {
            if let Some(page) = Page::from_digit(digit) {
                model.pages.hold(Some(page));
                if page == Page::Parameters && !model.parameters.asked {
                    ask_parameters(model);
                }
            }
        }
        _ => {}
    }
}

/// Scrolls up by this many lines; down when negative. What happened is read from its newest line, a list of
/// names or figures from its first.
fn scroll(model: &mut Model, up: i32) {
    let away = if matches!(model.page(), Page::Parameters | Page::Link) { -up } else { up };
    let lines = i32::try_from(model.pages.scroll).unwrap_or(SCROLL_MAX);
    let scrolled = lines.saturating_add(away).clamp(0, SCROLL_MAX);
    model.pages.scroll = usize::try_from(scrolled).unwrap_or(0);
}

pub(super) fn ask_parameters(model: &mut Model) {
    model.parameters.asked = true;
    if model.settings.role == Role::Attached {
        return model.outbox.push(Action::Request(Asked::Parameters));
    }
    model.outbox.push(Action::send(MavMessage::PARAM_REQUEST_LIST(PARAM_REQUEST_LIST_DATA {
        target_system: model.settings.vehicle.system_id,
        target_component: model.settings.vehicle.component_id,
    })));
}

/// The ladder is complete: commands here, or asks the station that this screen shows.
fn ask(model: &mut Model, kind: CommandKind, now: Duration) {
    match model.settings.role {
        Role::Attached => model.outbox.push(Action::Request(Asked::Command(kind))),
        Role::Station => {
            let by = model.settings.seat.clone();
            model.outbox.push(Action::Tell(kind));
            command(model, kind, &by, now);
        }
        Role::Watching | Role::Replaying => {}
    }
}

/// Commands, unless the vehicle has changed since the ladder was begun, or another screen has asked for the same.
pub(super) fn command(model: &mut Model, kind: CommandKind, by: &Seat, now: Duration) {
    let why_not = match kind {
        CommandKind::Arm => on_its_way(model, kind, now).or_else(|| why_not_arm(model, now)),
        CommandKind::Start => on_its_way(model, kind, now).or_else(|| why_not_start(model, now)),
        CommandKind::Disarm | CommandKind::Abort => None,
    };
    match why_not {
        None => commands::submit(model, kind, by.clone(), now),
        Some(why) => {
            let text = format!("cannot {}: {why}{}", kind.name().to_lowercase(), by.in_brackets());
            record_operator(model, "not sent", &text, now);
            model.warn(now, text);
        }
    }
}

/// Two hands that ask for one thing at one time ask for it once.
fn on_its_way(model: &Model, kind: CommandKind, now: Duration) -> Option<String> {
    let track = model.commands.of(kind).filter(|track| track.is_on_its_way(now))?;
    Some(format!("{} is on its way already{}", kind.name(), track.by.in_brackets()))
}

/// The one alarm that the screen points at was seen: in the alarm line, or the chosen one of the list.
fn see_alarm(model: &mut Model, now: Duration) {
    let Some(kind) = model.pointed_at().map(|alarm| alarm.kind) else { return };
    if model.settings.role == Role::Attached {
        model.outbox.push(Action::Request(Asked::Acknowledge(kind)));
    } else {
        acknowledge(model, kind, now);
    }
}

pub(super) fn acknowledge(model: &mut Model, kind: AlarmKind, now: Duration) {
    if let Some(text) = model.alarms.acknowledge(kind) {
        model.info(now, format!("alarm acknowledged: {text}"));
    }
}

/// Points at the next alarm of the list, or the one before.
fn choose_alarm(model: &mut Model, up: bool) {
    let list = model.alarms.list();
    let at = model.pointed_at().and_then(|chosen| list.iter().position(|alarm| alarm.kind == chosen.kind));
    let next = match at {
        Some(at) if up => at.saturating_sub(1),
        Some(at) => (at + 1).min(list.len() - 1),
        None => return,
    };
    model.pages.chosen = Some(list[next].kind);
}

/// Why arming is not even asked for. The vehicle's own checks are the vehicle's to refuse, in its words.
fn why_not_arm(model: &Model, now: Duration) -> Option<String> {
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

fn why_not_start(model: &Model, now: Duration) -> Option<String> {
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

/// Lets the abort chord's time pass. Only with the clock, never with a key: that key may be one more
/// repeat of a Ctrl-X that is held.
fn pass_abort_chord(model: &mut Model, now: Duration) {
    if model.abort_chord.pass(now) {
        abort(model, now);
    }
}

fn abort(model: &mut Model, now: Duration) {
    model.dialog = Dialog::Closed;
    ask(model, CommandKind::Abort, now);
}

fn quit(model: &mut Model, now: Duration) {
    let commands = model.settings.role.why_not_command().is_none();
    if commands && model.is_at_risk() {
        model.dialog = Dialog::quit(now);
    } else {
        model.quit_at = Some(now + FINGERS_APART);
    }
}
