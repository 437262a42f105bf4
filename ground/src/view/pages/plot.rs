//! The plot page: one quantity over time, with round ticks.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Chart, Dataset, GraphType};

use super::titled;
use crate::model::Model;
use crate::model::act::Act;
use crate::model::quantity::{ALL, Quantity};
use crate::model::vehicle::is_on_pad;
use crate::view::number::{age_mark, fixed, row};
use crate::view::theme::{Ink, TextRole, Theme};
use crate::view::{draw_line, draw_lines, ticks};

/// Columns of the list of quantities.
const LIST_COLUMNS: u16 = 24;
/// Without a flight this much of the past is shown; in flight all of it, and this much before.
const CALM_SPAN: Duration = Duration::from_mins(2);
const BEFORE_FLIGHT: Duration = Duration::from_secs(5);

/// Draws the list of quantities and the plot of the chosen one.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [list, right] =
        area.layout(&Layout::horizontal([Constraint::Length(LIST_COLUMNS), Constraint::Fill(1)]));
    let quantity = model.pages.plotted;
    let inside = titled("Up Down choose", theme, frame, list);
    draw_lines(frame, inside, &names(model, theme, usize::from(inside.height)));
    let inside = titled(&format!("{} over time", quantity.name), theme, frame, right);
    let [head, plot] = inside.layout(&Layout::vertical([Constraint::Length(1), Constraint::Fill(1)]));
    draw_line(frame, head, present(quantity, model, theme, now));
    draw_plot(quantity, model, theme, now, frame, plot);
}

/// The present value of every quantity, the chosen one first.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let chosen = model.pages.plotted;
    std::iter::once(chosen)
        .chain(ALL.iter().filter(|quantity| *quantity != chosen))
        .map(|quantity| {
            row(theme, quantity.name, quantity.read(model, now), quantity.decimals, quantity.unit, now)
        })
        .collect()
}

/// The names around the chosen one, which is marked; pinned ones have a star.
fn names(model: &Model, theme: Theme, rows: usize) -> Vec<Line<'static>> {
    let chosen = model.pages.plotted;
    let start = (chosen.place() + 1).saturating_sub(rows / 2 + 1).min(ALL.len().saturating_sub(rows));
    let line = |quantity: &'static Quantity| {
        let is_chosen = quantity == chosen;
        let (mark, role) = if is_chosen { (">", TextRole::Key) } else { (" ", TextRole::Label) };
        let pin = if model.pages.pinned.contains(&quantity) { "*" } else { " " };
        Line::styled(format!("{mark}{pin}{}", quantity.name), theme.style(role))
    };
    ALL.iter().skip(start).take(rows).map(line).collect()
}

fn present(quantity: &Quantity, model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let sample = quantity.read(model, now);
    let (mark, role) = sample.as_ref().map_or((" ", TextRole::Label), |sample| age_mark(sample, now));
    let value = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, quantity.decimals));
    Line::from(vec![
        Span::styled(
            format!("{mark}{value} {}", quantity.unit),
            theme.style(role).patch(theme.style(TextRole::Title)),
        ),
        Span::styled(
            format!("   {} pins it to every page", model.settings.keys.name(Act::Pin)),
            theme.style(TextRole::Label),
        ),
    ])
}

fn draw_plot(quantity: &Quantity, model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let first = model.history.timeline.iter().find(|(phase, _)| !is_on_pad(*phase)).map(|(_, at)| *at);
    let from = first.unwrap_or_else(|| now.saturating_sub(CALM_SPAN)).saturating_sub(BEFORE_FLIGHT);
    let zero_s = first.unwrap_or(now).as_secs_f64();
    let points: Vec<(f64, f64)> = model
        .history
        .trace
        .values(quantity, from, now)
        .map(|(at, value)| (at.as_secs_f64() - zero_s, value))
        .collect();
    if points.len() < 2 {
        return draw_line(frame, area, Line::styled(" nothing to plot yet", theme.style(TextRole::Label)));
    }
    let of = |pick: fn(&(f64, f64)) -> f64| {
        let least = points.iter().map(pick).fold(f64::INFINITY, f64::min);
        let most = points.iter().map(pick).fold(f64::NEG_INFINITY, f64::max);
        (least, most)
    };
    let label = theme.style(TextRole::Label);
    let axis = |(least, most): (f64, f64), parts: usize| {
        let span = (most - least).max(1e-6);
        let step = ticks::step(span, parts);
        let (low, high) =
            (libm::floor(least / step) * step, (libm::ceil(most / step) * step).max(low_end(least, step)));
        let labels: Vec<String> = ticks::multiples(low - step / 2.0, high + step / 2.0, step)
            .map(|tick| fixed(tick, ticks::decimals(step)))
            .collect();
        Axis::default().style(label).bounds([low, high]).labels(labels)
    };
    let dataset = Dataset::default()
        .marker(Marker::Braille)
        .graph_type(GraphType::Line)
        .style(theme.ground().fg(theme.ink(Ink::Flown)))
        .data(&points);
    let chart = Chart::new(vec![dataset])
        .style(theme.ground())
        .x_axis(axis(of(|point| point.0), usize::from(area.width / 16)).title("s"))
        .y_axis(axis(of(|point| point.1), usize::from(area.height / 3)).title(quantity.unit));
    frame.render_widget(chart, area);
}

/// The least upper end of a scale that begins at or below a value.
fn low_end(least: f64, step: f64) -> f64 {
    (libm::floor(least / step) + 1.0) * step
}
