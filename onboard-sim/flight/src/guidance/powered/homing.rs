//! Chooses the landing point of a plan along its plane.

use serde::Deserialize;

/// Limits of the homing to the pad: a plan lands only as near as necessary, and diverts no farther than a moderate lean
/// reaches.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Homing {
    /// Distance from the pad that counts as near enough, m.
    pub near_m: f64,
    /// Largest diversion of a plan, per squared second that is left, m/s^2.
    pub reach_m_s2: f64,
}

impl Homing {
    /// The landing point along the plane, m from the pad, at a velocity of `along_m_s` with `left_s` to go.
    pub(super) fn target_m(&self, x_m: f64, along_m_s: f64, left_s: f64) -> f64 {
        let free_m = here_m(x_m, along_m_s, left_s);
        let reach_m = self.reach_m_s2 * left_s * left_s;
        free_m + (free_m.clamp(-self.near_m, self.near_m) - free_m).clamp(-reach_m, reach_m)
    }
}

/// The landing point without homing, m from the pad: the end of a constant deceleration from `along_m_s` in `left_s`.
/// It needs the smallest lean.
pub(crate) fn here_m(x_m: f64, along_m_s: f64, left_s: f64) -> f64 {
    x_m + 0.5 * along_m_s * left_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_diverts_to_the_edge_of_the_pad_within_its_reach() {
        let homing = Homing { near_m: 6.0, reach_m_s2: 0.5 };
        assert!((homing.target_m(4.0, 0.0, 4.0) - 4.0).abs() < 1e-12, "near enough");
        assert!((homing.target_m(10.0, 0.0, 4.0) - 6.0).abs() < 1e-12, "to the edge");
        assert!((homing.target_m(-50.0, 0.0, 4.0) + 42.0).abs() < 1e-12, "8 m are in reach in 4 s");
        assert!((homing.target_m(10.0, -4.0, 4.0) - 2.0).abs() < 1e-12, "braking evenly ends there");
    }
}
