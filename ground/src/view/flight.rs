//! Altitude, speeds, attitude.

use std::time::Duration;

use ratatui::text::Line;

use super::number::row;
use super::theme::Theme;
use crate::model::Model;
use crate::model::vehicle::Sample;

/// The panel's rows.
pub fn rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let motion = model.vehicle.best_motion();
    let attitude = model.vehicle.attitude;
    let body = model.vehicle.body_speed();
    let of = |value: Option<f64>, received_at: Option<Duration>| {
        value.zip(received_at).map(|(value, received_at)| Sample { value, received_at })
    };
    let motion_at = motion.map(|motion| motion.received_at);
    let attitude_at = attitude.map(|attitude| attitude.received_at);
    let body_at = body.map(|body| body.received_at);
    let altitude = of(motion.map(|m| m.value.altitude_m), motion_at);
    let climb = of(motion.map(|m| m.value.climb_m_s), motion_at);
    let horizontal = of(motion.map(|m| m.value.vx_m_s), motion_at);
    let u = of(body.map(|b| b.value.u_m_s), body_at);
    let w = of(body.map(|b| b.value.w_m_s), body_at);
    let pitch = of(attitude.map(|a| a.value.pitch_rad.to_degrees()), attitude_at);
    let tilt = of(attitude.map(|a| a.value.tilt_rad.to_degrees()), attitude_at);
    let rate = of(attitude.map(|a| a.value.pitch_rate_rad_s.to_degrees()), attitude_at);
    vec![
        row(theme, "altitude", altitude, 2, "m", now),
        row(theme, "vertical", climb, 2, "m/s", now),
        row(theme, "horizontal", horizontal, 2, "m/s", now),
        row(theme, "u axial", u, 2, "m/s", now),
        row(theme, "w lateral", w, 3, "m/s", now),
        row(theme, "pitch", pitch, 2, "deg", now),
        row(theme, "tilt", tilt, 2, "deg", now),
        row(theme, "pitch rate", rate, 2, "deg/s", now),
    ]
}
