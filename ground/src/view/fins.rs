//! The four fins from above, north up: where each stands, how far it is open, measured, and where that is not what was
//! commanded; and where the pad lies.

use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use super::draw_lines;
use super::number::{STALE_MARK, age_mark, fixed};
use super::theme::{Role, Theme};
use crate::model::Model;
use crate::model::motion::{Attitude, Motion};
use crate::model::vehicle::Deflection;

/// Rows and columns of the picture: odd, so that its middle is one.
pub const ROWS: u16 = 9;
const COLUMNS: u16 = 25;
/// A fin further from its command than this is marked.
const APART_DEG: f64 = 3.0;
/// Headings of the fins 1 to 4 of a vehicle that stands unrolled: each 30 degrees off the east-west line (landing paper,
/// Eq. 16 and 17: its moments go by sin 30 and cos 30 degrees).
const STAND_DEG: [f64; 4] = [300.0, 240.0, 120.0, 60.0];
/// The body's radius, how far out a fully open fin reaches, and where its label begins, rows.
const BODY: f64 = 0.5;
const REACH: f64 = 2.7;
const LABEL: f64 = 3.1;
/// Dots of the outline of an arm that is not open.
const OUTLINE_DOTS: u32 = 5;
/// Nearer than this the pad has no direction, m.
const PAD_NEAR_M: f64 = 1.0;

/// The title: what is up, and how far the pad is.
pub fn title(model: &Model, now: Duration) -> String {
    match model.vehicle.motion.filter(|motion| motion.value.distance_m().is_finite()) {
        Some(motion) => {
            let mark = if motion.is_stale(now) { STALE_MARK } else { "" };
            format!("Fins above, P pad {mark}{} m", fixed(motion.value.distance_m(), 0))
        }
        None => "Fins from above".to_owned(),
    }
}

/// Draws the picture. `!` marks a fin that is not where it was commanded; `P` on the border the way to the pad.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let Some(fins) = model.vehicle.fins else {
        draw_lines(frame, area, &[TextLine::styled(" no data", theme.style(Role::Label))]);
        return;
    };
    if area.width < COLUMNS || area.height < ROWS {
        return;
    }
    let area = Rect { x: area.x + (area.width - COLUMNS) / 2, width: COLUMNS, height: ROWS, ..area };
    let (mark, role) = age_mark(&fins, now);
    let roll_rad = model.vehicle.attitude.map_or(0.0, |attitude| roll_rad(&attitude.value));
    // In rows; a column is half as wide.
    let (across, up) = (f64::from(COLUMNS - 1) / 4.0, f64::from(ROWS - 1) / 2.0);
    let colour = |colour| if theme.colour { colour } else { Color::Reset };
    let text = |words: String, role: Role| TextLine::styled(words, theme.style(role));
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([-across, across])
        .y_bounds([-up, up])
        .paint(|context| {
            context.draw(&Circle { x: 0.0, y: 0.0, radius: BODY, color: colour(Color::Reset) });
            for ((number, stand_deg), fin) in (1..).zip(STAND_DEG).zip(&fins.value) {
                let (east, north) = libm::sincos(stand_deg.to_radians() + roll_rad);
                arm(context, (east, north), fin, colour(Color::Cyan), colour(Color::DarkGray));
                let apart = (fin.commanded_rad - fin.measured_rad).abs().to_degrees() > APART_DEG;
                let degrees = fixed(fin.measured_rad.to_degrees(), 0);
                let words = format!("{number}{mark}{degrees}{}", if apart { "!" } else { "" });
                // A label leads outwards; a column is half a row.
                let leads_left = if east < 0.0 { 0.5 * words.len() as f64 - 0.5 } else { 0.0 };
                let role = if apart { Role::Caution } else { role };
                context.print(column(LABEL * east - leads_left), (LABEL * north).round(), text(words, role));
            }
            if model.vehicle.attitude.is_some() {
                context.print(0.0, up, text("N".to_owned(), Role::Title));
            }
            let motion = model.vehicle.motion;
            if let Some((east, north)) = motion.and_then(|motion| to_pad(&motion.value)) {
                let (x, y) = on_border((east, north), (across, up));
                context.print(column(x), y.round(), text("P".to_owned(), Role::Title));
            }
        });
    frame.render_widget(canvas, area);
}

/// Dots as far as it could open, a line as far as it is open.
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

/// How far the vehicle has turned about its axis, rad, towards east: as its two cross axes have it together.
fn roll_rad(attitude: &Attitude) -> f64 {
    let [_, body_y, body_z] = &attitude.axes;
    // Unrolled, y points east and z north.
    libm::atan2(body_z[1] - body_y[0], body_z[0] + body_y[1])
}

/// East and north of the way to the pad; `None` over it, and where it is not known.
fn to_pad(motion: &Motion) -> Option<(f64, f64)> {
    (motion.distance_m() >= PAD_NEAR_M).then_some((-motion.y_m, -motion.x_m))
}

/// Where the way in this direction leaves the picture; above the middle it steps aside for the north mark.
fn on_border((east, north): (f64, f64), (across, up): (f64, f64)) -> (f64, f64) {
    let scale = (across / east.abs()).min(up / north.abs());
    let (x, y) = (scale * east, scale * north);
    let on_north = y > up - 0.5 && x.abs() < 0.5;
    (if on_north { libm::copysign(1.0, x) } else { x }, y)
}

/// The place of the nearest column: half a row wide.
fn column(x: f64) -> f64 {
    (2.0 * x).round() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::ATTITUDE_QUATERNION_DATA;

    /// Upright, turned about its axis.
    fn rolled(degrees: f64) -> Attitude {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (sin, cos) = libm::sincos(degrees.to_radians() / 2.0);
        // A turn about down after a quarter turn about east.
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

    /// Where the moments of Eq. 16 and 17 have them: opening fin 1 pitches up and yaws right, so it stands north-west.
    #[test]
    fn val_landing_paper_eq_16_17_the_fins_stand_where_their_moments_come_from() {
        let pitch_signs = [1.0, -1.0, -1.0, 1.0];
        let yaw_signs = [1.0, 1.0, -1.0, -1.0];
        for ((stand_deg, pitch), yaw) in STAND_DEG.into_iter().zip(pitch_signs).zip(yaw_signs) {
            let (east, north) = libm::sincos(f64::to_radians(stand_deg));
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
