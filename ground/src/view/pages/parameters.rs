//! The parameters page: the vehicle's parameters by name.

use ratatui::text::{Line, Span};

use super::window;
use crate::model::Model;
use crate::view::filter;
use crate::view::number::shortest;
use crate::view::theme::{TextRole, Theme};

/// How many are known, then one parameter per line.
pub fn lines(model: &Model, theme: Theme, rows: usize) -> Vec<Line<'static>> {
    let parameters = &model.parameters;
    let of = parameters.count.map_or_else(|| "?".to_owned(), |count| count.to_string());
    let state = if parameters.is_empty() && parameters.asked {
        " requested; no answer yet".to_owned()
    } else if parameters.is_empty() {
        " not requested yet".to_owned()
    } else {
        format!(" {} of {of} known", parameters.len())
    };
    let head = Line::from(vec![
        Span::styled(state, theme.style(TextRole::Plain)),
        Span::styled("   r", theme.style(TextRole::Key)),
        Span::styled(" asks the vehicle again; read-only here", theme.style(TextRole::Label)),
    ]);
    let head = filter::line(model, theme).unwrap_or(head);
    let list: Vec<Line> = parameters
        .iter()
        .filter(|(name, _)| model.pages.lets_pass(name))
        .map(|(name, value)| {
            Line::from(vec![
                Span::styled(format!("  {name:<18}"), theme.style(TextRole::Label)),
                Span::styled(format!("{:>14}", shortest(value)), theme.style(TextRole::Plain)),
            ])
        })
        .collect();
    // Scrolling up goes towards the first line.
    let start = list.len().saturating_sub(rows.saturating_sub(1)).min(model.pages.scroll);
    std::iter::once(head).chain(window(list, start, rows.saturating_sub(1))).collect()
}
