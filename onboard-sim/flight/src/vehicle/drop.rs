//! A start below a drone, as data.

use serde::Deserialize;

use super::airframe::BadValue;

/// Below this height a hanging vehicle is never armed, m: a motor that is lit there has no room to brake a fall, and
/// people may stand under it.
pub const LOWEST_ARMED_M: f64 = 10.0;

/// A vehicle that hangs tail-down below a drone, until the drone lets it go.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
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
}

impl Drop {
    /// Checks that every value is inside its range.
    ///
    /// # Errors
    /// [`BadValue`] names the first key with a wrong value.
    pub fn validate(&self) -> Result<(), BadValue> {
        for (key, found, range, required) in [
            ("drop.height_m", self.height_m, LOWEST_ARMED_M..=150.0, "10 to 150"),
            ("drop.drift_m_s", self.drift_m_s, 0.0..=5.0, "0 to 5"),
            ("drop.rope_m", self.rope_m, 0.05..=10.0, "0.05 to 10"),
            ("drop.swing_deg", self.swing_deg, 0.0..=30.0, "0 to 30"),
            ("drop.release_after_s", self.release_after_s, 0.0..=60.0, "0 to 60"),
        ] {
            if !range.contains(&found) {
                return Err(BadValue { key, found, required });
            }
        }
        Ok(())
    }
}
