//! The alarms page: every alarm that holds or is not acknowledged, to be acknowledged one by one.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::window;
use crate::model::Model;
use crate::view::alarm_line::{State, cut, state};
use crate::view::theme::{TextRole, Theme};

/// Columns of `ended alarm: ` and shorter words.
const WORD_COLUMNS: usize = 13;

/// The keys, then one alarm per line, the oldest first. The one that Space acknowledges is marked.
pub fn lines(model: &Model, theme: Theme, now: Duration, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let list = model.alarms.list();
    if list.is_empty() {
        return vec![Line::styled(" no active or unacknowledged alarm", theme.style(TextRole::Good))];
    }
    let chosen = model.pointed_at().map(|alarm| alarm.kind);
    let head = Line::from(vec![
        Span::styled(" Space", theme.style(TextRole::Key)),
        Span::styled(" acknowledges the marked one; ", theme.style(TextRole::Label)),
        Span::styled("Up Down", theme.style(TextRole::Key)),
        Span::styled(
            format!(" choose; {} of {} not seen", model.alarms.unacknowledged(), list.len()),
            theme.style(TextRole::Label),
        ),
    ]);
    let mut marked = 0;
    let lines: Vec<Line> = list
        .iter()
        .enumerate()
        .map(|(place, alarm)| {
            let is_chosen = Some(alarm.kind) == chosen;
            if is_chosen {
                marked = place;
            }
            let State { word, age, role } = state(alarm, now);
            let lasted = alarm.ended_at.map(|at| at.saturating_sub(alarm.raised_at).as_secs());
            let lasted = lasted.map_or_else(String::new, |held_s| format!(", held {held_s} s"));
            let mark = if is_chosen { ">" } else { " " };
            let room = columns.saturating_sub(1 + WORD_COLUMNS + age.len() + lasted.len() + 1);
            let text = cut(&alarm.text, room);
            Line::from(vec![
                Span::styled(mark, theme.style(TextRole::Key)),
                Span::styled(format!("{word:<WORD_COLUMNS$}"), theme.style(role)),
                Span::styled(format!("{text:<room$} {age}{lasted}"), theme.style(TextRole::Plain)),
            ])
        })
        .collect();
    let room = rows.saturating_sub(1);
    let start = (marked + 1).saturating_sub(room);
    std::iter::once(head).chain(window(lines, start, room)).collect()
}
