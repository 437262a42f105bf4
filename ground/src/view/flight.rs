//! The panel of altitude, speeds and attitude.

use std::time::Duration;

use ratatui::text::Line;

use super::number::row;
use super::theme::Theme;
use crate::model::Model;
use crate::model::motion::{Attitude, BodySpeed, Motion};

/// The rows: signed values for a planar vehicle, magnitudes for a vehicle in space.
pub fn rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let vehicle = &model.vehicle;
    let (motion, attitude, body) = (vehicle.best_motion(), vehicle.attitude, vehicle.body_speed());
    let of_motion = |pick: fn(&Motion) -> f64| motion.map(|known| known.map(pick));
    let of_attitude = |pick: fn(&Attitude) -> f64| attitude.map(|known| known.map(pick));
    let of_body = |pick: fn(&BodySpeed) -> f64| body.map(|known| known.map(pick));
    let line = |label, value, decimals, unit| row(theme, label, value, decimals, unit, now);
    let mut rows = vec![
        line("altitude", of_motion(|m| m.altitude_m), 2, "m"),
        line("vertical", of_motion(|m| m.climb_m_s), 2, "m/s"),
    ];
    let tilt = of_attitude(|a| a.tilt_rad.to_degrees());
    let axial = of_body(|b| b.u_m_s);
    if vehicle.in_space {
        rows.extend([
            line("horizontal", of_motion(Motion::horizontal_m_s), 2, "m/s"),
            line("distance", of_motion(Motion::distance_m), 1, "m"),
            line("u axial", axial, 2, "m/s"),
            line("lateral", of_body(BodySpeed::lateral_m_s), 3, "m/s"),
            line("tilt", tilt, 2, "deg"),
            line("turn rate", of_attitude(|a| a.turn_rate_rad_s().to_degrees()), 2, "deg/s"),
        ]);
    } else {
        rows.extend([
            line("horizontal", of_motion(|m| m.vx_m_s), 2, "m/s"),
            line("u axial", axial, 2, "m/s"),
            line("w lateral", of_body(|b| b.w_m_s), 3, "m/s"),
            line("pitch", of_attitude(|a| a.pitch_rad.to_degrees()), 2, "deg"),
            line("tilt", tilt, 2, "deg"),
            line("pitch rate", of_attitude(|a| a.pitch_rate_rad_s.to_degrees()), 2, "deg/s"),
        ]);
    }
    rows
}
