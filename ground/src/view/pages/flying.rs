//! The shared layout of ascent and descent: the headline, then the height gauge, the values, and the pictures.

use std::time::Duration;

use protocol::dialect::TD_DESCENT_DATA;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::Line;

use super::{is_roomy, titled};
use crate::model::Model;
use crate::model::vehicle::Sample;
use crate::view::number::row;
use crate::view::side_view::{self, FlightPart};
use crate::view::theme::Theme;
use crate::view::{
    draw_line, draw_lines, fins, foremost, gauge, headline, link_line, lost_position, sparkline, top_view,
};

/// Columns of the height gauge and of the values at 80 columns, and on a larger screen. At 80 columns they are those of
/// the landing page: what stands in the same place costs a slow line nothing at ignition.
const NARROW_COLUMNS: [u16; 2] = [33, 28];
const ROOMY_COLUMNS: [u16; 2] = [30, 40];
/// Columns of the picture of the fins.
const FIN_COLUMNS: u16 = 27;

/// Draws a page with these values; the picture of the fins is drawn if they steer.
pub fn draw(
    model: &Model,
    (title, values): (&str, Vec<Line<'static>>),
    fins_steer: bool,
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    let roomy = is_roomy(area);
    let area = headline::draw(&foremost::flight(model, now), theme, frame, area);
    let [gauge_columns, value_columns] = if roomy { ROOMY_COLUMNS } else { NARROW_COLUMNS };
    let [gauge_area, middle, right] = area.layout(&Layout::horizontal([
        Constraint::Length(gauge_columns),
        Constraint::Length(value_columns),
        Constraint::Fill(1),
    ]));
    let inside = titled("Height, m", theme, frame, gauge_area);
    draw_lines(frame, inside, &gauge::lines(model, theme, now, usize::from(inside.height)));
    let title = if lost_position::is_lost(model, now) { "PREDICTED, not heard" } else { title };
    draw_values(model, (title, values, roomy), theme, now, frame, middle);
    draw_pictures(model, fins_steer && roomy, theme, now, frame, right);
}

/// The values, the most important first; those that do not fit are on the page of all values.
fn draw_values(
    model: &Model,
    (title, mut values, roomy): (&str, Vec<Line<'static>>, bool),
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    let rows = u16::try_from(values.len() + 1).unwrap_or(u16::MAX).min(area.height);
    let [numbers, below] = area.layout(&Layout::vertical([Constraint::Length(rows), Constraint::Fill(1)]));
    let inside = titled(title, theme, frame, numbers);
    values.truncate(usize::from(inside.height));
    draw_lines(frame, inside, &values);
    if roomy {
        let [link, lines] = below.layout(&Layout::vertical([Constraint::Length(2), Constraint::Fill(1)]));
        draw_line(frame, link, link_line::link(model, theme, now, usize::from(link.width)));
        let names = ["vertical speed", "height", "tilt", "horizontal speed", "distance", "link rate"];
        sparkline::draw_all(&names, model, theme, now, frame, lines);
    }
}

fn draw_pictures(model: &Model, with_fins: bool, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [upper, sides] = area.layout(&Layout::vertical([
        if with_fins { Constraint::Length(fins::ROWS + 1) } else { Constraint::Length(0) },
        Constraint::Fill(1),
    ]));
    if with_fins {
        let [fin_area, above] =
            upper.layout(&Layout::horizontal([Constraint::Length(FIN_COLUMNS), Constraint::Fill(1)]));
        let inside = titled(&fins::title(model, now), theme, frame, fin_area);
        fins::draw(model, theme, now, frame, inside);
        let inside = titled("From above", theme, frame, above);
        top_view::draw(model, theme, now, frame, inside);
    }
    for (from, title, area) in side_view::pictures(model, sides) {
        let inside = titled(title, theme, frame, area);
        side_view::draw(model, (FlightPart::Whole, from), theme, now, frame, inside);
    }
}

/// A field of TD_DESCENT, while it is known.
pub fn of_descent(model: &Model, pick: fn(&TD_DESCENT_DATA) -> f32) -> Option<Sample<f64>> {
    let descent = model.vehicle.descent.as_ref()?;
    let sample = Sample::new(f64::from(pick(&descent.value)), descent.received_at);
    Some(sample).filter(|sample| sample.value.is_finite())
}

/// Adds height and vertical speed before the second value. After the loss of the link the prediction shows them.
pub fn insert_height(lines: &mut Vec<Line<'static>>, model: &Model, theme: Theme, now: Duration) {
    if lost_position::is_lost(model, now) {
        return;
    }
    lines.insert(1, row(theme, "height", model.vehicle.height_m(), 1, "m", now));
    lines.insert(2, row(theme, "vertical", model.vehicle.vertical_m_s(), 1, "m/s", now));
}
