//! The pages that are lists: alarms, texts, the recording, help.

use std::time::Duration;

use ratatui::text::Line;

use crate::model::{ABORT_WORDS, Act, Alarm, DEFINITIONS, Model, Role};
use crate::view::status_lines::{alarm_state, cut};
use crate::view::{TextRole, Theme, lists};

/// Columns of `ended alarm: ` and shorter words.
const WORD_COLUMNS: usize = 13;

/// The keys, then one alarm per line, the oldest first. The one that Space acknowledges is marked.
pub fn alarms(model: &Model, theme: Theme, now: Duration, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let list = model.alarms.list();
    if list.is_empty() {
        return vec![theme.line(" no active or unacknowledged alarm", TextRole::Plain)];
    }
    let chosen = model.pointed_at();
    let head = Line::from(vec![
        theme.key(" Space"),
        theme.label(" acknowledges the marked one; "),
        theme.key("Up Down"),
        theme.label(format!(" choose; {} of {} not seen", model.alarms.unacknowledged(), list.len())),
    ]);
    let line = |(place, alarm): (usize, &Alarm)| {
        let (word, age, role) = alarm_state(alarm, now);
        let lasted = alarm.ended_at.map(|at| at.saturating_sub(alarm.raised_at).as_secs());
        let lasted = lasted.map_or_else(String::new, |held_s| format!(", held {held_s} s"));
        let mark = if Some(place) == chosen { ">" } else { " " };
        let room = columns.saturating_sub(1 + WORD_COLUMNS + age.len() + lasted.len() + 1);
        let text = cut(&alarm.what.text, room);
        Line::from(vec![
            theme.key(mark),
            theme.span(format!("{word:<WORD_COLUMNS$}"), role),
            theme.plain(format!("{text:<room$} {age}{lasted}")),
        ])
    };
    let room = rows.saturating_sub(1);
    let start = (chosen.unwrap_or(0) + 1).saturating_sub(room);
    let lines = list.iter().enumerate().map(line).skip(start).take(room);
    std::iter::once(head).chain(lines).collect()
}

// The texts page: the list of events, newest at the bottom.

/// Enough lines for every kept event, each wrapped to a few lines.
const EVERY_LINE: usize = 4_000;

/// The newest events, or older ones when scrolled back.
pub fn messages_lines(model: &Model, theme: Theme, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let all = lists::events(model, theme, columns, EVERY_LINE);
    let (count, room) = (all.len(), rows.saturating_sub(1));
    let back = model.pages.scroll.min(count.saturating_sub(room));
    let place = if back == 0 { String::new() } else { format!(", {back} below") };
    let text = format!(" {count} lines{place}; Up and Down scroll");
    let shown = all.into_iter().skip(count.saturating_sub(room + back)).take(room);
    std::iter::once(theme.line(text, TextRole::Label)).chain(shown).collect()
}

// The log page: whether the flight is recorded, and where.

/// The end of the book: its entries, its head, whether it is signed, and how many entries the
/// vehicle has confirmed.
fn book(model: &Model) -> String {
    let Some(signed) = model.book.head else { return "none".to_owned() };
    let (entries, hash) = (signed.head.entries, protocol::book::shown(&signed.head.hash[..6]));
    let is_signed = if model.book.is_signed { "signed" } else { "not signed" };
    format!("{entries} entries, head {hash}, {is_signed}; {} at the vehicle", model.book.confirmed)
}

/// The state of the recording, its files and counts.
pub fn log_lines(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    let row = |label: &str, value: String, role: TextRole| {
        Line::from(vec![theme.label(format!(" {label:<14}")), theme.span(value, role)])
    };
    if model.settings.role == Role::Replaying {
        return vec![
            row("state", "a recorded flight; nothing is written".to_owned(), TextRole::Plain),
            row("log", model.settings.log_path.clone().unwrap_or_default(), TextRole::Plain),
        ];
    }
    let state = match (&model.settings.log_path, model.log.failed, model.log.dropped) {
        (None, _, _) => row("state", "NOT RECORDING: --log none".to_owned(), TextRole::Caution),
        (Some(_), true, _) => row("state", "FAILED: nothing more is recorded".to_owned(), TextRole::Alarm),
        (Some(_), false, 0) => row("state", "recording; nothing lost".to_owned(), TextRole::Good),
        (Some(_), false, lost) => row("state", format!("recording; {lost} records LOST"), TextRole::Caution),
    };
    let none = || "none".to_owned();
    let space = model.log.space.map_or_else(|| "not known".to_owned(), |space| space.words());
    vec![
        state,
        row("log", model.settings.log_path.clone().unwrap_or_else(none), TextRole::Plain),
        row("space", space, TextRole::Plain),
        row("book", book(model), TextRole::Plain),
    ]
}

// The help page: the keys that work now, and the marks.

/// Columns of a key.
const KEY_COLUMNS: usize = 12;

const REPLAY: [(&str, &str); 4] = [
    ("Space", "pause, or go on"),
    ("Left Right", "5 s back or forward"),
    ("[ ]", "to the phase before or after; g G to the begin or end"),
    ("+ -", "faster or slower"),
];

const MARKS: &str = "~ older than 1.5 s; thick line flown, dots predicted; ▄ measured, │ commanded; on the map o is the crew. \
    Commanded, acknowledged and observed are three facts; armed is what HEARTBEAT says. Without link, + is the PREDICTED \
    position, its circle contains it in 19 of 20 cases. A last … is a cut line; a wider screen has more.";

/// The actions whose keys do something now; those that show a page in one line.
pub fn help_lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let room = columns.saturating_sub(KEY_COLUMNS + 2);
    let line = |key: String, words: &str| {
        let keys = std::iter::once(key).chain(std::iter::repeat(String::new()));
        let row = |(words, key): (String, String)| {
            Line::from(vec![theme.key(format!(" {key:<KEY_COLUMNS$} ")), theme.plain(words)])
        };
        lists::wrap(words, room).into_iter().zip(keys).map(row).collect::<Vec<_>>()
    };
    let mut lines = Vec::new();
    if model.settings.role.why_not_command().is_none() {
        lines.extend(line("Ctrl-X Enter".to_owned(), ABORT_WORDS));
    }
    if model.playing.is_some() {
        lines.extend(REPLAY.into_iter().flat_map(|(key, words)| line(key.to_owned(), words)));
    }
    let works = DEFINITIONS.iter().filter(|definition| definition.act.works(model, now));
    // The smallest screen has no room for every key. The palette lists these, too, and the page of
    // the checks its own.
    let elsewhere =
        |act: Act| matches!(act, Act::Show(_) | Act::Redraw | Act::Check | Act::CheckStill | Act::RangeTest);
    for definition in works.filter(|definition| !elsewhere(definition.act)) {
        lines.extend(line(definition.act.key_name(), definition.words));
    }
    let pages = DEFINITIONS.iter().filter_map(|definition| match definition.act {
        Act::Show(page) => Some(format!("{}{}", definition.act.key_name(), page.name())),
        _ => None,
    });
    let pages = pages.collect::<Vec<_>>().join(" ");
    lines.extend(line("pages".to_owned(), &pages));
    let marks = lists::wrap(MARKS, columns.saturating_sub(1)).into_iter();
    lines.extend(marks.map(|mark| theme.line(format!(" {mark}"), TextRole::Label)));
    lines
}
