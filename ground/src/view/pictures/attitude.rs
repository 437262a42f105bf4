//! The vehicle from a side, as it stands in the air: body, legs, fins, flame along the gimbal,
//! velocity and wind.

use std::time::Duration;

use protocol::dialect::{TdChute, TdPhase};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::text::Line;
use ratatui::widgets::canvas::{self, Context};

use super::{DOTS_ACROSS, DOTS_UP, Ink, Plane, TextRole, Theme};
use crate::model::{Attitude, Change, GRAVITY_M_S2, Gimbal, Model, NorthEastUp, Vehicle};
use crate::view::{draw_line, fixed, widgets::framed};

/// From where the vehicle is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// East is right.
    South,
    /// North is right.
    East,
}

impl Side {
    fn sees(self, [north, east, up]: NorthEastUp) -> (f64, f64) {
        match self {
            Self::South => (east, up),
            Self::East => (north, up),
        }
    }

    /// Its title, and the directions at the left and at the right.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::South => ["from S", "W", "E"],
            Self::East => ["from E", "S", "N"],
        }
    }
}

// The drawing, in lengths of the body, from its middle.

const NOSE: f64 = 0.5;
const TAIL: f64 = -0.5;
/// Where the nose begins to taper.
const SHOULDER: f64 = 0.3;
const HALF_WIDTH: f64 = 0.06;
/// Where a leg begins, where it ends, and how far out.
const LEG: [f64; 3] = [-0.28, -0.62, 0.24];
/// Where a fin is hinged, and its length. Shut it lies along the body.
const HINGE: f64 = 0.22;
const FIN: f64 = 0.3;
const FLAME: f64 = 0.28;
/// The canopy over the nose: how far out and how high its hem and its top are, while it fills and
/// when it is open.
const CANOPY: [[f64; 3]; 2] = [[0.07, 0.66, 0.8], [0.34, 0.64, 0.8]];
/// The arc with the limit of the tilt, over the nose, and how far it reaches to either side, rad.
const ARC: f64 = 0.72;
const ARC_REACH: f64 = 0.7;
/// How far the picture reaches from the middle of the body, to either side and up. A body that lies
/// on its side may be cut.
const REACH: [f64; 2] = [0.56, 0.84];
/// Headings of the fins 1 to 4 at zero roll: each is 30 degrees off the east-west line (landing
/// paper, Eq. 16 and 17: the moments contain sin 30 and cos 30 degrees).
const FIN_HEADING_DEG: [f64; 4] = [300.0, 240.0, 120.0, 60.0];
/// Steps of the direction cosines of an axis, and of the opening of a fin, rad.
const STEPS: f64 = 16.0;
const FIN_STEP: f64 = 0.25;
/// A fin that differs from its command by more than this is drawn with it.
const APART_DEG: f64 = 3.0;

/// A place on the body, by its axes: towards the nose, y and z.
fn on_body(attitude: &Attitude, [x, y, z]: [f64; 3]) -> NorthEastUp {
    let [nose, body_y, body_z] = &attitude.axes;
    std::array::from_fn(|axis| x * nose[axis] + y * body_y[axis] + z * body_z[axis])
}

/// A panel with the vehicle from a side; without an attitude, that there is none.
pub fn draw_attitude(model: &Model, side: Side, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let vehicle = &model.vehicle;
    let [title, left, right] = side.words();
    let tilt = vehicle.tilt_deg().filter(|tilt| side == Side::South && !tilt.is_stale(now));
    let tilt = tilt.map_or_else(Line::default, |tilt| {
        // A narrow panel has room for the number.
        let word = if area.width < 24 { "" } else { "tilt " };
        theme.line(format!(" {word}{} deg ", fixed(tilt.value, 0)), TextRole::Plain)
    });
    let area = framed(title, tilt, theme, frame, area);
    let Some(attitude) = vehicle.attitude.filter(|attitude| !attitude.is_stale(now)) else {
        return draw_line(frame, area, theme.line(" not known", TextRole::Label));
    };
    if area.width < 8 || area.height < 5 {
        return;
    }
    // In steps that the eye just sees, 4 degrees: what trembles costs a slow line the most.
    let steady = |axis: NorthEastUp| axis.map(|part| (part * STEPS).round() / STEPS);
    let attitude = Attitude { axes: attitude.value.axes.map(steady), ..attitude.value };
    let (across, up) = (f64::from(area.width) * DOTS_ACROSS, f64::from(area.height) * DOTS_UP);
    let per_dot = 2.0 * (REACH[0] / across).max(REACH[1] / up);
    let half = [per_dot * across / 2.0, per_dot * up / 2.0];
    let plane = Plane { area, x: [-half[0], half[0]], y: [-half[1], half[1]] };
    let seen = |place: [f64; 3]| side.sees(on_body(&attitude, place));
    let stroke = |context: &mut Context, from: [f64; 3], to: [f64; 3], color: Color| {
        line(context, seen(from), seen(to), color);
    };
    let burning = gives_thrust(vehicle);
    let gimbal = vehicle.gimbal().map_or_else(Gimbal::default, |gimbal| gimbal.value);
    let limit_rad = vehicle.limits().map(|of| f64::from(of.tilt_rad)).filter(|rad| *rad < ARC_REACH);
    let near_ground = vehicle.height_m().is_some_and(|height| height.value < 2.0);
    let chute = vehicle.descent().map(|descent| descent.value.chute).filter(|_| vehicle.in_flight());
    plane.draw(theme, frame, |context| {
        let (nose, tip) = (seen([NOSE, 0.0, 0.0]), seen([ARC, 0.0, 0.0]));
        match chute {
            Some(TdChute::TD_CHUTE_FIRED) => canopy(context, nose, CANOPY[0], theme),
            Some(TdChute::TD_CHUTE_OPEN) => canopy(context, nose, CANOPY[1], theme),
            _ => {
                arc(context, limit_rad, per_dot, theme);
                // The pointer to the arc, along the nose.
                plane.predicted(context, &[nose, tip], theme.ink(Ink::Measured));
            }
        }
        for azimuth in 0..4_u32 {
            let (sin, cos) = libm::sincos(f64::from(azimuth).mul_add(std::f64::consts::FRAC_PI_2, 0.6));
            let out = |x: f64, out: f64| [x, out * sin, out * cos];
            stroke(context, out(LEG[0], HALF_WIDTH), out(LEG[1], LEG[2]), theme.ink(Ink::Body));
        }
        for (heading_deg, fin) in
            FIN_HEADING_DEG.into_iter().zip(vehicle.fins().map(|fins| fins.value).unwrap_or_default())
        {
            let (east, north) = libm::sincos(heading_deg.to_radians());
            let place = |along: f64, out: f64| [along, out * east, out * north];
            let at = |opening_rad: f64, length: f64| {
                let (sin, cos) = libm::sincos((opening_rad / FIN_STEP).round() * FIN_STEP);
                place(HINGE - length * cos, HALF_WIDTH + per_dot + length * sin)
            };
            let (command_ink, is) = (theme.ink(Ink::Predicted), theme.ink(Ink::Measured));
            if fin.error_deg() > APART_DEG {
                stroke(context, at(fin.commanded_rad, 0.0), at(fin.commanded_rad, FIN), command_ink);
            }
            for beside in [0.0, per_dot] {
                let [x, y, z] = at(fin.measured_rad, FIN);
                stroke(context, place(HINGE + beside, HALF_WIDTH), [x + beside, y, z], is);
            }
        }
        // Of two colours in a cell the last counts.
        body(context, &seen, per_dot, theme);
        // The flame goes against the thrust, which a positive angle turns towards y, and away from
        // z.
        let (pitch, yaw) = (libm::sin(gimbal.pitch.measured_rad), libm::sin(gimbal.yaw.measured_rad));
        for (shift, share) in [(-per_dot, 0.7), (0.0, 1.0), (per_dot, 0.7)].into_iter().filter(|_| burning) {
            let length = share * FLAME;
            let end = [TAIL - length, shift - length * yaw, shift + length * pitch];
            stroke(context, [TAIL, shift, shift], end, theme.ink(Ink::Flame));
        }
        if near_ground {
            let y = LEG[1] - per_dot;
            context.draw(&canvas::Line::new(-half[0], y, half[0], y, theme.ink(Ink::Scale)));
        }
        let motion = vehicle.best_motion().map(|of| of.value).filter(|motion| motion.speed_m_s() > 1.0);
        if let Some(motion) = motion {
            let velocity = side.sees([motion.vx_m_s, motion.vy_m_s, motion.climb_m_s]);
            arrow(context, (0.72 * half[0], 0.1), velocity, theme.ink(Ink::Measured), per_dot);
        }
    });
    let label = theme.style(TextRole::Label);
    plane.write(frame, (-half[0], half[1]), left, label);
    plane.write(frame, (half[0], half[1]), right, label);
    if vehicle.best_motion().is_some_and(|motion| motion.value.speed_m_s() > 1.0) {
        plane.write(frame, (0.72 * half[0], 0.42), "v", theme.ground().fg(theme.ink(Ink::Measured)));
    }
}

/// Least specific force of a motor, m/s2: a vehicle that falls freely or is braked by the air in
/// the last metres has less.
const THRUST_MIN_M_S2: f64 = 4.0;

/// Whether a motor gives thrust, by the vehicle's measurements: the phases after an ignition that
/// was only commanded, and the acceleration as soon as it is estimated.
fn gives_thrust(vehicle: &Vehicle) -> bool {
    let phase = match vehicle.phase_now() {
        Some(TdPhase::TD_PHASE_BOOST) => vehicle.has_lifted(),
        phase => phase == Some(TdPhase::TD_PHASE_POWERED),
    };
    let is_measured = |change: Change| {
        let [north, east, up] = change.acceleration_m_s2;
        libm::hypot(libm::hypot(north, east), up + GRAVITY_M_S2) > THRUST_MIN_M_S2
    };
    phase && vehicle.trend.mean_change().is_none_or(is_measured)
}

fn line(context: &mut Context, (x1, y1): (f64, f64), (x2, y2): (f64, f64), color: Color) {
    context.draw(&canvas::Line { x1, y1, x2, y2, color });
}

fn arc(context: &mut Context, limit_rad: Option<f64>, per_dot: f64, theme: Theme) {
    let at = |angle: f64, radius: f64| {
        let (sin, cos) = libm::sincos(angle);
        (radius * sin, radius * cos)
    };
    let dots: Vec<(f64, f64)> = (-8..=8_i32).map(|k| at(ARC_REACH * f64::from(k) / 8.0, ARC)).collect();
    context.draw(&canvas::Points { coords: &dots, color: theme.ink(Ink::Scale) });
    for angle in limit_rad.into_iter().flat_map(|limit| [-limit, limit]) {
        line(context, at(angle, ARC - 3.0 * per_dot), at(angle, ARC + 3.0 * per_dot), theme.ink(Ink::Limit));
    }
}

/// The canopy over the vehicle that hangs from it: a half of an ellipse, and its lines to the nose.
fn canopy(context: &mut Context, (nose_x, nose_y): (f64, f64), [out, hem, top]: [f64; 3], theme: Theme) {
    let color = theme.ink(Ink::Measured);
    let at = |k: i32| {
        let (sin, cos) = libm::sincos(f64::from(k) * std::f64::consts::PI / 16.0);
        (nose_x + out * cos, hem + (top - hem) * sin)
    };
    for k in 0..16 {
        line(context, at(k), at(k + 1), color);
    }
    for k in [0, 5, 11, 16] {
        line(context, (nose_x, nose_y), (at(k).0, hem), color);
    }
}

/// The body, filled: lines from tail to nose beside each other, as it is seen.
fn body(context: &mut Context, seen: &impl Fn([f64; 3]) -> (f64, f64), per_dot: f64, theme: Theme) {
    let ((x1, y1), (x2, y2)) = (seen([TAIL, 0.0, 0.0]), seen([NOSE, 0.0, 0.0]));
    let length = libm::hypot(x2 - x1, y2 - y1).max(per_dot);
    let (side_x, side_y) = (-(y2 - y1) / length, (x2 - x1) / length);
    // Twice as close as dots, so that none is left out where the body leans.
    let lines = (2.0 * HALF_WIDTH / per_dot).round().max(1.0) as i32;
    for k in -lines..=lines {
        let out = f64::from(k) / f64::from(lines);
        // It tapers from the shoulder to the nose.
        let end = SHOULDER + (NOSE - SHOULDER) * (1.0 - out.abs());
        let (x, y) = (x1 + out * HALF_WIDTH * side_x, y1 + out * HALF_WIDTH * side_y);
        let top = (x + (end - TAIL) * (x2 - x1), y + (end - TAIL) * (y2 - y1));
        line(context, (x, y), top, theme.ink(Ink::Body));
    }
}

/// An arrow of fixed length.
fn arrow(context: &mut Context, (x, y): (f64, f64), along: (f64, f64), color: Color, per_dot: f64) {
    let eighth = std::f64::consts::FRAC_PI_8;
    let (dy, dx) = libm::sincos((libm::atan2(along.1, along.0) / eighth).round() * eighth);
    let (half, head) = (0.16, (4.0 * per_dot).min(0.1));
    let (tip_x, tip_y) = (x + half * dx, y + half * dy);
    line(context, (x - half * dx, y - half * dy), (tip_x, tip_y), color);
    for turn in [2.5_f64, -2.5] {
        let (sin, cos) = libm::sincos(turn);
        let end = (tip_x + head * (cos * dx - sin * dy), tip_y + head * (sin * dx + cos * dy));
        line(context, (tip_x, tip_y), end, color);
    }
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
            for heading_deg in FIN_HEADING_DEG {
                let (east, north) = libm::sincos(heading_deg.to_radians());
                let [north, east, up] = on_body(&rolled(degrees), [0.0, east, north]);
                let found = libm::atan2(east, north).to_degrees() - degrees;
                assert!(
                    (found - heading_deg).rem_euclid(360.0) < 1e-3
                        || (heading_deg - found).rem_euclid(360.0) < 1e-3,
                    "{found}"
                );
                assert!(up.abs() < 1e-6);
            }
        }
    }

    /// The positions follow from the moments of Eq. 16 and 17: opening fin 1 pitches up and yaws
    /// right, so it is in the north-west.
    #[test]
    fn val_landing_paper_eq_16_17_fin_positions_match_their_moments() {
        let pitch_signs = [1.0, -1.0, -1.0, 1.0];
        let yaw_signs = [1.0, 1.0, -1.0, -1.0];
        for ((heading_deg, pitch), yaw) in FIN_HEADING_DEG.into_iter().zip(pitch_signs).zip(yaw_signs) {
            let (east, north) = libm::sincos(f64::to_radians(heading_deg));
            let (sin_30, cos_30) = libm::sincos(30.0_f64.to_radians());
            assert!((north - pitch * sin_30).abs() < 1e-12 && (east + yaw * cos_30).abs() < 1e-12);
        }
    }

    #[test]
    fn a_lean_towards_the_east_leans_to_the_right_from_the_south() {
        let (sin, cos) = libm::sincos(10.0_f64.to_radians());
        let mut attitude = rolled(0.0);
        attitude.axes[0] = [0.0, sin, cos];
        assert_eq!(Side::South.sees(on_body(&attitude, [1.0, 0.0, 0.0])), (sin, cos));
        assert_eq!(Side::East.sees(on_body(&attitude, [1.0, 0.0, 0.0])), (0.0, cos));
    }
}
