//! The truth of a simulated flight, in the terms of a fit: what an interval has to hold.

use std::collections::BTreeMap;

use replay::fit::Fit;
use sim::sortie::Sortie;

/// The truth by the names of a fit's parameters.
pub(crate) fn truth(flight: &Sortie, fit: &Fit) -> BTreeMap<String, f64> {
    let body_share = fit.body_share.unwrap_or(0.5);
    let drawn = flight.drawn();
    let truth = &drawn.truth;
    let airframe = &flight.mission().airframe;
    let arm_m = airframe.thrust_arm_m(airframe.mass.loaded_cg_station_m);
    let [pitch_rad, yaw_rad] = truth.thrust_misalignment_rad;
    let [x_m, y_m, z_m] = truth.cg_offset_m;
    let [oy_m, oz_m] = truth.thrust_offset_m;
    // The torque of an angle is that of thrust and arm, over the inertia.
    let turns = (arm_m + x_m) / arm_m / truth.inertia_scale;
    let (sin, cos) = libm::sincos(truth.wind_towards_rad);
    let [body, fins] =
        [truth.body_drag_scale, truth.fin_drag_scale].map(|own| truth.drag_scale * own / truth.mass_scale);
    let servo = &airframe.gimbal.servo;
    let rows = [
        ("thrust_scale", truth.impulse_scale / truth.mass_scale),
        ("burn_time_scale", truth.burn_time_scale),
        // By impulse: a thrust that rises slowly makes the whole burn late by half of its rise.
        ("ignition_delay", truth.ignition_delay_s + 0.5 * truth.thrust_rise_s + truth.chuff_s[1]),
        ("drag_per_mass_scale", body_share * body + (1.0 - body_share) * fins),
        ("body_drag_scale", body),
        ("fin_drag_scale", fins),
        ("exhaust_body_loss", truth.plume_body_loss),
        ("exhaust_fin_loss", truth.plume_fin_loss),
        ("gimbal_delay", servo.delay_s),
        ("gimbal_rate", servo.rate_deg_s),
        ("gimbal_gain", truth.gimbal_gain * turns),
        (
            "gimbal_pitch_offset",
            (pitch_rad * turns + (z_m - oz_m) / arm_m / truth.inertia_scale).to_degrees(),
        ),
        ("gimbal_yaw_offset", (yaw_rad * turns - (y_m - oy_m) / arm_m / truth.inertia_scale).to_degrees()),
        ("gimbal_play", servo.slop_deg + truth.gimbal_slop_rad.to_degrees()),
        ("wind_x", truth.wind_m_s * cos),
        ("wind_y", truth.wind_m_s * sin),
    ];
    let mut all: BTreeMap<String, f64> = rows.map(|(name, value)| (name.to_owned(), value)).into();
    all.extend((1..).zip(truth.thrust_shape).map(|(k, value)| (format!("thrust_shape_{k}"), value)));
    all
}
