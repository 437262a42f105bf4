//! The text of the open dialog, and its box; the box of the palette.

use std::time::Duration;

use protocol::dialect::{TdAct, TdRole};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear};

use super::draw_lines;
use super::theme::{TextRole, Theme};
use crate::model::act::{Act, palette_entries};
use crate::model::command::why_not_here;
use crate::model::crew::role_name;
use crate::model::dialog::{
    ABORT_WORD, AGAIN_KEY, ARM_WORD, CONFIRM_WORD, Dialog, QUIT_WORD, START_WORD, TAKE_WORD, WITHOUT_LOG_WORD,
};
use crate::model::identity::Foreign;
use crate::model::pad_check::PadCheck;
use crate::model::page::TextEntry;
use crate::model::{Model, Role, words};

const BOX_COLUMNS: u16 = 68;
const ANY_OTHER_KEY: &str = "Any other key cancels. Nothing is sent before Enter.";

/// Title and lines of the open dialog; `None` if none is open.
pub fn dialog_lines(
    model: &Model,
    theme: Theme,
    now: Duration,
) -> Option<(&'static str, Vec<Line<'static>>)> {
    let left = model.dialog.until().map_or(0.0, |until| until.saturating_sub(now).as_secs_f64());
    let plain = |text: String| Line::styled(text, theme.style(TextRole::Plain));
    let strong = |text: String| Line::styled(text, theme.style(TextRole::Caution));
    let dialog = match &model.dialog {
        Dialog::Closed => return notice(model, theme, now),
        Dialog::Arm { typed, .. } => {
            let mut lines = vec![
                strong(format!("Type {ARM_WORD} and Enter within {left:.0} s:  [{typed:<3}]")),
                plain(ANY_OTHER_KEY.to_owned()),
            ];
            lines.extend(checks(model, theme));
            if let Some(words) = next_person(model) {
                lines.insert(1, plain(words));
            }
            ("ARM, step 2 of 2", lines)
        }
        Dialog::Start { typed, .. } => {
            let typing = format!("Type {START_WORD} and Enter within {left:.0} s:  [{typed:<5}]");
            let mut lines = vec![strong(typing), plain(ANY_OTHER_KEY.to_owned())];
            if let Some(words) = next_person(model) {
                lines.insert(1, plain(words));
            }
            ("START the countdown", lines)
        }
        Dialog::Confirm { ask, typed, .. } => (
            "CONFIRM what another operator asks",
            vec![
                plain(format!("{} asks to {}.", model.operator(ask.by), ask.act_name())),
                strong(format!("Type {CONFIRM_WORD} and Enter within {left:.0} s:  [{typed:<7}]")),
                plain(ANY_OTHER_KEY.to_owned()),
            ],
        ),
        Dialog::TakeCommand { typed, .. } => (
            "TAKE COMMAND of an armed vehicle",
            vec![
                plain(format!("{} is in command, if the vehicle hears them.", commander(model))),
                strong(format!("Type {TAKE_WORD} and Enter within {left:.0} s:  [{typed:<4}]")),
                plain(ANY_OTHER_KEY.to_owned()),
            ],
        ),
        Dialog::AbortForeign { typed, .. } => {
            let foreign = model.vehicle.as_foreign();
            let name = foreign.map_or_else(|| "The vehicle".to_owned(), Foreign::name);
            let does = foreign.map_or("does not say what it does", Foreign::termination);
            (
                "ABORT of a vehicle that is NOT A TOUCHDOWN VEHICLE",
                vec![
                    strong(format!("{name}: flight termination {does}.")),
                    strong(format!("Type {ABORT_WORD} and Enter within {left:.0} s:  [{typed:<5}]")),
                    plain(ANY_OTHER_KEY.to_owned()),
                ],
            )
        }
        Dialog::WithoutLog { typed, .. } => without_log(model, typed, left, theme, now),
        Dialog::Hold { .. } => (
            "HOLD the countdown",
            vec![
                strong(format!("Enter within {left:.0} s holds.")),
                plain("Then only a new start counts down again. Any other key cancels.".to_owned()),
            ],
        ),
        Dialog::Check { moves, .. } => (
            "CHECK the vehicle",
            vec![
                if *moves {
                    strong(format!("Gimbal and fins MOVE for 8 s: hands off. Enter within {left:.0} s."))
                } else {
                    strong(format!("Nothing moves. Enter within {left:.0} s begins."))
                },
                plain("Then the sensors are watched for 5 s: touch nothing.".to_owned()),
                plain("Any other key cancels.".to_owned()),
            ],
        ),
        Dialog::Sign { step, void, .. } => sign(model, (*step, *void), left, theme),
        Dialog::Disarm { .. } => (
            "DISARM",
            vec![
                strong(format!("Enter within {left:.0} s disarms.")),
                plain("Any other key cancels.".to_owned()),
            ],
        ),
        Dialog::Quit { typed, .. } => quit(model, typed, left, theme),
        Dialog::Again { of, .. } => again(of.name(), left, theme),
    };
    Some(dialog)
}

/// The question whether a person typed the keys.
fn again(name: &str, left_s: f64, theme: Theme) -> (&'static str, Vec<Line<'static>>) {
    let plain = |text: String| Line::styled(text, theme.style(TextRole::Plain));
    let key = AGAIN_KEY.name();
    let lines = vec![
        plain(format!("The keys for the {name} came faster than a hand types:")),
        plain("a paste, or a connection that delivers them in bunches.".to_owned()),
        Line::styled(format!("{key} within {left_s:.0} s: yes, do it."), theme.style(TextRole::Caution)),
        plain("Any other key cancels. Nothing has been sent.".to_owned()),
    ];
    ("DID YOU TYPE THIS?", lines)
}

/// Who quits leaves the vehicle as it is.
fn quit(model: &Model, typed: &str, left_s: f64, theme: Theme) -> (&'static str, Vec<Line<'static>>) {
    let goes_on = match model.settings.role {
        Role::Station if model.settings.demonstration => "Quitting ends the demonstration.",
        Role::Station => "The station continues without a screen: `ground attach` shows it.",
        _ => "The station continues; a countdown is held once nobody can command.",
    };
    let words = format!("Type {QUIT_WORD} and Enter within {left_s:.0} s:  [{typed:<4}]");
    let lines = vec![
        Line::styled(words, theme.style(TextRole::Caution)),
        Line::styled(goes_on, theme.style(TextRole::Plain)),
        Line::styled(
            "Quitting neither disarms nor aborts. Any other key cancels.",
            theme.style(TextRole::Plain),
        ),
    ];
    ("QUIT although armed or in flight", lines)
}

/// What is wrong with the station's log, and what goes on without it.
fn without_log(
    model: &Model,
    typed: &str,
    left_s: f64,
    theme: Theme,
    now: Duration,
) -> (&'static str, Vec<Line<'static>>) {
    let why = model.why_no_log(now).unwrap_or_else(|| "It is fit again.".to_owned());
    let words = format!("Type {WITHOUT_LOG_WORD} and Enter within {left_s:.0} s:  [{typed:<5}]");
    let goes_on = "Then arm and start go on without a record, a book and a place.";
    let lines = vec![
        Line::styled(why, theme.style(TextRole::Alarm)),
        Line::styled(words, theme.style(TextRole::Caution)),
        Line::styled(goes_on, theme.style(TextRole::Plain)),
        Line::styled(ANY_OTHER_KEY, theme.style(TextRole::Plain)),
    ];
    ("THE STATION'S LOG IS UNFIT", lines)
}

/// The step that is signed or voided, and who signs it.
fn sign(
    model: &Model,
    (number, void): (usize, bool),
    left_s: f64,
    theme: Theme,
) -> (&'static str, Vec<Line<'static>>) {
    let step = model.checklist.as_ref().and_then(|list| list.steps.get(number));
    let words = step.map(|step| step.words.clone()).unwrap_or_default();
    let who = step.and_then(|step| step.role).map_or("Anybody who commands", role_name);
    let verb = if void { "voids the signature" } else { "signs" };
    let lines = vec![
        Line::styled(format!("{}: {words}", number + 1), theme.style(TextRole::Plain)),
        Line::styled(format!("Enter within {left_s:.0} s {verb}."), theme.style(TextRole::Caution)),
        Line::styled(format!("{who} signs it. Any other key cancels."), theme.style(TextRole::Plain)),
    ];
    (if void { "VOID a step of the checklist" } else { "SIGN a step of the checklist" }, lines)
}

/// What somebody else has to do after this dialog.
fn next_person(model: &Model) -> Option<String> {
    let own = model.role_of(model.own_number()).filter(|_| model.people() == Some(2))?;
    let words = format!("This only asks: {} must confirm within 10 s.", other_roles(own));
    Some(words)
}

/// The other roles that may command.
fn other_roles(own: TdRole) -> String {
    let all = [TdRole::TD_ROLE_RANGE_SAFETY, TdRole::TD_ROLE_FLIGHT, TdRole::TD_ROLE_PAD];
    all.into_iter().filter(|role| *role != own).map(role_name).collect::<Vec<_>>().join(" or ")
}

/// Who is in command.
fn commander(model: &Model) -> String {
    match (model.commanded_by(), model.link.uplink.armed_by_other) {
        (Some(number), _) => model.operator(number),
        (None, Some(other)) => format!("station {}/{}", other.system_id, other.component_id),
        (None, None) => "another station".to_owned(),
    }
}

/// What is asked or waited for, while no dialog is open: it is on every page.
fn notice(model: &Model, theme: Theme, now: Duration) -> Option<(&'static str, Vec<Line<'static>>)> {
    let plain = |text: String| Line::styled(text, theme.style(TextRole::Plain));
    let strong = |text: String| Line::styled(text, theme.style(TextRole::Caution));
    let keys = &model.settings.keys;
    let own = model.own_number();
    if let Some(ask) = model.ask(now) {
        let (left_s, act) = (ask.left.as_secs_f64(), ask.act_name());
        let who = model.operator(ask.by);
        if ask.by == own && own > 0 {
            let others = model.role_of(own).map_or_else(String::new, other_roles);
            let words = format!("{others} must confirm within {left_s:.0} s.");
            return Some(("ASKED", vec![plain(format!("You ask to {act}.")), strong(words)]));
        }
        let key = keys.name(if ask.act == TdAct::TD_ACT_START { Act::Start } else { Act::Arm });
        let words = match model.ask_to_confirm(now) {
            Some(_) if why_not_here(model).is_none() => strong(format!(
                "Press {key} within {left_s:.0} s, then type {CONFIRM_WORD} and Enter to confirm."
            )),
            _ => plain(format!("Another role must confirm within {left_s:.0} s; not this screen.")),
        };
        return Some(("ANOTHER OPERATOR ASKS", vec![strong(format!("{who} asks to {act}.")), words]));
    }
    let (by, left) = model.tapping(now)?;
    let left_s = left.as_secs_f64();
    if by == own && why_not_here(model).is_none() {
        let key = keys.name(Act::Tap);
        let words = format!("Tap {key}: {left_s:.1} s left, or the countdown is held.");
        return Some(("TAP at least every 2 s", vec![strong(words)]));
    }
    let words = format!("{} taps: {left_s:.1} s left, or the countdown is held.", model.operator(by));
    Some(("TAPS", vec![plain(words)]))
}

fn checks(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    let Some(status) = model.vehicle.status.as_ref() else {
        return vec![Line::styled(
            "The vehicle has not reported its checks.",
            theme.style(TextRole::Caution),
        )];
    };
    let failing = words::failed_checks(status.value.checks_failed);
    if failing.is_empty() {
        let mut lines = vec![Line::styled("Every arming check passes.", theme.style(TextRole::Good))];
        let failure = model.vehicle.pad_check.as_ref().and_then(PadCheck::failure);
        lines.extend(failure.map(|failure| Line::styled(failure, theme.style(TextRole::Alarm))));
        return lines;
    }
    let mut lines =
        vec![Line::styled("Failing checks; the vehicle will refuse:", theme.style(TextRole::Alarm))];
    lines.extend(
        failing.into_iter().map(|name| Line::styled(format!("  NO {name}"), theme.style(TextRole::Caution))),
    );
    lines
}

/// Draws the open dialog in the middle of an area.
pub fn draw_dialog(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let Some((title, lines)) = dialog_lines(model, theme, now) else { return };
    let width = BOX_COLUMNS.min(area.width);
    let height = u16::try_from(lines.len()).unwrap_or(u16::MAX).saturating_add(2).min(area.height);
    // A notice leaves the middle of the page free.
    let free = area.height - height;
    let down = if model.dialog == Dialog::Closed { free } else { free / 2 };
    let at = Rect { x: area.x + (area.width - width) / 2, y: area.y + down, width, height };
    let at = at.intersection(frame.area());
    let block = Block::bordered().title(Line::styled(format!(" {title} "), theme.style(TextRole::Title)));
    let inside = block.inner(at);
    frame.render_widget(Clear, at);
    frame.buffer_mut().set_style(at, theme.ground());
    frame.render_widget(block, at);
    let padded = Rect { x: inside.x + 1, width: inside.width.saturating_sub(2), ..inside };
    draw_lines(frame, padded, &lines);
}

// The box of the palette: the typed text, and the actions found with their keys.

const PALETTE_COLUMNS: u16 = 74;
/// Rows around the list: the border, and the line of the typed text.
const FRAME_ROWS: u16 = 3;
/// Columns of a key.
const KEY_COLUMNS: usize = 7;

pub fn draw_palette(model: &Model, theme: Theme, frame: &mut Frame, area: Rect) {
    if !matches!(model.pages.entry, Some(TextEntry::Palette { .. })) {
        return;
    }
    let width = PALETTE_COLUMNS.min(area.width);
    let at = Rect { x: area.x + (area.width - width) / 2, width, ..area }.intersection(frame.area());
    let block = Block::bordered().title(Line::styled(" Every action ", theme.style(TextRole::Title)));
    let inside = block.inner(at);
    frame.render_widget(Clear, at);
    frame.buffer_mut().set_style(at, theme.ground());
    frame.render_widget(block, at);
    draw_lines(
        frame,
        inside,
        &palette_lines(model, theme, usize::from(at.height.saturating_sub(FRAME_ROWS))),
    );
}

/// The typed text and this many of the actions found, the marked one among them. Empty while it is closed.
pub fn palette_lines(model: &Model, theme: Theme, rows: usize) -> Vec<Line<'static>> {
    let Some(TextEntry::Palette { typed, chosen }) = &model.pages.entry else { return Vec::new() };
    let entries = palette_entries(model, typed);
    let head = Line::from(vec![
        Span::styled(format!(" :{typed}_"), theme.style(TextRole::Key)),
        Span::styled(
            format!("   {} found; Up Down choose, Enter does it, Esc closes", entries.len()),
            theme.style(TextRole::Label),
        ),
    ]);
    let start = (chosen + 1).saturating_sub(rows);
    let list = entries.iter().enumerate().skip(start).take(rows).map(|(place, entry)| {
        let (mark, role) = if place == *chosen { (">", TextRole::Key) } else { (" ", TextRole::Plain) };
        Line::from(vec![
            Span::styled(format!("{mark}{:<KEY_COLUMNS$}", entry.key), theme.style(TextRole::Key)),
            Span::styled(entry.words.clone(), theme.style(role)),
        ])
    });
    std::iter::once(head).chain(list).collect()
}
