//! The page of numbers: every one with its present value, and the chosen one over time.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Chart, Dataset, GraphType};

use super::titled;
use crate::model::{
    Model,
    quantity::{ALL, Quantity},
};
use crate::view::footer::flight_began;
use crate::view::{Ink, TextRole, Theme, draw_line, draw_lines, fixed, quantity_row, side_by_side, widgets};

/// Columns of the list of quantities.
const LIST_COLUMNS: u16 = 35;
/// Without a flight this much of the past is shown; in flight all of it, and this much before.
const CALM_SPAN: Duration = Duration::from_mins(2);
const BEFORE_FLIGHT: Duration = Duration::from_secs(5);

/// Draws the list of quantities and the plot of the chosen one.
pub fn draw_plot_page(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [list, right] = side_by_side(area, [Length(LIST_COLUMNS), Fill(1)]);
    let quantity = model.pages.plotted;
    let inside = titled("Up Down choose", theme, frame, list);
    draw_lines(frame, inside, &values(model, theme, now, usize::from(inside.height)));
    let inside = titled(&format!("{} over time", quantity.name), theme, frame, right);
    draw_plot(quantity, model, theme, now, frame, inside);
}

/// The quantities around the chosen one, which is marked, each with its present value.
fn values(model: &Model, theme: Theme, now: Duration, rows: usize) -> Vec<Line<'static>> {
    let chosen = model.pages.plotted;
    let start = (chosen.place() + 1).saturating_sub(rows / 2 + 1).min(ALL.len().saturating_sub(rows));
    let line = |quantity: &'static Quantity| {
        let mut line = quantity_row(quantity, model, theme, now);
        if quantity == chosen {
            line.spans[0] = theme.key(format!(">{}", &line.spans[0].content[1..]));
        }
        line
    };
    ALL.iter().skip(start).take(rows).map(line).collect()
}

fn draw_plot(quantity: &Quantity, model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let first = flight_began(model);
    let from = first.unwrap_or_else(|| now.saturating_sub(CALM_SPAN)).saturating_sub(BEFORE_FLIGHT);
    let zero_s = first.unwrap_or(now).as_secs_f64();
    let points: Vec<(f64, f64)> = model
        .history
        .trace
        .values(quantity, from, now)
        .map(|(at, value)| (at.as_secs_f64() - zero_s, value))
        .collect();
    if points.len() < 2 {
        return draw_line(frame, area, theme.line(" nothing to plot yet", TextRole::Label));
    }
    let of = |pick: fn(&(f64, f64)) -> f64| {
        let least = points.iter().map(pick).fold(f64::INFINITY, f64::min);
        let most = points.iter().map(pick).fold(f64::NEG_INFINITY, f64::max);
        (least, most)
    };
    let label = theme.style(TextRole::Label);
    let axis = |(least, most): (f64, f64), parts: usize| {
        let span = (most - least).max(1e-6);
        let step = widgets::tick_step(span, parts);
        let (low, high) = (libm::floor(least / step) * step, (libm::floor(most / step) + 1.0) * step);
        let labels: Vec<String> = widgets::ticks(low - step / 2.0, high + step / 2.0, step)
            .map(|tick| fixed(tick, widgets::tick_decimals(step)))
            .collect();
        Axis::default().style(label).bounds([low, high]).labels(labels)
    };
    let dataset = Dataset::default()
        .marker(Marker::Braille)
        .graph_type(GraphType::Line)
        .style(theme.ground().fg(theme.ink(Ink::Measured)))
        .data(&points);
    let chart = Chart::new(vec![dataset])
        .style(theme.ground())
        .x_axis(axis(of(|point| point.0), usize::from(area.width / 16)).title("s"))
        .y_axis(axis(of(|point| point.1), usize::from(area.height / 3)).title(quantity.unit));
    frame.render_widget(chart, area);
}
