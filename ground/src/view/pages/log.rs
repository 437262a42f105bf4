//! The recording.

use std::time::Duration;

use ratatui::text::{Line, Span};

use crate::model::{self, Model};
use crate::view::number::seconds;
use crate::view::theme::{Role, Theme};

/// Where it goes, and whether it holds everything.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let row = |label: &str, value: String, role: Role| {
        Line::from(vec![
            Span::styled(format!(" {label:<14}"), theme.style(Role::Label)),
            Span::styled(value, theme.style(role)),
        ])
    };
    if model.settings.role == model::Role::Replaying {
        return vec![
            row("state", "a recorded flight; nothing is written".to_owned(), Role::Plain),
            row("log", model.settings.log_path.clone().unwrap_or_default(), Role::Plain),
            row("events", model.events.total().to_string(), Role::Plain),
        ];
    }
    let state = match (&model.settings.log_path, model.log.failed, model.log.dropped) {
        (None, _, _) => row("state", "NOT RECORDING: --log none".to_owned(), Role::Caution),
        (Some(_), true, _) => row("state", "FAILED: nothing more is recorded".to_owned(), Role::Alarm),
        (Some(_), false, 0) => row("state", "recording; nothing lost".to_owned(), Role::Good),
        (Some(_), false, lost) => row("state", format!("recording; {lost} records LOST"), Role::Caution),
    };
    let none = || "none".to_owned();
    vec![
        state,
        row("log", model.settings.log_path.clone().unwrap_or_else(none), Role::Plain),
        row("telemetry log", model.settings.tlog_path.clone().unwrap_or_else(none), Role::Plain),
        row("running for", seconds(now), Role::Plain),
        row("events", model.events.total().to_string(), Role::Plain),
        Line::default(),
        Line::styled(
            " Both directions of the link, every key, command and event are recorded.",
            theme.style(Role::Label),
        ),
        Line::styled(
            " What is older than 0.2 s is on the disk, whatever happens to this program.",
            theme.style(Role::Label),
        ),
    ]
}
