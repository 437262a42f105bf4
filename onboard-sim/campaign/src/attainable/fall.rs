//! The fall from apogee with open fins, until the thrust begins.

use flight::vehicle::atmosphere::{Air, STANDARD_GRAVITY_M_S2};
use world::vertical::Vertical;

/// Length of a step, s. The midpoint rule is then right to a millimetre over the fall.
const STEP_S: f64 = 0.02;
/// A fall that takes longer is given up, s. From 300 m it takes 11 s.
const LONGEST_S: f64 = 120.0;

/// Height of the feet, m, and vertical velocity, m/s, at equal times since apogee, past the ground by the igniter's delay.
pub(super) struct Fall {
    states: Vec<(f64, f64)>,
    delay_s: f64,
}

impl Fall {
    /// The fall from a height of the feet, m, and a vertical velocity that is not upwards, m/s. `None` if it does not reach
    /// the ground.
    pub(super) fn new(vertical: &Vertical, height_m: f64, vertical_m_s: f64, delay_s: f64) -> Option<Self> {
        let mass_kg = vertical.mass_kg(-1.0);
        let acceleration_m_s2 = |height_m: f64, vertical_m_s: f64| {
            let air = Air::at_height_m(height_m + vertical.cg_above_feet_m());
            let drag = vertical.drag(air.density_kg_m3, vertical_m_s, 0.0);
            drag.at_n([0.0, 1.0], 1.0) / mass_kg - STANDARD_GRAVITY_M_S2
        };
        let (mut height_m, mut vertical_m_s) = (height_m, vertical_m_s);
        let mut states = vec![(height_m, vertical_m_s)];
        let mut left_s = delay_s + 2.0 * STEP_S;
        while left_s > 0.0 {
            let midway_m_s = vertical_m_s + 0.5 * STEP_S * acceleration_m_s2(height_m, vertical_m_s);
            let midway_m = height_m + 0.5 * STEP_S * vertical_m_s;
            vertical_m_s += STEP_S * acceleration_m_s2(midway_m, midway_m_s);
            height_m += STEP_S * midway_m_s;
            states.push((height_m, vertical_m_s));
            if height_m < 0.0 {
                left_s -= STEP_S;
            } else if states.len() as f64 * STEP_S > LONGEST_S {
                return None;
            }
        }
        Some(Self { states, delay_s })
    }

    /// Height of the feet, m, and vertical velocity, m/s, at the first thrust after a command at a height of the feet, m,
    /// between the ground and apogee.
    pub(super) fn onset(&self, command_m: f64) -> (f64, f64) {
        let after = self.states.partition_point(|(height_m, _)| *height_m > command_m);
        let from = after.saturating_sub(1);
        let (from_m, from_m_s) = self.states[from];
        // Under constant acceleration; the root that does not cancel, for a velocity downwards.
        let fallen_m = (from_m - command_m).max(0.0);
        let gained_m_s2 = self.slope_m_s2(from);
        let speed_m_s = libm::sqrt((from_m_s * from_m_s - 2.0 * gained_m_s2 * fallen_m).max(0.0));
        let passed_s = if fallen_m > 0.0 { 2.0 * fallen_m / (speed_m_s - from_m_s) } else { 0.0 };
        self.at(from as f64 * STEP_S + passed_s + self.delay_s)
    }

    fn slope_m_s2(&self, from: usize) -> f64 {
        let to = (from + 1).min(self.states.len() - 1);
        (self.states[to].1 - self.states[from].1) / STEP_S
    }

    fn at(&self, time_s: f64) -> (f64, f64) {
        let from = (libm::floor(time_s / STEP_S) as usize).min(self.states.len() - 2);
        let passed_s = time_s - from as f64 * STEP_S;
        let (from_m, from_m_s) = self.states[from];
        let gained_m_s = self.slope_m_s2(from) * passed_s;
        (from_m + (from_m_s + 0.5 * gained_m_s) * passed_s, from_m_s + gained_m_s)
    }
}
