//! A start below a drone, as data.

use serde::{Deserialize, Serialize};

/// Height below which a hanging vehicle is never armed, m: a motor ignited there has no room to
/// brake a fall, and people may stand under it.
pub const LOWEST_ARMED_M: f64 = 10.0;

/// A vehicle that hangs tail-down below a drone, until the drone lets it go.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Drop {
    /// Height of the centre of gravity above the ground, m.
    pub height_m: f64,
    /// Fastest drift of the drone, in any direction, m/s.
    pub drift_m_s: f64,
    /// Length of the rope from the drone to the nose, m.
    pub rope_m: f64,
    /// Largest angle of the swing, degrees.
    pub swing_deg: f64,
    /// Time from the end of the countdown until the drone's pilot lets go, s.
    pub release_after_s: f64,
    /// Arming limits of a hanging vehicle, as means over a second: tilt, degrees, rotation rate,
    /// degrees per second, and speed, m/s. On a pad it must be at rest.
    pub tilt_max_deg: f64,
    pub rotation_max_deg_s: f64,
    pub speed_max_m_s: f64,
}
