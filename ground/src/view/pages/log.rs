//! The log page: whether the flight is recorded, and where.

use std::time::Duration;

use ratatui::text::{Line, Span};

use crate::model::{Model, Role};
use crate::view::number::seconds;
use crate::view::theme::{TextRole, Theme};

/// The end of the book: how many entries, the head, whether it is signed, and what the vehicle has of it.
fn book(model: &Model) -> String {
    let Some(signed) = model.book.head else { return "none".to_owned() };
    let (entries, hash) = (signed.head.entries, protocol::book::shown(&signed.head.hash[..6]));
    let is_signed = if model.book.is_signed { "signed" } else { "not signed" };
    format!("{entries} entries, head {hash}, {is_signed}; {} at the vehicle", model.book.kept)
}

/// The space that is left for the log, and how fast it grows.
fn space(model: &Model) -> String {
    model.log.space.map_or_else(|| "not known".to_owned(), |space| space.words())
}

/// The state of the recording, its files and counts.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let row = |label: &str, value: String, role: TextRole| {
        Line::from(vec![
            Span::styled(format!(" {label:<14}"), theme.style(TextRole::Label)),
            Span::styled(value, theme.style(role)),
        ])
    };
    if model.settings.role == Role::Replaying {
        return vec![
            row("state", "a recorded flight; nothing is written".to_owned(), TextRole::Plain),
            row("log", model.settings.log_path.clone().unwrap_or_default(), TextRole::Plain),
            row("events", model.events.total().to_string(), TextRole::Plain),
        ];
    }
    let state = match (&model.settings.log_path, model.log.failed, model.log.dropped) {
        (None, _, _) => row("state", "NOT RECORDING: --log none".to_owned(), TextRole::Caution),
        (Some(_), true, _) => row("state", "FAILED: nothing more is recorded".to_owned(), TextRole::Alarm),
        (Some(_), false, 0) => row("state", "recording; nothing lost".to_owned(), TextRole::Good),
        (Some(_), false, lost) => row("state", format!("recording; {lost} records LOST"), TextRole::Caution),
    };
    let none = || "none".to_owned();
    vec![
        state,
        row("log", model.settings.log_path.clone().unwrap_or_else(none), TextRole::Plain),
        row("telemetry log", model.settings.tlog_path.clone().unwrap_or_else(none), TextRole::Plain),
        row("space", space(model), TextRole::Plain),
        row("running for", seconds(now), TextRole::Plain),
        row("events", model.events.total().to_string(), TextRole::Plain),
        row("book", book(model), TextRole::Plain),
        Line::default(),
        Line::styled(
            " Both directions of the link, every key, command and event are recorded.",
            theme.style(TextRole::Label),
        ),
        Line::styled(
            " Records older than 0.2 s are on disk, even if this program crashes.",
            theme.style(TextRole::Label),
        ),
    ]
}
