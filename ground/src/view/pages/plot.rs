//! The page of numbers: every one with its present value, and the chosen one over time.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::Line;

use crate::model::quantity::{ALL, Quantity};
use crate::model::{Model, flight_began};
use crate::view::pictures::{scales, seconds_since};
use crate::view::widgets::{columns, framed};
use crate::view::{Ink, TextRole, Theme, draw_line, draw_lines, fixed, quantity_row};

/// Columns of the list of quantities.
const LIST_COLUMNS: u16 = 36;
/// Columns and rows from one tick to the next, at least.
const TICKS_APART: [u16; 2] = [9, 3];
/// Without a flight this much of the past is shown; in flight all of it, and this much before.
const CALM_SPAN: Duration = Duration::from_mins(2);
const BEFORE_FLIGHT: Duration = Duration::from_secs(5);

/// Draws the list of quantities, and the chosen one over time: its name and unit, its least and its
/// greatest value in the title.
pub fn draw_plot_page(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [list, area] = columns(area, [Length(LIST_COLUMNS), Fill(1)]);
    let inside = framed("Up Down choose", Line::default(), theme, frame, list);
    draw_lines(frame, inside, &values(model, theme, now, usize::from(inside.height)));
    let quantity = model.pages.plotted;
    let first = flight_began(model);
    let from = first.unwrap_or_else(|| now.saturating_sub(CALM_SPAN)).saturating_sub(BEFORE_FLIGHT);
    let zero = first.unwrap_or(now);
    let trace = model.history.trace.values(quantity, from, now);
    let points: Vec<(f64, f64)> = trace.map(|(at, value)| (seconds_since(at, zero), value)).collect();
    let bounds = |pick: fn(&(f64, f64)) -> f64| {
        let least = points.iter().map(pick).fold(f64::INFINITY, f64::min);
        [least, points.iter().map(pick).fold(f64::NEG_INFINITY, f64::max)]
    };
    let (across, [least, most]) = (bounds(|point| point.0), bounds(|point| point.1));
    let words = format!(" {} to {} ", fixed(least, quantity.decimals), fixed(most, quantity.decimals));
    let right = theme.line(words, TextRole::Label);
    let inside = framed(&format!("{} {}", quantity.name, quantity.unit), right, theme, frame, area);
    if points.len() < 2 {
        return draw_line(frame, inside, theme.line(" nothing to plot yet", TextRole::Label));
    }
    // A little room around the line, and for a value that does not change that of its last digit.
    let margin = ((most - least) / 20.0).max(libm::exp10(-(quantity.decimals as f64)));
    let up = [least - margin, most + margin];
    let unit = if first.is_some() { "T+ s" } else { "s" };
    let plane = scales((across, up), TICKS_APART, unit, theme, frame, inside);
    plane.draw(theme, frame, |context| plane.measured(context, &points, theme.ink(Ink::Measured)));
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
