//! The path page: the flight from the east, from the south and from above.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span};

use super::titled;
use crate::model::Model;
use crate::model::motion::Motion;
use crate::view::number::{fixed, row};
use crate::view::side_view::{self, FlightPart, Viewpoint};
use crate::view::theme::{TextRole, Theme};
use crate::view::{draw_line, lost_position, top_view};

/// From this width on the pictures stand side by side without a row of their own for the view from above.
const ROWS_FOR_TWO: u16 = 30;

/// Draws the three views: side by side, or on a high screen the view from above below the two others.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let [pictures, legend] = area.layout(&Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]));
    let thirds = || Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1), Constraint::Fill(1)]);
    let [east, south, above] = if area.height < ROWS_FOR_TWO {
        pictures.layout(&thirds())
    } else {
        let [left, above] = pictures.layout(&Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]));
        let [east, south] = left.layout(&Layout::vertical([Constraint::Fill(1), Constraint::Fill(1)]));
        [east, south, above]
    };
    for (from, title, at) in [
        (Viewpoint::East, "From east, north right", east),
        (Viewpoint::South, "From south, east right", south),
    ] {
        let inside = titled(title, theme, frame, at);
        side_view::draw(model, (FlightPart::Whole, from), theme, now, frame, inside);
    }
    let inside = titled("From above, north up", theme, frame, above);
    top_view::draw(model, theme, now, frame, inside);
    draw_line(frame, legend, comes_down(model, theme, now));
}

/// The position in numbers, for small screens.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let motion = model.vehicle.best_motion();
    let of = |pick: fn(&Motion) -> f64| motion.map(|motion| motion.map(pick));
    let mut lines = lost_position::rows(model, theme, now);
    if lines.is_empty() {
        lines = vec![
            row(theme, "height", model.vehicle.height_m(), 1, "m", now),
            row(theme, "north", of(|motion| motion.x_m), 1, "m", now),
            row(theme, "east", of(|motion| motion.y_m), 1, "m", now),
            row(theme, "distance", of(Motion::distance_m), 1, "m", now),
        ];
    }
    lines.push(comes_down(model, theme, now));
    lines
}

/// Where it will come down.
fn comes_down(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let words = match top_view::comes_down(model, now) {
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
    Line::from(vec![
        Span::styled(words, theme.style(TextRole::Plain)),
        Span::styled("; line flown, dots planned", theme.style(TextRole::Label)),
    ])
}
