//! The whole flight from the east or from the south, both axes at the same scale: flown, planned, the pad and the fence; after a
//! loss of the link the predicted position (a cross) with its error circle.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::canvas::{Circle, Line, Points};

use super::{DOTS_ACROSS, DOTS_UP, Ink, Plane, TextRole, Theme, shortest};
use crate::model::{Model, NorthEastUp, dead_reckoning::predict_position};
use crate::view::widgets;

/// The least altitude that the picture shows.
const ALTITUDE_MIN_M: f64 = 5.0;
/// The height of the mark of a touchdown limit, dots.
const LIMIT_DOTS: f64 = 5.0;
/// The pad's half width, m.
const PAD_HALF_M: f64 = 1.0;
/// Rows between two ticks of the height, at least.
const TICK_ROWS: u16 = 3;
/// Columns between two ticks over the ground, at least.
const TICK_COLUMNS: u16 = 9;

/// The touchdown limits are included if they enlarge the picture by no more than this factor.
const LIMITS_COST_MAX: f64 = 2.0;

/// The direction from which the flight is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Viewpoint {
    /// North is right. The plan is drawn only in this view.
    East,
    /// East is right.
    South,
}

impl Viewpoint {
    fn sees(self, [north_m, east_m, altitude_m]: NorthEastUp) -> (f64, f64) {
        match self {
            Self::East => (north_m, altitude_m),
            Self::South => (east_m, altitude_m),
        }
    }
}

/// Draws the picture; both axes have the same scale.
pub fn draw_side_view(
    model: &Model,
    from: Viewpoint,
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    if area.width < 8 || area.height < 3 {
        return;
    }
    let vehicle = &model.vehicle;
    let flown = vehicle.flown.points();
    let flown: Vec<(f64, f64)> = flown.iter().map(|point| from.sees(*point)).collect();
    let predicted = if from == Viewpoint::East { vehicle.planned() } else { &[] };
    let lost =
        predict_position(vehicle, now).map(|at| (from.sees([at.x_m, at.y_m, at.altitude_m]), at.error_m));
    let reckoned: Vec<(f64, f64)> = lost.iter().map(|(at, _)| *at).collect();
    let points: Vec<(f64, f64)> = [&flown, predicted, &reckoned].concat();
    let limit_m = vehicle.limits().map(|limits| f64::from(limits.fence_m));
    let limit_m = limit_m.filter(|limit_m| limit_m.is_finite() && *limit_m > 0.0);
    let view = Bounds::around(&points, limit_m, area);
    let Bounds { x: [left, right], y: [bottom, top], per_dot } = view;
    let label = |text: String| theme.line(text, TextRole::Label);
    let plane = Plane { area, x: [left, right], y: [bottom, top] };
    plane.draw(theme, frame, |context| {
        context.draw(&Line { x1: left, y1: 0.0, x2: right, y2: 0.0, color: theme.ink(Ink::Scale) });
        for side in [-PAD_HALF_M, PAD_HALF_M] {
            context.draw(&Line { x1: side, y1: 0.0, x2: side, y2: bottom, color: theme.ink(Ink::Body) });
        }
        for x in limit_m.into_iter().flat_map(|limit_m| [-limit_m, limit_m]) {
            let y2 = LIMIT_DOTS * per_dot;
            context.draw(&Line { x1: x, y1: 0.0, x2: x, y2, color: theme.ink(Ink::Limit) });
        }
        context.draw(&Points { coords: predicted, color: theme.ink(Ink::Predicted) });
        plane.measured(context, &flown, theme.ink(Ink::Measured));
        if let Some(((x, y), radius)) = lost {
            context.draw(&Circle { x, y, radius, color: theme.ink(Ink::Predicted) });
            context.print(x, y, "+");
        }
        let step = widgets::tick_step(top, usize::from(area.height / TICK_ROWS));
        for height in widgets::ticks(step, top - DOTS_UP * per_dot, step) {
            context.print(left, height, label(format!("{} m", shortest(height))));
        }
        let step = widgets::tick_step(right - left, usize::from(area.width / TICK_COLUMNS));
        let margin = DOTS_ACROSS * per_dot;
        for x in widgets::ticks(left + margin, right - 6.0 * margin, step) {
            context.print(x, bottom, label(format!("'{}", shortest(x))));
        }
        if let Some(limit_m) = limit_m.filter(|limit_m| *limit_m > right || -*limit_m < left) {
            let words = theme.either_side(&format!("limit ±{} m", shortest(limit_m)));
            context.print(right - words.chars().count() as f64 * margin, top, label(words));
        }
    });
}

/// The section that the picture shows, m.
struct Bounds {
    x: [f64; 2],
    y: [f64; 2],
    per_dot: f64,
}

impl Bounds {
    fn around(points: &[(f64, f64)], limit_m: Option<f64>, area: Rect) -> Self {
        let (mut left, mut right, mut top) = (-PAD_HALF_M, PAD_HALF_M, ALTITUDE_MIN_M);
        for (x, altitude) in points {
            left = left.min(*x);
            right = right.max(*x);
            top = top.max(*altitude);
        }
        let across = f64::from(area.width) * DOTS_ACROSS;
        let up = f64::from(area.height) * DOTS_UP;
        // A margin around, and a row of ticks below the ground.
        let per_dot = |left: f64, right: f64| ((right - left) * 1.1 / across).max(top * 1.05 / (up - 5.0));
        if let Some(limit_m) = limit_m {
            let (wider_left, wider_right) = (left.min(-limit_m), right.max(limit_m));
            if per_dot(wider_left, wider_right) <= LIMITS_COST_MAX * per_dot(left, right) {
                (left, right) = (wider_left, wider_right);
            }
        }
        let per_dot = per_dot(left, right);
        let middle = f64::midpoint(left, right);
        let half = per_dot * across / 2.0;
        Self { x: [middle - half, middle + half], y: [-4.0 * per_dot, per_dot * (up - 4.0)], per_dot }
    }
}
