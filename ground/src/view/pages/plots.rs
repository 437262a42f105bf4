//! The pages of numbers and paths: one quantity over time, the flight from three sides, every value.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Chart, Dataset, GraphType};

use super::{panel, titled};
use crate::model::{
    Model, is_on_pad,
    quantity::{ALL, Quantity},
};
use crate::view::pictures::map::{self, draw_map};
use crate::view::pictures::side::{Viewpoint, draw_side_view};
use crate::view::{
    Ink, TextRole, Theme, age_mark, draw_line, draw_lines, fixed, panels, row, side_by_side, stacked, widgets,
};

/// Columns of the list of quantities.
const LIST_COLUMNS: u16 = 24;
/// Without a flight this much of the past is shown; in flight all of it, and this much before.
const CALM_SPAN: Duration = Duration::from_mins(2);
const BEFORE_FLIGHT: Duration = Duration::from_secs(5);

/// Draws the list of quantities and the plot of the chosen one.
pub fn draw_plot_page(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [list, right] = side_by_side(area, [Length(LIST_COLUMNS), Fill(1)]);
    let quantity = model.pages.plotted;
    let inside = titled("Up Down choose", theme, frame, list);
    draw_lines(frame, inside, &names(model, theme, usize::from(inside.height)));
    let inside = titled(&format!("{} over time", quantity.name), theme, frame, right);
    let [head, plot] = stacked(inside, [Length(1), Fill(1)]);
    draw_line(frame, head, present(quantity, model, theme, now));
    draw_plot(quantity, model, theme, now, frame, plot);
}

/// The names around the chosen one, which is marked.
fn names(model: &Model, theme: Theme, rows: usize) -> Vec<Line<'static>> {
    let chosen = model.pages.plotted;
    let start = (chosen.place() + 1).saturating_sub(rows / 2 + 1).min(ALL.len().saturating_sub(rows));
    let line = |quantity: &'static Quantity| {
        let is_chosen = quantity == chosen;
        let (mark, role) = if is_chosen { (">", TextRole::Key) } else { (" ", TextRole::Label) };
        theme.line(format!("{mark} {}", quantity.name), role)
    };
    ALL.iter().skip(start).take(rows).map(line).collect()
}

fn present(quantity: &Quantity, model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let sample = quantity.read(model, now);
    let (mark, role) = sample.as_ref().map_or((" ", TextRole::Label), |sample| age_mark(sample, now));
    let value = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, quantity.decimals));
    let style = theme.style(role).patch(theme.style(TextRole::Title));
    Line::styled(format!("{mark}{value} {}", quantity.unit), style)
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
        let (low, high) =
            (libm::floor(least / step) * step, (libm::ceil(most / step) * step).max(low_end(least, step)));
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

/// The least upper end of a scale that begins at or below a value.
fn low_end(least: f64, step: f64) -> f64 {
    (libm::floor(least / step) + 1.0) * step
}

// The path page: the flight from the east, from the south and from above.

/// From this width on the pictures stand side by side without a row of their own for the view from above.
const ROWS_FOR_TWO: u16 = 30;

/// Draws the three views: side by side, or on a high screen the view from above below the two others.
pub fn draw_path(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [pictures, legend] = stacked(area, [Fill(1), Length(1)]);
    let [east, south, above] = if area.height < ROWS_FOR_TWO {
        side_by_side(pictures, [Fill(1); 3])
    } else {
        let [left, above] = side_by_side(pictures, [Fill(1), Fill(1)]);
        let [east, south] = stacked(left, [Fill(1), Fill(1)]);
        [east, south, above]
    };
    for (from, title, at) in [
        (Viewpoint::East, "From east, north right", east),
        (Viewpoint::South, "From south, east right", south),
    ] {
        let inside = titled(title, theme, frame, at);
        draw_side_view(model, from, theme, now, frame, inside);
    }
    let inside = titled("From above, north up", theme, frame, above);
    draw_map(model, theme, now, frame, inside);
    draw_line(frame, legend, comes_down(model, theme, now));
}

/// Where it will come down.
fn comes_down(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let words = match map::comes_down(model, now) {
        Some(at) => {
            let words = format!(
                " x comes down {} m N, {} m E, moved ±{} m in 5 s*",
                fixed(at.north_m, 1),
                fixed(at.east_m, 1),
                fixed(at.radius_m, 1)
            );
            theme.either_side(&words)
        }
        None => " x where it will come down: not known".to_owned(),
    };
    Line::from(vec![theme.plain(words), theme.label("; line flown, dots planned")])
}

// The page of all values: flight, descent, controller with its residuals, actuators, link.

/// Draws three columns of panels.
pub fn draw_values(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [left, middle, right] = side_by_side(area, [Fill(1); 3]);
    let controller = panels::controller_rows(model, theme, now);
    let half = Length(1 + controller.len() as u16);
    let [flight_area, below_flight] = stacked(left, [half, Fill(1)]);
    let [controller_area, below_controller] = stacked(middle, [half, Fill(1)]);
    let (title, rows) = panels::flight_panel(model, theme, now);
    panel(title, &rows, theme, frame, flight_area);
    panel("Fins command|actual", &panels::fin_rows(model, theme, now), theme, frame, below_flight);
    panel("Controller (NMPC)", &controller, theme, frame, controller_area);
    panel("Gimbal", &panels::gimbal_rows(model, theme, now), theme, frame, below_controller);
    panel("Descent", &descent_rows(model, theme, now), theme, frame, right);
}

/// The estimates behind the descent.
fn descent_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let of = |pick| model.vehicle.of_descent(pick);
    let line = |label, value, decimals, unit| row(theme, label, value, decimals, unit, now);
    let mut rows = vec![
        line("band high", of(|d| d.band_high_m), 1, "m"),
        line("band low", of(|d| d.band_low_m), 1, "m"),
        line("ignite at", of(|d| d.chosen_height_m), 1, "m"),
        line("ignite in", model.vehicle.ignition_in_s(now), 1, "s"),
        line("commit at", of(|d| d.commit_height_m), 1, "m"),
        line("apogee at", of(|d| d.apogee_m), 0, "m"),
        line("wind north", of(|d| d.wind_x_m_s), 1, "m/s"),
        line("wind east", of(|d| d.wind_y_m_s), 1, "m/s"),
        line("drag", of(|d| d.drag_scale), 3, "x"),
        line("thrust", of(|d| d.thrust_scale), 3, "x"),
        line("lands N", of(|d| d.touchdown_x_m), 1, "m"),
        line("lands E", of(|d| d.touchdown_y_m), 1, "m"),
    ];
    if model.vehicle.descent().is_none() {
        rows.insert(0, theme.line(" no data", TextRole::Caution));
    }
    rows
}
