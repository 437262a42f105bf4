//! The line of the pinned numbers.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::number::{age_mark, fixed};
use super::theme::{TextRole, Theme};
use crate::model::Model;

/// Columns of one number with its name, so that nothing moves when it changes.
const COLUMNS: usize = 26;

pub fn line(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let spans = model.pages.pinned.iter().flat_map(|quantity| {
        let sample = quantity.read(model, now);
        let (mark, role) = sample.as_ref().map_or((" ", TextRole::Label), |sample| age_mark(sample, now));
        let value = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, quantity.decimals));
        let name = format!(" {}", quantity.name);
        let room = COLUMNS.saturating_sub(name.chars().count());
        let role = if role == TextRole::Plain { TextRole::Title } else { role };
        [
            Span::styled(name, theme.style(TextRole::Label)),
            Span::styled(format!("{:<room$}", format!("{mark}{value} {}", quantity.unit)), theme.style(role)),
        ]
    });
    Line::from(spans.collect::<Vec<_>>())
}
