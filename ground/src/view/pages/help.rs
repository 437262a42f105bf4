//! The help page: the keys that work now, and the marks.

use std::time::Duration;

use ratatui::text::{Line, Span};

use crate::model::Model;
use crate::model::act::{Act, DEFINITIONS};
use crate::model::palette::ABORT_WORDS;
use crate::view::theme::{TextRole, Theme};

/// Columns of a key.
const KEY_COLUMNS: usize = 13;

/// Columns for the names of pages, on the smallest whole screen.
const PAGES_COLUMNS: usize = 80 - KEY_COLUMNS - 1;

const REPLAY: [(&str, &str); 4] = [
    ("Space", "pause, or go on"),
    ("Left Right", "5 s back or forward"),
    ("[ ]", "to the phase before or after; g G to the begin or end"),
    ("+ -", "faster or slower"),
];

const MARKS: [&str; 4] = [
    "~ older than 1.5 s; o command, # actual; line flown, dots planned; * computed",
    "on the ground. Commanded, acknowledged and observed are three facts; armed is",
    "what HEARTBEAT says. Without link, + is the PREDICTED position, its circle",
    "contains it in 19 of 20 cases. A last … is a cut line; a wider screen has more.",
];

/// The actions whose keys do something now; those that show a page in one line.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let line = |key: String, words: &str| {
        Line::from(vec![
            Span::styled(format!(" {key:<KEY_COLUMNS$}"), theme.style(TextRole::Key)),
            Span::styled(words.to_owned(), theme.style(TextRole::Plain)),
        ])
    };
    let mut lines = Vec::new();
    if model.settings.role.why_not_command().is_none() {
        lines.push(line("Ctrl-X Enter".to_owned(), ABORT_WORDS));
    }
    if model.playing.is_some() {
        lines.extend(REPLAY.map(|(key, words)| line(key.to_owned(), words)));
    }
    let keys = &model.settings.keys;
    let works = DEFINITIONS.iter().filter(|definition| definition.act.works(model, now));
    // The smallest screen has no room for every key. The palette lists these, too, and the page of the checks its own.
    let elsewhere =
        |act: Act| matches!(act, Act::Show(_) | Act::Redraw | Act::Check | Act::CheckStill | Act::RangeTest);
    for definition in works.filter(|definition| !elsewhere(definition.act)) {
        lines.push(line(keys.name(definition.act), definition.words));
    }
    let pages = DEFINITIONS.iter().filter_map(|definition| match definition.act {
        Act::Show(page) => Some(format!("{} {}", keys.name(definition.act), page.name())),
        _ => None,
    });
    let mut rows: Vec<String> = Vec::new();
    for page in pages {
        match rows.last_mut().filter(|row| row.len() + 2 + page.len() <= PAGES_COLUMNS) {
            Some(row) => *row = format!("{row}  {page}"),
            None => rows.push(page),
        }
    }
    lines.extend(rows.iter().map(|row| line("pages".to_owned(), row)));
    lines.extend(MARKS.map(|mark| Line::styled(format!(" {mark}"), theme.style(TextRole::Label))));
    lines
}
