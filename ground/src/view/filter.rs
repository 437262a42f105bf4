//! The line of the filter, above a list that it narrows down.

use ratatui::text::{Line, Span};

use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::page::TextEntry;

/// `None` without a filter.
pub fn line(model: &Model, theme: Theme) -> Option<Line<'static>> {
    let typing = model.pages.entry == Some(TextEntry::Filter);
    let filter = &model.pages.filter;
    if filter.is_empty() && !typing {
        return None;
    }
    let (cursor, keys) =
        if typing { ("_", "Enter keeps it, Esc lists all") } else { ("", "FILTERED; Esc lists all") };
    Some(Line::from(vec![
        Span::styled(format!(" /{filter}{cursor}"), theme.style(TextRole::Key)),
        Span::styled(format!("   {keys}"), theme.style(TextRole::Caution)),
    ]))
}
