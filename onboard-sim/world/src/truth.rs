//! How the true vehicle and the weather of one flight differ from the nominal data. A campaign draws these values for
//! each flight.

use serde::{Deserialize, Serialize};

/// The true parameters of one flight. [`Truth::default`] is the nominal data in still air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Truth {
    /// True impulse over the motor file's.
    pub impulse_scale: f64,
    /// True burn time over the motor file's.
    pub burn_time_scale: f64,
    /// Time from the ignition command to the first thrust, s.
    pub ignition_delay_s: f64,
    /// Thrust direction with the gimbal at its centre, as gimbal angles (pitch, yaw), rad.
    pub thrust_misalignment_rad: [f64; 2],
    /// Offset of the thrust from the axis, along body (y, z), m.
    pub thrust_offset_m: [f64; 2],
    /// True mass and inertia over the data's.
    pub mass_scale: f64,
    /// True aerodynamic force over the model's.
    pub drag_scale: f64,
    /// Offset of the true from the nominal centre of gravity, in body axes (x towards the nose), m.
    pub cg_offset_m: [f64; 3],
    /// Mean wind 10 m above the ground, m/s.
    pub wind_m_s: f64,
    /// Direction that the wind blows to, from world x towards world y, rad.
    pub wind_towards_rad: f64,
    /// Gust intensity over that of the military standard; 0 is none.
    pub gust_scale: f64,
}

impl Default for Truth {
    fn default() -> Self {
        Self {
            impulse_scale: 1.0,
            burn_time_scale: 1.0,
            ignition_delay_s: 0.15,
            thrust_misalignment_rad: [0.0; 2],
            thrust_offset_m: [0.0; 2],
            mass_scale: 1.0,
            drag_scale: 1.0,
            cg_offset_m: [0.0; 3],
            wind_m_s: 0.0,
            wind_towards_rad: 0.0,
            gust_scale: 1.0,
        }
    }
}
