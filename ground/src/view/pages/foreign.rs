//! What is shown instead of the Pad page while the vehicle is none of ours: its standard telemetry.

use std::time::Duration;

use ratatui::text::{Line, Span};

use crate::model::Model;
use crate::model::foreign::Foreign;
use crate::view::event_list;
use crate::view::number::age_mark;
use crate::view::theme::{TextRole, Theme};

/// The telemetry, and below it the newest events: why something was refused is one of them.
pub fn lines(
    model: &Model,
    foreign: &Foreign,
    theme: Theme,
    now: Duration,
    (columns, rows): (usize, usize),
) -> Vec<Line<'static>> {
    let plain = |text: String| Line::styled(text, theme.style(TextRole::Plain));
    let mut lines = vec![
        Line::styled(format!(" NOT A TOUCHDOWN VEHICLE: {}", foreign.name()), theme.style(TextRole::Alarm)),
        plain(format!(" mode {}, {}", foreign.mode(), if foreign.armed { "ARMED" } else { "disarmed" })),
        plain(" Nothing is armed or started there from here.".to_owned()),
        Line::styled(format!(" An abort {}.", foreign.termination()), theme.style(TextRole::Caution)),
    ];
    lines.extend(foreign.told.iter().map(|(name, text)| {
        let (mark, role) = age_mark(text, now);
        let role = if role == TextRole::Stale { role } else { TextRole::Plain };
        Line::from(vec![
            Span::styled(format!(" {name:<9}"), theme.style(TextRole::Label)),
            Span::styled(format!("{mark}{}", text.value), theme.style(role)),
        ])
    }));
    let room = rows.saturating_sub(lines.len());
    lines.extend(event_list::events(model, theme, columns, room));
    lines
}
