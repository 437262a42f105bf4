//! A fit as a mission: the mission that was flown, with what was found of its vehicle.
//!
//! The thrust, the burn time and the ignition delay of one motor stay out: that motor is burnt, and the next one of its lot
//! has others.

use std::fmt::Write as _;

use super::{Fit, Parameter};
use crate::settings::{Setting, SettingError, mission_toml_with, mission_with};

/// The text of a mission with what a fit found, each change with its interval in a comment at the top.
///
/// # Errors
/// The mission's text is none, or a value that was found is outside the range of its key.
pub fn patched(mission_toml: &str, fit: &Fit) -> Result<String, SettingError> {
    let mission = mission_with(mission_toml, &[])?;
    let airframe = &mission.airframe;
    let mut changes: Vec<(&str, f64, &Parameter)> = Vec::new();
    let mut change = |path, value: &dyn Fn(f64) -> f64, name: &str| {
        if let Some(found) = fit.get(name) {
            changes.push((path, value(found.value), found));
        }
    };
    // Where the two cannot be told apart, both have the scale of the sum.
    let apart = ["body_drag_scale", "fin_drag_scale"].iter().all(|name| fit.get(name).is_some());
    let (body, fins) =
        if apart { ("body_drag_scale", "fin_drag_scale") } else { ("drag_scale", "drag_scale") };
    let (along, open) = (airframe.body.axial_drag_coefficient, airframe.fins.drag_coefficient);
    change("airframe.body.axial_drag_coefficient", &|scale| along * scale, body);
    change("airframe.fins.drag_coefficient", &|scale| open * scale, fins);
    change("airframe.gimbal.servo.delay_s", &|delay_s| delay_s, "gimbal_delay");
    change("airframe.gimbal.servo.rate_deg_s", &|rate_deg_s| rate_deg_s, "gimbal_rate");
    change("airframe.gimbal.servo.slop_deg", &|play_deg| play_deg.max(0.0), "gimbal_play");
    change("estimator.gyro_noise_deg_s_sqrt_hz", &|noise| noise, "gyro_noise");
    change("estimator.accelerometer_noise_mg_sqrt_hz", &|noise| noise, "accelerometer_noise");
    change("estimator.barometer_m", &|noise| noise, "barometer_noise");
    change("estimator.gnss_velocity_m_s", &|noise| noise, "gnss_velocity_noise");
    change("estimator.gnss_horizontal_m", &|noise| noise, "gnss_horizontal_noise");
    change("estimator.gnss_vertical_m", &|noise| noise, "gnss_vertical_noise");
    change("estimator.lidar_m", &|noise| noise, "lidar_noise");
    let setting = |(path, value, _): &(&str, f64, &Parameter)| Setting {
        path: (*path).to_owned(),
        value: toml::Value::Float(*value),
        at_s: None,
    };
    let settings: Vec<Setting> = changes.iter().map(setting).collect();
    let text = mission_toml_with(mission_toml, &settings)?;
    mission_with(&text, &[])?;
    let mut head = format!("# {} with what was found in {}:\n", fit.mission, one_line(&fit.source));
    for (path, value, found) in changes {
        let Parameter { name, low, high, unit, .. } = found;
        // Writing to a String cannot fail.
        let _ = writeln!(head, "# {path} = {value:.6}, from {name} {low:.6} to {high:.6} {unit} (95 %)");
    }
    Ok(head + &text)
}

/// Text for a comment: without line breaks and control characters.
fn one_line(text: &str) -> String {
    protocol::text::printable(text.as_bytes())
}
