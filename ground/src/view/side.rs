//! The side view: where it flew (line), where it will fly (dots), the pad; after the loss of the link where it
//! probably is (a cross) and how far from there it may be (a circle).

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::widgets::canvas::{Canvas, Circle, Line, Points};

use super::theme::Theme;
use crate::model::Model;
use crate::model::reckoning::reckon;

/// Braille dots in a cell.
const DOTS_ACROSS: f64 = 2.0;
const DOTS_UP: f64 = 4.0;
/// The picture shows at least this altitude.
const ALTITUDE_MIN_M: f64 = 5.0;
/// The pad's half width, m.
const PAD_HALF_M: f64 = 1.0;

/// Draws the picture; both axes have the same scale.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if area.width < 8 || area.height < 3 {
        return;
    }
    let flown = &model.vehicle.flown;
    let predicted: &[(f64, f64)] = match &model.vehicle.path {
        // After touchdown the last plan is history.
        Some(path) if model.vehicle.verdict.is_none() => &path.value,
        _ => &[],
    };
    let lost = reckon(&model.vehicle, now);
    let reckoned: Vec<(f64, f64)> = lost.iter().map(|at| (at.x_m, at.altitude_m)).collect();
    let points = flown.iter().chain(predicted).chain(&reckoned);
    let ([left, right], [bottom, top]) = bounds(points, area);
    let colour = |colour| if theme.colour { colour } else { Color::Reset };
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([left, right])
        .y_bounds([bottom, top])
        .paint(|context| {
            context.draw(&Line { x1: left, y1: 0.0, x2: right, y2: 0.0, color: colour(Color::DarkGray) });
            for side in [-PAD_HALF_M, PAD_HALF_M] {
                context.draw(&Line { x1: side, y1: 0.0, x2: side, y2: bottom, color: colour(Color::Reset) });
            }
            context.draw(&Points { coords: predicted, color: colour(Color::Cyan) });
            for pair in flown.windows(2) {
                let ((x1, y1), (x2, y2)) = (pair[0], pair[1]);
                context.draw(&Line { x1, y1, x2, y2, color: colour(Color::Yellow) });
            }
            if let Some(at) = lost {
                let (x, y, radius) = (at.x_m, at.altitude_m, at.error_m);
                context.draw(&Circle { x, y, radius, color: colour(Color::Magenta) });
                context.print(x, y, "+");
            }
            let scale = (right - left) / 4.0;
            context.print(left, top, format!("{:.0} m up", top.floor()));
            context.print(right - scale, bottom, format!("{:.0} m", right.floor()));
        });
    frame.render_widget(canvas, area);
}

fn bounds<'a>(points: impl Iterator<Item = &'a (f64, f64)>, area: Rect) -> ([f64; 2], [f64; 2]) {
    let (mut left, mut right, mut top) = (-PAD_HALF_M, PAD_HALF_M, ALTITUDE_MIN_M);
    for (x, altitude) in points {
        left = left.min(*x);
        right = right.max(*x);
        top = top.max(*altitude);
    }
    let across = f64::from(area.width) * DOTS_ACROSS;
    let up = f64::from(area.height) * DOTS_UP;
    // A little room around, and two rows of dots below the ground.
    let per_dot = ((right - left) * 1.1 / across).max(top * 1.05 / (up - 3.0));
    let middle = f64::midpoint(left, right);
    let half = per_dot * across / 2.0;
    ([middle - half, middle + half], [-2.0 * per_dot, per_dot * (up - 2.0)])
}
