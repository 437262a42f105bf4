//! The picture of the four fins from above, north up: the measured opening of each fin, a mark for fins that are not
//! where they were commanded, and the direction to the pad.

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
use super::theme::{Ink, TextRole, Theme};
use crate::model::Model;
use crate::model::motion::{Attitude, Motion};
use crate::model::vehicle::Deflection;

/// Rows and columns of the picture; odd, so that its middle is a cell.
pub const ROWS: u16 = 9;
const COLUMNS: u16 = 25;
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
pub fn title(model: &Model, now: Duration) -> String {
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
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let Some(fins) = model.vehicle.fins else {
        draw_lines(frame, area, &[TextLine::styled(" no data", theme.style(TextRole::Label))]);
        return;
    };
    if area.width < COLUMNS || area.height < ROWS {
        return;
    }
    let area = Rect { x: area.x + (area.width - COLUMNS) / 2, width: COLUMNS, height: ROWS, ..area };
    let (mark, role) = age_mark(&fins, now);
    let roll_rad = model.vehicle.attitude.map_or(0.0, |attitude| roll_rad(&attitude.value));
    // In rows; a column is half as wide as a row is high.
    let (across, up) = (f64::from(COLUMNS - 1) / 4.0, f64::from(ROWS - 1) / 2.0);
    let text = |words: String, role: TextRole| TextLine::styled(words, theme.style(role));
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .background_color(theme.back())
        .x_bounds([-across, across])
        .y_bounds([-up, up])
        .paint(|context| {
            context.draw(&Circle { x: 0.0, y: 0.0, radius: BODY, color: theme.ink(Ink::Body) });
            for ((number, heading_deg), fin) in (1..).zip(HEADING_DEG).zip(&fins.value) {
                let (east, north) = libm::sincos(heading_deg.to_radians() + roll_rad);
                arm(context, (east, north), fin, theme.ink(Ink::Planned), theme.ink(Ink::Ground));
                let apart = (fin.commanded_rad - fin.measured_rad).abs().to_degrees() > APART_DEG;
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
