//! The texts page: the list of events, newest at the bottom.

use ratatui::text::Line;

use super::window;
use crate::model::Model;
use crate::view::theme::{TextRole, Theme};
use crate::view::{event_list, filter};

/// Enough lines for every kept event, each wrapped to a few lines.
const EVERY_LINE: usize = 4_000;

/// The newest events, or older ones when scrolled back.
pub fn lines(model: &Model, theme: Theme, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let all = event_list::filtered(model, theme, columns, EVERY_LINE);
    let room = rows.saturating_sub(1);
    let back = model.pages.scroll.min(all.len().saturating_sub(room));
    let start = all.len().saturating_sub(room + back);
    let count = all.len();
    let mut lines = window(all, start, room);
    let place = if back == 0 { String::new() } else { format!(", {back} below") };
    let text = format!(" {} events, {count} lines{place}; Up and Down scroll", model.events.total());
    let head = filter::line(model, theme);
    lines.insert(0, head.unwrap_or_else(|| Line::styled(text, theme.style(TextRole::Label))));
    lines
}
