//! The effects of the crew's keys.
//!
//! No single key is dangerous. Arming, starting, and quitting in flight take a letter, a typed word
//! and Enter; disarming takes a letter and Enter; an abort takes Ctrl-X and Enter (or Ctrl-X
//! twice); each within a time limit. The abort counts however its keys arrive. Other keys count if
//! they were typed by hand. Keys that arrive faster may be a paste, or typed over a connection that
//! delivers them in bunches: what they complete needs another confirmation, unless it holds or
//! disarms.

use std::time::Duration;

use protocol::dialect::{TdAct, TdInterlock};

use super::pad;
use super::requests::{acknowledge, on_request};
use crate::key::Key;
use crate::model::{
    AGAIN_AFTER, AGAIN_KEY, Act, Action, AlarmKind, CommandKind, Dialog, FINGERS_APART, KeyOrigin, Model,
    NOTE_MAX, Page, PaletteAction, Prompt, Request, RestOfWord, Role, Standing, TextEntry, hold_words,
    overruled_by, palette_entries, quantity, standing, why_not_arm, why_not_check, why_not_confirm,
    why_not_here, why_not_quit, why_not_seen, why_not_start, why_not_take, why_nothing_flown,
    why_nothing_moves,
};

/// How many lines PgUp and PgDn scroll.
const SCROLL_PAGE: isize = 10;
/// The furthest scroll position; no list is longer.
const SCROLL_MAX: usize = 4_000;

/// Keys from one read of the terminal: one if typed by hand, several from a paste, a held key or a
/// slow line.
pub(super) fn on_keys(model: &mut Model, keys: &[Key], now: Duration) {
    for key in keys {
        let touch = match model.settings.role {
            // A replay commands nothing, and its time stands still while it is paused.
            Role::Replaying => KeyOrigin::Typed,
            _ => model.key_timing.origin(*key, keys.len() > 1, now),
        };
        on_key(model, *key, touch, now);
    }
}

/// A paste is dropped: it was intended for another window.
pub(super) fn on_paste(model: &mut Model, now: Duration) {
    model.record_operator(now, "key", &model.settings.seat.clone(), "a paste");
    model.key_timing.pasted(now);
    model.quit_at = None;
    model.pages.entry = None;
    if let Some(dialog) = model.dialog.take() {
        model.info(now, format!("{}: cancelled, nothing was done", dialog.prompt.name()));
    }
    model.info(now, "a paste was dropped");
}

fn on_key(model: &mut Model, key: Key, touch: KeyOrigin, now: Duration) {
    if touch != KeyOrigin::Dropped || matches!(key, Key::CtrlX | Key::Enter) {
        record_key(model, key, now);
    }
    expire(model, now);
    if touch != KeyOrigin::Repeat {
        model.quit_at = None;
    }
    if on_abort_key(model, key, now) {
        return;
    }
    let touch = if key.scrolls() { KeyOrigin::Typed } else { touch };
    if touch == KeyOrigin::Dropped {
        return;
    }
    let is_free = model.pages.entry.is_none() && model.dialog.is_none();
    if key == Key::CtrlL && !is_free {
        model.outbox.push(Action::Redraw);
    }
    if model.pages.entry.is_some() && model.dialog.is_none() {
        if touch != KeyOrigin::Repeat {
            model.key_timing.hurried = touch != KeyOrigin::Typed;
            on_entry_key(model, key, now);
        }
        return;
    }
    match model.dialog.take() {
        None if key == Key::Escape && std::mem::take(&mut model.link.abort_unsent) => {
            model.warn(now, "the abort that was not sent is cancelled");
        }
        None if on_rest_of_word(model, key, now) || touch == KeyOrigin::Repeat => {}
        None => on_free_key(model, key, touch, now),
        Some(dialog) => on_dialog_key(model, dialog, key, touch, now),
    }
}

/// Records a key. The letters of a word that is being typed are one line, with the key that ends
/// it.
fn record_key(model: &mut Model, key: Key, now: Duration) {
    let types = model.pages.entry.is_some() || model.dialog.is_some();
    let keys_typed = match key {
        Key::Char(letter) if types => return model.pages.word.push(letter),
        _ if model.pages.word.is_empty() => key.name(),
        _ => format!("{} {}", std::mem::take(&mut model.pages.word), key.name()),
    };
    model.record_operator(now, "key", &model.settings.seat.clone(), &keys_typed);
}

/// Swallows the rest of a word that is no longer wanted, and repeats the reason. Returns whether
/// the key was part of it.
fn on_rest_of_word(model: &mut Model, key: Key, now: Duration) -> bool {
    let Some(mut rest) = model.rest_of_word.take() else { return false };
    match key {
        Key::Enter if rest.waits(now) => model.warn(now, rest.why),
        Key::Char(letter) if rest.takes(letter, now) => model.rest_of_word = Some(rest),
        _ => return false,
    }
    true
}

/// Keys that arrive too fast and have no meaning here: a paste.
pub(super) fn drop_run(model: &mut Model, now: Duration) {
    model.key_timing.drop_run();
    if model.key_timing.reports_drop(now) {
        model.info(now, "keys faster than a hand types them were dropped: a paste? If not, type them again");
    }
}

/// The abort chord comes first: no paste, no typing speed and no dialog blocks it. Returns whether
/// the key has been used.
fn on_abort_key(model: &mut Model, key: Key, now: Duration) -> bool {
    if key == Key::CtrlX {
        if let Some(why) = model.settings.role.why_not_command() {
            refuse_command(model, why, now);
            return true;
        }
        // An Enter that comes too late for the abort must not confirm a dialog that was open
        // before.
        model.dialog = None;
        model.pages.entry = None;
        // If the terminal reports repeats, a second Ctrl-X was really pressed, however soon it
        // came.
        if model.repeats_reported && model.abort_chord.confirm(now) {
            abort(model, now);
        } else {
            model.abort_chord.press(now);
        }
        return true;
    }
    // A complete double Ctrl-X cannot be taken back by the next key.
    let complete = if key == Key::Enter { model.abort_chord.confirm(now) } else { model.abort_chord.end() };
    if complete {
        abort(model, now);
    } else if key != Key::Enter {
        model.abort_chord.forget_if_over(now);
    } else if model.abort_chord.take_late_enter(now) && model.dialog.is_none() && model.pages.entry.is_none()
    {
        let late = "too late for the abort: its question had run out, NOTHING WAS SENT; Ctrl-X, then Enter";
        model.warn(now, late);
        return true;
    }
    // While the chord is begun, another key neither cancels it nor does anything else.
    complete || model.abort_chord.is_begun(now)
}

/// A key while a dialog is open: the next letter of its word, or Enter after the complete word;
/// every other key cancels it.
fn on_dialog_key(model: &mut Model, mut dialog: Dialog, key: Key, touch: KeyOrigin, now: Duration) {
    let by_hand = touch == KeyOrigin::Typed;
    match key {
        AGAIN_KEY if dialog.again_from.is_some() => on_again(model, dialog, by_hand, now),
        Key::Enter if dialog.is_complete() && touch != KeyOrigin::Repeat => {
            model.key_timing.hurried |= !by_hand;
            if model.key_timing.hurried && dialog.prompt.needs_a_hand() {
                model.dialog = Some(dialog.again(now));
            } else {
                confirmed(model, dialog.prompt, now);
            }
        }
        Key::Char(letter) if dialog.take(letter) => {
            model.key_timing.hurried |= !by_hand;
            model.dialog = Some(dialog);
        }
        _ if touch == KeyOrigin::Repeat => model.dialog = Some(dialog),
        _ => {
            let (name, word) = (dialog.prompt.name(), dialog.word());
            let wanted = word.filter(|_| matches!(key, Key::Enter | Key::Char(_)));
            let wanted = wanted.map_or_else(String::new, |word| format!("; the word is {word}"));
            let why = match key {
                Key::Char(letter) if !letter.is_ascii() => format!("{name}: cancelled; {}", layout(letter)),
                _ => format!("{name}: cancelled, nothing was done{wanted}"),
            };
            if let Key::Char(letter) = key {
                model.rest_of_word = RestOfWord::of(&dialog, Some(letter), why.clone(), now);
            }
            model.info(now, why);
            if !by_hand {
                drop_run(model, now);
            }
        }
    }
}

/// The key that confirms a dialog that was completed too fast for a hand.
fn on_again(model: &mut Model, dialog: Dialog, by_hand: bool, now: Duration) {
    if by_hand && dialog.again_from.is_some_and(|from| now >= from) {
        return confirmed(model, dialog.prompt, now);
    }
    let (name, key) = (dialog.prompt.name(), AGAIN_KEY.name());
    model.info(now, format!("{name}: press {key} again, after a pause"));
    model.dialog = Some(Dialog { again_from: Some(now + AGAIN_AFTER), ..dialog });
}

/// The crew has completed every step of a dialog.
fn confirmed(model: &mut Model, prompt: Prompt, now: Duration) {
    if let Prompt::Confirm(waits) = &prompt
        && let Some(why) = why_not_confirm(model, waits, now)
    {
        return model.warn(now, format!("nothing is confirmed: {why}"));
    }
    let Some(wanted) = prompt.request() else {
        // A live station must keep running without its screen; a demonstration or an attached
        // screen may end.
        let stays = model.settings.role == Role::Station && !model.settings.demonstration;
        let leaves = stays && why_not_quit(model, now).is_some();
        return model.outbox.push(if leaves { Action::LeaveScreen } else { Action::Quit });
    };
    if matches!(wanted, Request::Sign { .. }) {
        // The next step that is open is chosen.
        model.pages.step = None;
    }
    request(model, wanted, now);
}

/// Closes a dialog whose time limit has passed.
fn expire(model: &mut Model, now: Duration) {
    if let Some(dialog) = model.dialog.take_if(|dialog| now > dialog.until) {
        let why = format!("{}: time is up, nothing was done", dialog.prompt.name());
        model.rest_of_word = RestOfWord::of(&dialog, None, why.clone(), now);
        model.info(now, why);
    }
}

/// Lets time pass: a dialog may expire, and the abort chord or a key to quit may become complete.
pub(super) fn pass(model: &mut Model, now: Duration) {
    expire(model, now);
    // Only on ticks, because a key may be a further repeat of a held Ctrl-X.
    if model.abort_chord.pass(now) {
        abort(model, now);
    }
    // No other key has followed the key to quit.
    if model.quit_at.is_some_and(|at| now >= at) {
        model.quit_at = None;
        model.outbox.push(Action::Quit);
    }
}

/// A screen that commands nothing was given a command: that is an alarm, because the crew may take
/// a replay for the flight.
fn refuse_command(model: &mut Model, why: &str, now: Duration) {
    model.nothing_sent_at = Some(now);
    model.warn(now, format!("NOTHING WAS SENT: {why}"));
}

/// The warning about a letter that no key and no word has.
fn layout(letter: char) -> String {
    format!("KEYBOARD LAYOUT: {letter} is no key here; change to Latin letters")
}

fn on_free_key(model: &mut Model, key: Key, touch: KeyOrigin, now: Duration) {
    let act = Act::of_key(key);
    model.key_timing.hurried = touch != KeyOrigin::Typed;
    if model.key_timing.hurried && !act.is_some_and(|act| act.is_harmless(model)) {
        return drop_run(model, now);
    }
    if let Some(act) = act {
        return perform(model, act, now);
    }
    let shown = model.page();
    match key {
        Key::Up | Key::Down if shown == Page::Alarms => choose_alarm(model, key == Key::Up),
        Key::Up | Key::Down if shown == Page::Pad && model.pages.checklist && model.checklist.is_some() => {
            choose_step(model, key == Key::Up, now);
        }
        Key::Up | Key::Down if shown == Page::Plot => {
            let next = beside(model.pages.plotted.place(), key == Key::Up, quantity::COUNT - 1);
            model.pages.plotted = &quantity::ALL[next];
        }
        Key::Up | Key::Down if shown == Page::Find => choose_tracker(model, key == Key::Up),
        Key::Up => scroll(model, 1),
        Key::Down => scroll(model, -1),
        Key::PageUp => scroll(model, SCROLL_PAGE),
        Key::PageDown => scroll(model, -SCROLL_PAGE),
        Key::Home => scroll(model, isize::MAX),
        Key::End => scroll(model, -isize::MAX),
        Key::Char(letter) if Act::of_small_letter(letter).is_some() => {
            let [arm, start, disarm] = [Act::Arm, Act::Start, Act::Disarm].map(Act::key_name);
            let words = format!("capital letters: {arm} arms, {start} starts, {disarm} disarms (caps lock?)");
            model.info(now, words);
        }
        Key::Char(letter) if !letter.is_ascii() => model.warn(now, layout(letter)),
        _ => {}
    }
}

/// Does what a key or an entry of the palette stands for. What commands the vehicle only opens its
/// dialog.
pub(super) fn perform(model: &mut Model, act: Act, now: Duration) {
    if let Some(why) = model.settings.role.why_not_command().filter(|_| act.opens_confirmation()) {
        refuse_command(model, why, now);
        return swallow_word(model, act, why.to_owned(), now);
    }
    let shown = model.page();
    if matches!(act, Act::Arm | Act::Start | Act::Disarm | Act::Tap | Act::TakeCommand)
        && let Some(why) = why_not_here(model)
    {
        let name = act.definition().map_or("do that", |definition| definition.name);
        let why = format!("this screen cannot {name}: {why}");
        model.warn(now, why.clone());
        return swallow_word(model, act, why, now);
    }
    match act {
        Act::Arm if confirms(model, TdAct::TD_ACT_ARM, now) => {}
        Act::Start if confirms(model, TdAct::TD_ACT_START, now) => {}
        Act::Arm => open_unless(model, Prompt::Arm, "arm", why_not_arm(model, now), now),
        Act::Start => open_unless(model, Prompt::Start, "start", why_not_start(model, now), now),
        Act::Disarm => match why_nothing_moves(model, now).filter(|_| model.vehicle.as_foreign().is_some()) {
            None => open(model, Prompt::Disarm, now),
            Some(why) => model.warn(now, format!("cannot disarm: {why}")),
        },
        Act::HoldCountdown if model.is_past_hold(now) && act.works(model, now) => {
            model.warn(now, "too late for a hold: Ctrl-X, then Enter, aborts");
        }
        Act::HoldCountdown if act.works(model, now) => open(model, Prompt::Hold, now),
        Act::HoldCountdown => {
            let held = hold_words(model);
            let held = held.map(|words| words.replacen("HOLD", "HELD already", 1));
            model.info(now, held.unwrap_or_else(|| "no countdown runs".to_owned()));
        }
        Act::Tap => request(model, Request::Command(CommandKind::Tap), now),
        Act::TakeCommand => {
            open_unless(model, Prompt::TakeCommand, "take command", why_not_take(model, now), now);
        }
        Act::Seen => open_unless(model, Prompt::Seen, "say so", why_not_seen(model, now), now),
        Act::Check | Act::CheckStill => match standing(model, now) {
            Standing::Runs | Standing::MayRun => request(model, Request::Command(CommandKind::EndCheck), now),
            Standing::JustEnded => {
                model.info(now, "the check has just ended; press again in 3 s for another one");
            }
            Standing::Rests => match why_not_here(model).or_else(|| why_not_check(model, now)) {
                None => {
                    model.pages.hold(Some(Page::Checks));
                    open(model, Prompt::Check { moves: act == Act::Check }, now);
                }
                Some(why) => model.warn(now, format!("cannot check: {why}")),
            },
        },
        Act::RangeTest => {
            if let Some(why) = why_not_check(model, now) {
                // The flight's page stays.
                return model.warn(now, format!("no radio range test: {why}"));
            }
            model.pages.hold(Some(Page::Checks));
            request(model, Request::RangeTest, now);
        }
        Act::Acknowledge => see_alarm(model, now),
        Act::Checklist if model.checklist.is_none() => model.info(now, "there is no checklist (--checklist)"),
        Act::Checklist => {
            model.pages.checklist = !(shown == Page::Pad && model.pages.checklist);
            if shown != Page::Pad {
                model.pages.hold(Some(Page::Pad));
            }
        }
        Act::Report => {
            let watches = (model.settings.role == Role::Watching).then_some("this screen only watches");
            match why_nothing_flown(model).or(watches) {
                Some(why) => model.info(now, format!("no report: {why}")),
                None => request(model, Request::Report, now),
            }
        }
        Act::MovePin if act.works(model, now) => {
            let is_out = model.vehicle.shows(TdInterlock::TD_INTERLOCK_PIN_OUT);
            model.info(now, if is_out { "a person puts the pin in" } else { "a person pulls the pin" });
            model.outbox.push(Action::MovePin(!is_out));
        }
        Act::MovePin => {
            let why = "only a demonstration's pin is moved here, on the ground";
            model.info(now, format!("{why}; `onboard-sim fly` takes `pin in`"));
        }
        Act::SignStep => pad::open_sign_dialog(model, false, now),
        Act::VoidStep => pad::open_sign_dialog(model, true, now),
        Act::Show(Page::Help) if shown == Page::Help => model.pages.hold(None),
        Act::Show(page) => model.pages.hold(Some(page)),
        Act::Hold if model.pages.held.is_some() => model.pages.hold(None),
        Act::Hold => model.pages.hold(Some(shown)),
        Act::Follow => model.pages.hold(None),
        Act::Note if act.works(model, now) => model.pages.entry = Some(TextEntry::default()),
        Act::Note => model.info(now, "this screen only looks on; it records no notes"),
        Act::Palette => model.pages.entry = Some(TextEntry { chosen: Some(0), ..TextEntry::default() }),
        Act::NextTheme => model.outbox.push(Action::NextTheme),
        Act::Redraw => model.outbox.push(Action::Redraw),
        Act::Quit => quit(model, now),
    }
}

/// Opens the dialog of a rung of the ladder, or the one that overrules the only obstacle. If it is
/// refused, the word that the crew would have typed is swallowed.
fn open_unless(model: &mut Model, prompt: Prompt, verb: &str, why_not: Option<String>, now: Duration) {
    let Some(why) = why_not else { return open(model, prompt, now) };
    if let Some(overrules) = overruled_by(model, &why, now) {
        return open(model, overrules, now);
    }
    let why = format!("cannot {verb}: {why}");
    model.warn(now, why.clone());
    model.rest_of_word = Some(RestOfWord::refused(prompt, why, now));
}

/// Swallows the word that the crew types on after a key that this screen refuses: no letter of it
/// may act as a key.
fn swallow_word(model: &mut Model, act: Act, why: String, now: Duration) {
    let prompt = match act {
        Act::Arm => Prompt::Arm,
        Act::Start => Prompt::Start,
        Act::TakeCommand => Prompt::TakeCommand,
        _ => return,
    };
    model.rest_of_word = Some(RestOfWord::refused(prompt, why, now));
}

fn open(model: &mut Model, prompt: Prompt, now: Duration) {
    model.dialog = Some(prompt.open(now));
}

/// Opens the dialog that confirms another operator's proposal, if there is one. If two people press
/// the same key at the same moment, the vehicle accepts the first proposal and reports it to the
/// other.
fn confirms(model: &mut Model, act: TdAct, now: Duration) -> bool {
    let Some(proposal) = model.open_proposal(now).filter(|open| open.act == act) else { return false };
    open_unless(model, Prompt::Confirm(proposal), "confirm", why_not_confirm(model, &proposal, now), now);
    true
}

/// The next or the previous place of a list.
fn beside(at: usize, up: bool, last: usize) -> usize {
    if up { at.saturating_sub(1) } else { (at + 1).min(last) }
}

/// Chooses the next or the previous step of the checklist.
fn choose_step(model: &mut Model, up: bool, now: Duration) {
    let Some(at) = model.chosen_step(now) else { return };
    let last = model.checklist.as_ref().map_or(0, |list| list.steps.len().saturating_sub(1));
    model.pages.step = Some(beside(at, up, last));
}

/// Scrolls up by this many lines; down if negative. Events are listed from the newest line, link
/// values from the first.
fn scroll(model: &mut Model, up: isize) {
    let away = if model.page() == Page::Link { -up } else { up };
    model.pages.scroll = model.pages.scroll.saturating_add_signed(away).min(SCROLL_MAX);
}

/// Executes the crew's request and passes it to the other screens, or sends it to the station.
pub(super) fn request(model: &mut Model, request: Request, now: Duration) {
    if model.settings.role.why_not_command().is_none() {
        model.outbox.push(Action::Request(request.clone()));
    }
    if model.settings.role == Role::Station {
        on_request(model, request, model.settings.seat.clone(), now);
    }
}

/// Acknowledges the alarm in the alarm line, or the chosen one of the list.
fn see_alarm(model: &mut Model, now: Duration) {
    let Some(kind) = model.pointed_at().map(|at| model.alarms.list()[at].what.kind) else { return };
    // The station cannot detect its own silence.
    if model.settings.role == Role::Attached && kind != AlarmKind::StationSilent {
        model.outbox.push(Action::Request(Request::Acknowledge(kind)));
    } else {
        acknowledge(model, kind, now);
    }
}

/// Chooses the next or the previous alarm of the list.
fn choose_alarm(model: &mut Model, up: bool) {
    let list = model.alarms.list();
    if let Some(at) = model.pointed_at() {
        model.pages.chosen = Some(list[beside(at, up, list.len() - 1)].what.kind);
    }
}

/// Chooses the next or the previous of those to look for: the vehicle, then the trackers.
fn choose_tracker(model: &mut Model, up: bool) {
    let ids: Vec<u8> = model.trackers.keys().copied().collect();
    let at = ids.iter().position(|id| Some(*id) == model.pages.tracker).map_or(0, |at| at + 1);
    let next = beside(at, up, ids.len());
    model.pages.tracker = next.checked_sub(1).map(|at| ids[at]);
}

fn abort(model: &mut Model, now: Duration) {
    // Its effect on another autopilot has to be read first.
    if model.vehicle.as_foreign().is_some() {
        open(model, Prompt::AbortForeign, now);
        return;
    }
    model.dialog = None;
    request(model, Request::Command(CommandKind::Abort), now);
}

fn quit(model: &mut Model, now: Duration) {
    if why_not_quit(model, now).is_some() {
        open(model, Prompt::Quit, now);
    } else {
        model.quit_at = Some(now + FINGERS_APART);
    }
}

// The keys while a part of an action's words is typed in the palette.

/// A key while a text is typed. Esc gives up; the keys of the abort never come here.
fn on_entry_key(model: &mut Model, key: Key, now: Duration) {
    let Some(TextEntry { mut typed, chosen }) = model.pages.entry.take() else { return };
    match key {
        Key::Backspace => drop(typed.pop()),
        Key::Char(letter) if typed.chars().count() < NOTE_MAX => typed.push(letter),
        _ => {}
    }
    let chosen = match (key, chosen) {
        (Key::Escape, _) => return,
        (Key::Enter, None) if typed.trim().is_empty() => return,
        (Key::Enter, None) => return request(model, Request::Note(typed), now),
        (Key::Enter, Some(chosen)) => {
            let entry = palette_entries(model, &typed, now).into_iter().nth(chosen);
            return match entry.map(|entry| entry.action) {
                Some(PaletteAction::Act(act)) if model.key_timing.hurried && !act.is_harmless(model) => {
                    drop_run(model, now);
                }
                Some(PaletteAction::Choose(_)) if model.key_timing.hurried => drop_run(model, now),
                Some(action) => perform_entry(model, action, now),
                None => {}
            };
        }
        (Key::Up, Some(chosen)) => Some(chosen.saturating_sub(1)),
        (Key::Down, Some(chosen)) => {
            Some((chosen + 1).min(palette_entries(model, &typed, now).len().saturating_sub(1)))
        }
        _ => chosen.map(|_| 0),
    };
    model.pages.entry = Some(TextEntry { typed, chosen });
}

/// Executes an entry of the palette like its key, so that it never does more than the key.
fn perform_entry(model: &mut Model, action: PaletteAction, now: Duration) {
    match action {
        // Enter has chosen it, and a held Enter would confirm it.
        PaletteAction::Act(
            act @ (Act::Disarm | Act::HoldCountdown | Act::SignStep | Act::VoidStep | Act::Tap),
        ) => model.info(now, format!("press {}: only this key does it", act.key_name())),
        PaletteAction::Act(act) => perform(model, act, now),
        PaletteAction::Choose(boot) => match model.settings.role.why_not_command() {
            None => request(model, Request::Choose(boot), now),
            Some(why) => model.info(now, why),
        },
        PaletteAction::ExplainAbort => model.info(now, "press Ctrl-X, then Enter: only these keys abort"),
        PaletteAction::Plot(quantity) => {
            model.pages.plotted = quantity;
            perform(model, Act::Show(Page::Plot), now);
        }
    }
}
