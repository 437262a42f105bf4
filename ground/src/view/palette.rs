//! The box of the palette: the typed text, and the actions found with their keys.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear};

use super::draw_lines;
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::page::TextEntry;
use crate::model::palette::found;

const BOX_COLUMNS: u16 = 74;
/// Rows around the list: the border, and the line of the typed text.
const FRAME_ROWS: u16 = 3;
/// Columns of a key.
const KEY_COLUMNS: usize = 7;

pub fn draw(model: &Model, theme: Theme, frame: &mut Frame, area: Rect) {
    if !matches!(model.pages.entry, Some(TextEntry::Palette { .. })) {
        return;
    }
    let width = BOX_COLUMNS.min(area.width);
    let at = Rect { x: area.x + (area.width - width) / 2, width, ..area }.intersection(frame.area());
    let block = Block::bordered().title(Line::styled(" Every action ", theme.style(TextRole::Title)));
    let inside = block.inner(at);
    frame.render_widget(Clear, at);
    frame.buffer_mut().set_style(at, theme.ground());
    frame.render_widget(block, at);
    draw_lines(frame, inside, &lines(model, theme, usize::from(at.height.saturating_sub(FRAME_ROWS))));
}

/// The typed text and this many of the actions found, the marked one among them. Empty while it is closed.
pub fn lines(model: &Model, theme: Theme, rows: usize) -> Vec<Line<'static>> {
    let Some(TextEntry::Palette { typed, chosen }) = &model.pages.entry else { return Vec::new() };
    let entries = found(model, typed);
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
