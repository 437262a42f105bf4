//! The pictures: the flight from the side and from above, and the fins.
//!
//! The side view has the flown path (line), the planned path (dots), the pad and the touchdown limits; after a loss of
//! the link the predicted position (a cross) with its error circle.

use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Constraint::Fill;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use super::{Ink, STALE_MARK, TextRole, Theme, age_mark, draw_lines, fixed, shortest, side_by_side, widgets};
use crate::model::{
    Attitude, Deflection, Model, Motion, NorthEastUp, dead_reckoning::predict_position, quantity::Quantity,
};

/// Braille dots per cell.
pub(super) const DOTS_ACROSS: f64 = 2.0;
pub(super) const DOTS_UP: f64 = 4.0;
/// The least altitude that the picture shows.
const ALTITUDE_MIN_M: f64 = 5.0;
/// The height of the mark of a touchdown limit, dots.
const LIMIT_DOTS: f64 = 5.0;
/// The columns that one picture needs.
const PICTURE_COLUMNS: u16 = 22;
/// The pad's half width, m.
pub(super) const PAD_HALF_M: f64 = 1.0;
/// Rows between two ticks of the height, at least.
const TICK_ROWS: u16 = 3;
/// Columns between two ticks over the ground, at least.
pub(super) const TICK_COLUMNS: u16 = 9;

/// The touchdown limits are included if they enlarge the picture by no more than this factor.
const LIMITS_COST_MAX: f64 = 2.0;

/// Which part of the flight is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlightPart {
    Whole,
    /// The landing burn, once it has begun.
    Burn,
}

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

/// The pictures that fit into an area, with their titles: for a vehicle in space from the east and from the south, or
/// from the east alone.
pub fn side_views(area: Rect) -> Vec<(Viewpoint, &'static str, Rect)> {
    if area.width < 2 * PICTURE_COLUMNS {
        return vec![(Viewpoint::East, "From east", area)];
    }
    let [east, south] = side_by_side(area, [Fill(1), Fill(1)]);
    vec![(Viewpoint::East, "From east", east), (Viewpoint::South, "From south", south)]
}

/// Draws the picture; both axes have the same scale.
pub fn draw_side_view(
    model: &Model,
    (part, from): (FlightPart, Viewpoint),
    theme: Theme,
    now: Duration,
    frame: &mut Frame,
    area: Rect,
) {
    if area.width < 8 || area.height < 3 {
        return;
    }
    let vehicle = &model.vehicle;
    let flown = match part {
        FlightPart::Burn if !vehicle.burn.points().is_empty() => vehicle.burn.points(),
        _ => vehicle.flown.points(),
    };
    let flown: Vec<(f64, f64)> = flown.iter().map(|point| from.sees(*point)).collect();
    let predicted = if from == Viewpoint::East { vehicle.planned() } else { &[] };
    let lost =
        predict_position(vehicle, now).map(|at| (from.sees([at.x_m, at.y_m, at.altitude_m]), at.error_m));
    let reckoned: Vec<(f64, f64)> = lost.iter().map(|(at, _)| *at).collect();
    let points: Vec<(f64, f64)> = [&flown, predicted, &reckoned].concat();
    let limit_m = vehicle.limits().map(|limits| f64::from(limits.x_m));
    let limit_m = limit_m.filter(|limit_m| limit_m.is_finite() && *limit_m > 0.0);
    let view = Bounds::around(&points, limit_m, area);
    let Bounds { x: [left, right], y: [bottom, top], per_dot } = view;
    let label = |text: String| theme.line(text, TextRole::Label);
    let canvas = canvas(theme, [left, right], [bottom, top], |context| {
        context.draw(&Line { x1: left, y1: 0.0, x2: right, y2: 0.0, color: theme.ink(Ink::Scale) });
        for side in [-PAD_HALF_M, PAD_HALF_M] {
            context.draw(&Line { x1: side, y1: 0.0, x2: side, y2: bottom, color: theme.ink(Ink::Body) });
        }
        for x in limit_m.into_iter().flat_map(|limit_m| [-limit_m, limit_m]) {
            let y2 = LIMIT_DOTS * per_dot;
            context.draw(&Line { x1: x, y1: 0.0, x2: x, y2, color: theme.ink(Ink::Limit) });
        }
        context.draw(&Points { coords: predicted, color: theme.ink(Ink::Predicted) });
        draw_flown(context, &flown, theme.ink(Ink::Measured));
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
    frame.render_widget(canvas, area);
}

/// A picture in braille dots.
fn canvas<F: Fn(&mut Context)>(theme: Theme, x: [f64; 2], y: [f64; 2], paint: F) -> Canvas<'static, F> {
    let canvas = Canvas::default().marker(Marker::Braille).background_color(theme.back());
    canvas.x_bounds(x).y_bounds(y).paint(paint)
}

fn draw_flown(context: &mut Context, flown: &[(f64, f64)], color: Color) {
    for pair in flown.windows(2) {
        let ((x1, y1), (x2, y2)) = (pair[0], pair[1]);
        context.draw(&Line { x1, y1, x2, y2, color });
    }
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

// The flight from above, north up: pad, fence, flown path, where it will come down, and the wind.

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
pub fn draw_top_view(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if area.width < 8 || area.height < 4 {
        return;
    }
    let vehicle = &model.vehicle;
    let flown: Vec<(f64, f64)> =
        vehicle.flown.points().iter().map(|[north, east, _]| (*east, *north)).collect();
    let down = comes_down(model, now);
    let lost = predict_position(vehicle, now);
    let fence_m = vehicle.limits().map(|limits| f64::from(limits.x_m)).filter(|m| m.is_finite() && *m > 0.0);
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
    let label = |text: String| theme.line(text, TextRole::Label);
    let canvas = canvas(theme, [-half_x, half_x], [-half_y, half_y], |context| {
        if let Some(radius) = fence_m {
            context.draw(&Circle { x: 0.0, y: 0.0, radius, color: theme.ink(Ink::Limit) });
        }
        let pad = PAD_HALF_M.max(2.0 * per_dot);
        for (x1, y1, x2, y2) in [(-pad, 0.0, pad, 0.0), (0.0, -pad, 0.0, pad)] {
            context.draw(&Line { x1, y1, x2, y2, color: theme.ink(Ink::Body) });
        }
        draw_flown(context, &flown, theme.ink(Ink::Measured));
        if let Some(at) = down {
            let radius = at.radius_m.max(2.0 * per_dot);
            context.draw(&Circle { x: at.east_m, y: at.north_m, radius, color: theme.ink(Ink::Predicted) });
            context.print(at.east_m, at.north_m, "x");
        }
        if let Some(at) = lost {
            let radius = at.error_m;
            context.draw(&Circle { x: at.y_m, y: at.x_m, radius, color: theme.ink(Ink::Predicted) });
            context.print(at.y_m, at.x_m, "+");
        } else if let Some((east, north)) = flown.last() {
            context.print(*east, *north, "o");
        }
        let step = widgets::tick_step(2.0 * half_x, usize::from(area.width / TICK_COLUMNS));
        let margin = DOTS_ACROSS * per_dot;
        for x in widgets::ticks(margin - half_x, half_x - 6.0 * margin, step) {
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
    let known =
        model.vehicle.descent().map(|d| (f64::from(d.value.wind_x_m_s), f64::from(d.value.wind_y_m_s)));
    let Some((north, east)) = known.filter(|(north, east)| libm::hypot(*north, *east) > 0.0) else {
        return String::new();
    };
    let eighth = libm::round(libm::atan2(east, north).to_degrees() / 45.0).rem_euclid(8.0) as usize;
    let arrow = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"][eighth];
    format!("wind {} to {arrow}", fixed(libm::hypot(north, east), 1))
}

// The picture of the four fins from above, north up: the measured opening of each fin, a mark for fins that are not
// where they were commanded, and the direction to the pad.

/// Rows and columns of the picture; odd, so that its middle is a cell.
pub const FIN_PICTURE_ROWS: u16 = 9;
const FIN_PICTURE_COLUMNS: u16 = 25;
/// A fin that differs from its command by more than this is marked.
const APART_DEG: f64 = 3.0;
/// Headings of the fins 1 to 4 at zero roll: each is 30 degrees off the east-west line (landing paper, Eq. 16 and 17:
/// the moments contain sin 30 and cos 30 degrees).
const HEADING_DEG: [f64; 4] = [300.0, 240.0, 120.0, 60.0];
/// The radius of the body, the reach of a fully open fin, and the start of its label, in rows.
const BODY: f64 = 0.5;
const REACH: f64 = 2.7;
const LABEL: f64 = 3.1;
/// How many dots mark the reach of a fin.
const OUTLINE_DOTS: u32 = 5;
/// Closer than this to the pad no direction is shown, m.
const PAD_NEAR_M: f64 = 1.0;

/// The title, with the distance to the pad if it is known.
pub fn fins_title(model: &Model, now: Duration) -> String {
    match model.vehicle.motion.filter(|motion| motion.value.distance_m().is_finite()) {
        Some(motion) => {
            let mark = if motion.is_stale(now) { STALE_MARK } else { "" };
            format!("Fins above, P pad {mark}{} m", fixed(motion.value.distance_m(), 0))
        }
        None => "Fins from above".to_owned(),
    }
}

/// Draws the picture. `!` marks a fin that is not where it was commanded; `P` on the border is the direction to the
/// pad.
pub fn draw_fins(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let Some(fins) = model.vehicle.fins() else {
        draw_lines(frame, area, &[theme.line(" no data", TextRole::Label)]);
        return;
    };
    if area.width < FIN_PICTURE_COLUMNS || area.height < FIN_PICTURE_ROWS {
        return;
    }
    let area = Rect {
        x: area.x + (area.width - FIN_PICTURE_COLUMNS) / 2,
        width: FIN_PICTURE_COLUMNS,
        height: FIN_PICTURE_ROWS,
        ..area
    };
    let (mark, role) = age_mark(&fins, now);
    let roll_rad = model.vehicle.attitude.map_or(0.0, |attitude| roll_rad(&attitude.value));
    // In rows; a column is half as wide as a row is high.
    let (across, up) = (f64::from(FIN_PICTURE_COLUMNS - 1) / 4.0, f64::from(FIN_PICTURE_ROWS - 1) / 2.0);
    let text = |words: String, role: TextRole| theme.line(words, role);
    let canvas = canvas(theme, [-across, across], [-up, up], |context| {
        context.draw(&Circle { x: 0.0, y: 0.0, radius: BODY, color: theme.ink(Ink::Body) });
        for ((number, heading_deg), fin) in (1..).zip(HEADING_DEG).zip(&fins.value) {
            let (east, north) = libm::sincos(heading_deg.to_radians() + roll_rad);
            arm(context, (east, north), fin, theme.ink(Ink::Predicted), theme.ink(Ink::Scale));
            let apart = fin.error_deg() > APART_DEG;
            let degrees = fixed(fin.measured_rad.to_degrees(), 0);
            let words = format!("{number}{mark}{degrees}{}", if apart { "!" } else { "" });
            // A label extends outwards.
            let leads_left = if east < 0.0 { 0.5 * words.len() as f64 - 0.5 } else { 0.0 };
            let role = if apart { TextRole::Caution } else { role };
            context.print(column(LABEL * east - leads_left), (LABEL * north).round(), text(words, role));
        }
        if model.vehicle.attitude.is_some() {
            context.print(0.0, up, text("N".to_owned(), TextRole::Title));
        }
        let motion = model.vehicle.motion;
        if let Some((east, north)) = motion.and_then(|motion| to_pad(&motion.value)) {
            let (x, y) = on_border((east, north), (across, up));
            context.print(column(x), y.round(), text("P".to_owned(), TextRole::Title));
        }
    });
    frame.render_widget(canvas, area);
}

/// Draws a fin: dots as far as it can open, a line as far as it is open.
fn arm(
    context: &mut Context,
    (east, north): (f64, f64),
    fin: &Deflection,
    open_colour: Color,
    shut_colour: Color,
) {
    let at = |out: f64| (out * east, out * north);
    let dots: Vec<(f64, f64)> = (1..=OUTLINE_DOTS)
        .map(|dot| at(BODY + (REACH - BODY) * f64::from(dot) / f64::from(OUTLINE_DOTS)))
        .collect();
    context.draw(&Points { coords: &dots, color: shut_colour });
    let share = (fin.measured_rad / FRAC_PI_2).clamp(0.0, 1.0);
    if share > 0.0 {
        let ((x1, y1), (x2, y2)) = (at(BODY), at(BODY + share * (REACH - BODY)));
        context.draw(&Line { x1, y1, x2, y2, color: open_colour });
    }
}

/// The roll of the vehicle towards east, rad, from both cross axes.
fn roll_rad(attitude: &Attitude) -> f64 {
    let [_, body_y, body_z] = &attitude.axes;
    // At zero roll, y points east and z north.
    libm::atan2(body_z[1] - body_y[0], body_z[0] + body_y[1])
}

/// The direction to the pad as east and north; `None` over the pad, and while it is unknown.
fn to_pad(motion: &Motion) -> Option<(f64, f64)> {
    (motion.distance_m() >= PAD_NEAR_M).then_some((-motion.y_m, -motion.x_m))
}

/// Where a line in this direction leaves the picture; at the north mark it is moved aside.
fn on_border((east, north): (f64, f64), (across, up): (f64, f64)) -> (f64, f64) {
    let scale = (across / east.abs()).min(up / north.abs());
    let (x, y) = (scale * east, scale * north);
    let on_north = y > up - 0.5 && x.abs() < 0.5;
    (if on_north { libm::copysign(1.0, x) } else { x }, y)
}

/// Rounds to the nearest column, which is half a row wide.
fn column(x: f64) -> f64 {
    (2.0 * x).round() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::ATTITUDE_QUATERNION_DATA;

    /// An upright attitude with this roll.
    fn rolled(degrees: f64) -> Attitude {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (sin, cos) = libm::sincos(degrees.to_radians() / 2.0);
        // A rotation about down after a quarter turn about east.
        let [q1, q2, q3, q4] = [cos * half, -sin * half, cos * half, sin * half].map(|part| part as f32);
        Attitude::of(&ATTITUDE_QUATERNION_DATA { q1, q2, q3, q4, ..Default::default() }).unwrap()
    }

    #[test]
    fn the_fins_turn_with_the_vehicle() {
        for degrees in [0.0, 30.0, 90.0, 179.0, -45.0] {
            let found = roll_rad(&rolled(degrees)).to_degrees();
            assert!((found - degrees).abs() < 1e-4, "{found} is not {degrees}");
        }
    }

    /// The positions follow from the moments of Eq. 16 and 17: opening fin 1 pitches up and yaws right, so it is in
    /// the north-west.
    #[test]
    fn val_landing_paper_eq_16_17_fin_positions_match_their_moments() {
        let pitch_signs = [1.0, -1.0, -1.0, 1.0];
        let yaw_signs = [1.0, 1.0, -1.0, -1.0];
        for ((heading_deg, pitch), yaw) in HEADING_DEG.into_iter().zip(pitch_signs).zip(yaw_signs) {
            let (east, north) = libm::sincos(f64::to_radians(heading_deg));
            let (sin_30, cos_30) = libm::sincos(30.0_f64.to_radians());
            assert!((north - pitch * sin_30).abs() < 1e-12 && (east + yaw * cos_30).abs() < 1e-12);
        }
    }

    #[test]
    fn the_pad_is_marked_on_the_border() {
        let away = |x_m, y_m| Motion { x_m, y_m, ..Motion::vertical(100.0, 0.0) };
        let marked = |motion: Motion| to_pad(&motion).map(|way| on_border(way, (6.0, 4.0)));
        assert_eq!(marked(away(0.0, -30.0)), Some((6.0, 0.0)), "west of the pad, it lies east");
        assert_eq!(marked(away(20.0, 0.0)), Some((0.0, -4.0)), "north of the pad, it lies south");
        assert_eq!(marked(away(-20.0, 0.1)), Some((-1.0, 4.0)), "beside the north mark");
        assert_eq!(marked(away(0.3, 0.3)), None);
        assert_eq!(marked(away(f64::NAN, 0.3)), None);
    }
}
