//! Panels that several pages draw: the newest events, the height over time, the place from above,
//! the vehicle.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::Fill;
use ratatui::layout::{Layout, Rect, Spacing};
use ratatui::text::Line;

use super::pictures::attitude::{Side, draw_attitude};
use super::pictures::height::draw_height;
use super::pictures::map::draw_map;
use super::widgets::{framed, table};
use super::{Theme, bars, draw_lines, lists, panels};
use crate::model::{Model, dead_reckoning::is_silent};

/// The title of the place from above.
pub const FROM_ABOVE: &str = "from above";
/// From this width on a title has a legend beside it.
const LEGEND_COLUMNS: u16 = 34;

/// A panel with the newest events.
pub fn events(model: &Model, theme: Theme, frame: &mut Frame, area: Rect) {
    let inside = framed("events", Line::default(), theme, frame, area);
    let lines = lists::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lines);
}

/// A panel with the height over time.
pub fn height(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let legend = bars::legend([" ━", " flown "], ["┄", " predicted "], theme);
    let legend = if area.width < LEGEND_COLUMNS { Line::default() } else { legend };
    let inside = framed("height m", legend, theme, frame, area);
    draw_height(model, theme, now, frame, inside);
}

/// A panel with the place from above.
pub fn map(title: &str, model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let inside = framed(title, Line::default(), theme, frame, area);
    draw_map(model, theme, now, frame, inside);
}

/// The vehicle from each of these sides; after the loss of the link its predicted position instead.
pub fn vehicle(model: &Model, sides: &[Side], theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if is_silent(&model.vehicle, now) {
        return table("PREDICTED", &panels::lost_rows(model, theme, now), theme, frame, area);
    }
    let beside = Layout::horizontal(sides.iter().map(|_| Fill(1))).spacing(Spacing::Overlap(1));
    for (side, at) in sides.iter().zip(&*beside.split(area)) {
        draw_attitude(model, *side, theme, now, frame, *at);
    }
}
