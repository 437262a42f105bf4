//! The hand of the crew.
//!
//! Nothing dangerous on a single letter: arming takes the dialog and then the typed word, start and
//! disarming a letter and Enter, an abort Ctrl-X and Enter (or Ctrl-X twice); each within its time.

use std::time::Duration;

use protocol::dialect::{MavMessage, PARAM_REQUEST_LIST_DATA, TdPhase};
use protocol::identity::VEHICLE;
use protocol::log::record::Record;
use protocol::log::v1::OperatorAction;

use super::{Action, commands};
use crate::attach::codec::Asked;
use crate::key::Key;
use crate::model::alarm::AlarmKind;
use crate::model::command::CommandKind;
use crate::model::dialog::{ARM_TIME_LIMIT, ARM_WORD, CONFIRM_TIME_LIMIT, Dialog, QUIT_TIME_LIMIT};
use crate::model::page::Page;
use crate::model::vehicle::is_on_pad;
use crate::model::words;
use crate::model::{Model, Role};

/// Lines that a page key scrolls.
const SCROLL_PAGE: i32 = 10;
/// No list is longer.
const SCROLL_MAX: i32 = 4_000;

pub(super) fn on_key(model: &mut Model, key: Key, now: Duration) {
    record_operator(model, "key", &key.name(), now);
    expire(model, now);
    let why_not = model.settings.role.why_not_command();
    if let (Some(why), Key::CtrlX | Key::Char('A' | 'S' | 'D')) = (why_not, key) {
        return model.info(now, why);
    }
    if key == Key::CtrlX {
        // An Enter that comes too late for the abort must not start or arm what was offered before.
        model.dialog = Dialog::Closed;
        // Where the terminal tells repeats apart, a second Ctrl-X was pressed, however soon it came.
        if model.repeats_told && model.abort_chord.confirm(now) {
            abort(model, now);
        } else {
            model.abort_chord.press(now);
        }
        return;
    }
    // Before any dialog: who has begun an abort means the abort.
    if key == Key::Enter && model.abort_chord.confirm(now) {
        return abort(model, now);
    }
    // Twice Ctrl-X with nothing between; once complete, nothing takes it back.
    if model.abort_chord.end() {
        abort(model, now);
    }
    match key {
        Key::CtrlC => return quit(model, now),
        Key::CtrlL => return model.outbox.push(Action::Redraw),
        _ => {}
    }
    match std::mem::replace(&mut model.dialog, Dialog::Closed) {
        Dialog::Closed => on_free_key(model, key, now),
        Dialog::Arm { typed, until } => on_arm_key(model, key, typed, until, now),
        Dialog::Start { until } => match key {
            Key::Enter => ask(model, CommandKind::Start, now),
            Key::Escape => model.info(now, "start: cancelled"),
            _ => model.dialog = Dialog::Start { until },
        },
        Dialog::Disarm { until } => match key {
            Key::Enter => ask(model, CommandKind::Disarm, now),
            Key::Escape => model.info(now, "disarm: cancelled"),
            _ => model.dialog = Dialog::Disarm { until },
        },
        Dialog::Quit { .. } if matches!(key, Key::Char('q' | 'Q')) => model.outbox.push(Action::Quit),
        Dialog::Quit { .. } => model.info(now, "quit: cancelled"),
    }
}

/// Closes what has waited too long: an offer to arm does not stay open behind the crew's back.
pub(super) fn expire(model: &mut Model, now: Duration) {
    if model.dialog.until().is_some_and(|until| now > until) {
        let words = match std::mem::replace(&mut model.dialog, Dialog::Closed) {
            Dialog::Arm { .. } => "arming: time is up, nothing was sent",
            Dialog::Start { .. } => "start: time is up, nothing was sent",
            Dialog::Disarm { .. } => "disarm: time is up, nothing was sent",
            Dialog::Quit { .. } | Dialog::Closed => return,
        };
        model.info(now, words);
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
    match key {
        Key::Char('A') => match why_not_arm(model, now) {
            None => model.dialog = Dialog::Arm { typed: String::new(), until: now + ARM_TIME_LIMIT },
            Some(why) => model.warn(now, format!("cannot arm: {why}")),
        },
        Key::Char('S') => match why_not_start(model, now) {
            None => model.dialog = Dialog::Start { until: now + CONFIRM_TIME_LIMIT },
            Some(why) => model.warn(now, format!("cannot start: {why}")),
        },
        Key::Char('D') => model.dialog = Dialog::Disarm { until: now + CONFIRM_TIME_LIMIT },
        Key::Char('a' | 's' | 'd') => model.info(now, "capital letters: A arms, S starts, D disarms"),
        Key::Char('q' | 'Q') => quit(model, now),
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
        target_system: VEHICLE.system_id,
        target_component: VEHICLE.component_id,
    })));
}

fn on_arm_key(model: &mut Model, key: Key, mut typed: String, until: Duration, now: Duration) {
    match key {
        Key::Escape => return model.info(now, "arming: cancelled"),
        Key::Enter if typed.eq_ignore_ascii_case(ARM_WORD) => {
            return ask(model, CommandKind::Arm, now);
        }
        Key::Backspace => {
            typed.pop();
        }
        Key::Char(c) if typed.chars().count() < ARM_WORD.len() => typed.push(c),
        // A wrong word; or a letter too many, which could not be shown and must not be taken back unseen.
        Key::Enter | Key::Char(_) => {
            return model.info(now, format!("arming: the word is {ARM_WORD}; nothing was sent"));
        }
        _ => {}
    }
    model.dialog = Dialog::Arm { typed, until };
}

/// The ladder is complete: commands here, or asks the station that this screen shows.
fn ask(model: &mut Model, kind: CommandKind, now: Duration) {
    match model.settings.role {
        Role::Attached => model.outbox.push(Action::Request(Asked::Command(kind))),
        Role::Station => command(model, kind, now),
        Role::Watching | Role::Replaying => {}
    }
}

/// Commands, unless the vehicle has changed since the ladder was begun.
pub(super) fn command(model: &mut Model, kind: CommandKind, now: Duration) {
    let why_not = match kind {
        CommandKind::Arm => why_not_arm(model, now),
        CommandKind::Start => why_not_start(model, now),
        CommandKind::Disarm | CommandKind::Abort => None,
    };
    match why_not {
        None => commands::submit(model, kind, now),
        Some(why) => model.warn(now, format!("cannot {}: {why}", kind.name().to_lowercase())),
    }
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
pub(super) fn pass_abort_chord(model: &mut Model, now: Duration) {
    if model.abort_chord.pass(now) {
        abort(model, now);
    }
}

fn abort(model: &mut Model, now: Duration) {
    model.dialog = Dialog::Closed;
    ask(model, CommandKind::Abort, now);
}

fn quit(model: &mut Model, now: Duration) {
    let armed = model.vehicle.armed().is_some_and(|armed| armed.value);
    // A screen that ends leaves its station as it is.
    let is_station = model.settings.role == Role::Station;
    let risky = is_station && (armed || model.commands.is_aborting() || model.vehicle.in_flight());
    let confirmed = matches!(model.dialog, Dialog::Quit { .. });
    if confirmed || !risky {
        model.dialog = Dialog::Closed;
        model.outbox.push(Action::Quit);
    } else {
        model.dialog = Dialog::Quit { until: now + QUIT_TIME_LIMIT };
    }
}
