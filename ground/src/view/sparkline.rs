//! A quantity over the last minute, in one or a few rows, with its name, its range and its present value.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::Sparkline;

use super::draw_line;
use super::number::{age_mark, fixed};
use super::theme::{TextRole, Theme};
use crate::model::Model;
use crate::model::quantity::Quantity;

/// How far back a sparkline reaches.
const SPAN: Duration = Duration::from_mins(1);
/// Rows of one sparkline with its heading.
pub const ROWS: u16 = 4;
/// Steps of the height of a bar; a terminal shows eight a row.
const STEPS: f64 = 100.0;

/// Draws as many sparklines as fit, one below the other.
pub fn draw_all(names: &[&str], model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let known = names.iter().filter_map(|name| Quantity::named(name));
    for (quantity, y) in known.zip((area.y..area.bottom()).step_by(usize::from(ROWS))) {
        let at = Rect { y, height: ROWS, ..area };
        if at.bottom() <= area.bottom() {
            draw(quantity, model, theme, now, frame, at);
        }
    }
}

/// Draws one sparkline: a heading and the bars.
pub fn draw(quantity: &Quantity, model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [heading, bars] = area.layout(&Layout::vertical([Constraint::Length(1), Constraint::Fill(1)]));
    let columns = usize::from(bars.width.saturating_sub(2));
    let values = resampled(quantity, model, now, columns);
    let known = || values.iter().flatten().copied();
    let (least, most) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    let sample = quantity.read(model, now);
    let (mark, role) = sample.as_ref().map_or((" ", TextRole::Label), |sample| age_mark(sample, now));
    let value = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, quantity.decimals));
    let mut spans = vec![
        Span::styled(format!(" {}", quantity.name), theme.style(TextRole::Label)),
        Span::styled(format!("{mark}{value} {}", quantity.unit), theme.style(role)),
    ];
    if least <= most {
        let range =
            format!("  60 s: {}..{}", fixed(least, quantity.decimals), fixed(most, quantity.decimals));
        let used: usize = spans.iter().map(Span::width).sum();
        if used + range.len() <= usize::from(heading.width) {
            spans.push(Span::styled(range, theme.style(TextRole::Label)));
        }
    }
    draw_line(frame, heading, Line::from(spans));
    let span = (most - least).max(f64::MIN_POSITIVE);
    let heights =
        values.iter().map(|value| value.map(|value| (1.0 + (STEPS - 1.0) * (value - least) / span) as u64));
    let bars = Rect { x: bars.x + 1, width: bars.width.saturating_sub(2), ..bars };
    let widget = Sparkline::default()
        .data(heights.collect::<Vec<_>>())
        .absent_value_symbol(" ")
        .max(STEPS as u64)
        .style(theme.ground().fg(theme.ink(super::theme::Ink::Planned)));
    frame.render_widget(widget, bars);
}

/// The last value in each of so many equal parts of the last minute; `None` where none is known.
fn resampled(quantity: &Quantity, model: &Model, now: Duration, columns: usize) -> Vec<Option<f64>> {
    // Steps of a whole part, so that the bars do not tremble while time passes.
    let part = SPAN.as_secs_f64() / columns.max(1) as f64;
    let last = libm::floor(now.as_secs_f64() / part);
    let first = last - columns as f64 + 1.0;
    let mut values = vec![None; columns];
    let from = Duration::from_secs_f64((first * part).max(0.0));
    for (at, value) in model.history.trace.values(quantity, from, now) {
        let place = libm::floor(at.as_secs_f64() / part) - first;
        if let Some(slot) = (place >= 0.0).then(|| values.get_mut(place as usize)).flatten() {
            *slot = Some(value);
        }
    }
    values
}
