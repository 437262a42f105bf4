//! The flight from above, north up: pad, fence, flown path, where it will come down, and the wind.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::canvas::{Canvas, Circle, Line};

use super::number::{fixed, shortest};
use super::side_view::{DOTS_ACROSS, DOTS_UP, PAD_HALF_M, TICK_COLUMNS};
use super::theme::{Ink, TextRole, Theme};
use super::ticks;
use crate::model::Model;
use crate::model::dead_reckoning::predict_position;
use crate::model::quantity::Quantity;

/// The least distance from the pad that the picture shows.
const REACH_MIN_M: f64 = 10.0;
/// The fence is included if it enlarges the picture by no more than this factor.
const FENCE_COST_MAX: f64 = 3.0;
/// How far back predictions of the touchdown count for its uncertainty.
const SCATTER_OVER: Duration = Duration::from_secs(5);

/// Where the vehicle will come down: east and north of the pad and the radius of the uncertainty, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComesDown {
    pub east_m: f64,
    pub north_m: f64,
    /// How far the prediction has moved within five seconds.
    pub radius_m: f64,
}

/// The predicted touchdown in flight; `None` while it is unknown or stale.
pub fn comes_down(model: &Model, now: Duration) -> Option<ComesDown> {
    if !model.vehicle.in_flight() {
        return None;
    }
    let fresh = |name| {
        let quantity = Quantity::named(name)?;
        let sample = quantity.read(model, now).filter(|sample| !sample.is_stale(now))?;
        Some((quantity, sample.value))
    };
    let ((north, north_m), (east, east_m)) = (fresh("touchdown north")?, fresh("touchdown east")?);
    let from = now.saturating_sub(SCATTER_OVER);
    let trace = &model.history.trace;
    let past = trace.values(north, from, now).zip(trace.values(east, from, now));
    let radius_m = past
        .map(|((_, past_north), (_, past_east))| libm::hypot(past_north - north_m, past_east - east_m))
        .fold(0.0, f64::max);
    Some(ComesDown { east_m, north_m, radius_m })
}

/// Draws the picture; both axes have the same scale.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if area.width < 8 || area.height < 4 {
        return;
    }
    let vehicle = &model.vehicle;
    let flown: Vec<(f64, f64)> =
        vehicle.flown.points().iter().map(|[north, east, _]| (*east, *north)).collect();
    let down = comes_down(model, now);
    let lost = predict_position(vehicle, now);
    let fence_m =
        vehicle.limits.as_ref().map(|limits| f64::from(limits.x_m)).filter(|m| m.is_finite() && *m > 0.0);
    let furthest = flown.iter().map(|(east, north)| east.abs().max(north.abs()));
    let furthest = furthest
        .chain(down.map(|at| at.east_m.abs().max(at.north_m.abs()) + at.radius_m))
        .chain(lost.map(|at| at.x_m.abs().max(at.y_m.abs())))
        .fold(REACH_MIN_M, f64::max);
    let reach_m = match fence_m {
        Some(fence_m) if fence_m > furthest && fence_m < FENCE_COST_MAX * furthest => fence_m,
        _ => furthest,
    };
    let (across, up) = (f64::from(area.width) * DOTS_ACROSS, f64::from(area.height) * DOTS_UP);
    let per_dot = 1.1 * 2.0 * reach_m / across.min(up - DOTS_UP);
    let (half_x, half_y) = (per_dot * across / 2.0, per_dot * up / 2.0);
    let label = |text: String| TextLine::styled(text, theme.style(TextRole::Label));
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .background_color(theme.back())
        .x_bounds([-half_x, half_x])
        .y_bounds([-half_y, half_y])
        .paint(|context| {
            if let Some(radius) = fence_m {
                context.draw(&Circle { x: 0.0, y: 0.0, radius, color: theme.ink(Ink::Limit) });
            }
            let pad = PAD_HALF_M.max(2.0 * per_dot);
            for (x1, y1, x2, y2) in [(-pad, 0.0, pad, 0.0), (0.0, -pad, 0.0, pad)] {
                context.draw(&Line { x1, y1, x2, y2, color: theme.ink(Ink::Body) });
            }
            for pair in flown.windows(2) {
                let ((x1, y1), (x2, y2)) = (pair[0], pair[1]);
                context.draw(&Line { x1, y1, x2, y2, color: theme.ink(Ink::Flown) });
            }
            if let Some(at) = down {
                let radius = at.radius_m.max(2.0 * per_dot);
                context.draw(&Circle { x: at.east_m, y: at.north_m, radius, color: theme.ink(Ink::Planned) });
                context.print(at.east_m, at.north_m, "x");
            }
            if let Some(at) = lost {
                let radius = at.error_m;
                context.draw(&Circle { x: at.y_m, y: at.x_m, radius, color: theme.ink(Ink::Predicted) });
                context.print(at.y_m, at.x_m, "+");
            } else if let Some((east, north)) = flown.last() {
                context.print(*east, *north, "o");
            }
            let step = ticks::step(2.0 * half_x, usize::from(area.width / TICK_COLUMNS));
            let margin = DOTS_ACROSS * per_dot;
            for x in ticks::multiples(margin - half_x, half_x - 6.0 * margin, step) {
                context.print(x, -half_y, label(format!("'{}", shortest(x))));
            }
            context.print(-half_x, half_y, label(wind(model)));
            if let Some(fence_m) = fence_m.filter(|fence_m| *fence_m > half_x.min(half_y)) {
                let words = format!("fence {} m", shortest(fence_m));
                context.print(half_x - words.len() as f64 * margin, half_y, label(words));
            }
        });
    frame.render_widget(canvas, area);
}

/// Where the wind blows to, as an arrow, and its speed.
fn wind(model: &Model) -> String {
    let known = model
        .vehicle
        .descent
        .as_ref()
        .map(|d| (f64::from(d.value.wind_x_m_s), f64::from(d.value.wind_y_m_s)));
    let Some((north, east)) = known.filter(|(north, east)| libm::hypot(*north, *east) > 0.0) else {
        return String::new();
    };
    let eighth = libm::round(libm::atan2(east, north).to_degrees() / 45.0).rem_euclid(8.0) as usize;
    let arrow = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"][eighth];
    format!("wind {} to {arrow}", fixed(libm::hypot(north, east), 1))
}
