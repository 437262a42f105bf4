//! The height at which a flight must begin.

use flight::guidance::vertical::{Column, fall_ends_m_s};

/// What leads from the start of a flight to the first thrust: a fall from rest with open fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fall {
    pub gravity_m_s2: f64,
    /// Terminal speed with open fins, m/s.
    pub terminal_m_s: f64,
    /// Distance from the feet up to the centre of gravity, m.
    pub cg_above_feet_m: f64,
}

impl Fall {
    /// With open fins of a drag area, m^2.
    pub fn new(column: &Column, open_fins_m2: f64, cg_above_feet_m: f64) -> Self {
        Self {
            gravity_m_s2: column.gravity_m_s2,
            terminal_m_s: column.terminal_speed_m_s(open_fins_m2),
            cg_above_feet_m,
        }
    }

    /// Height of the centre of gravity above the pad, m, at which the flight must begin so that the vehicle falls at a
    /// speed, m/s, when its feet are at a height, m. `None` at the terminal speed and above.
    ///
    /// A start at apogee and one that is dropped both begin at rest, so the height is the same. The difference of `v^2`
    /// from `V_t^2` falls by a factor of e in each `V_t^2 / (2 g)` of height.
    pub fn start_height_m(&self, feet_m: f64, speed_m_s: f64) -> Option<f64> {
        let share = speed_m_s / self.terminal_m_s;
        let left = 1.0 - share * share;
        let e_height_m = self.terminal_m_s * self.terminal_m_s / (2.0 * self.gravity_m_s2);
        (left > 0.0).then(|| feet_m + self.cg_above_feet_m - e_height_m * libm::log(left))
    }

    /// Speed, m/s, when the feet are at a height, m, after a start at a height of the centre of gravity, m.
    pub fn speed_m_s(&self, start_height_m: f64, feet_m: f64) -> f64 {
        let fallen_m = start_height_m - self.cg_above_feet_m - feet_m;
        fall_ends_m_s(fallen_m, 0.0, self.terminal_m_s, self.gravity_m_s2)
    }

    /// Speed, m/s, after falling for a time, s: `V_t tanh(g t / V_t)`.
    pub fn speed_after_m_s(&self, time_s: f64) -> f64 {
        self.terminal_m_s * libm::tanh(self.gravity_m_s2 * time_s / self.terminal_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FALL: Fall = Fall { gravity_m_s2: 9.81, terminal_m_s: 40.0, cg_above_feet_m: 0.5 };

    /// 81.55 m for each factor of e; 1 - 0.9^2 = 0.19, ln 0.19 = -1.66073: 135.43 m of fall.
    #[test]
    fn val_hand_nine_tenths_of_the_terminal_speed() {
        let start_m = FALL.start_height_m(60.0, 36.0).unwrap();
        assert!((start_m - 195.93).abs() < 0.01, "{start_m}");
        assert!((FALL.speed_m_s(start_m, 60.0) - 36.0).abs() < 1e-9);
        assert_eq!(FALL.start_height_m(60.0, 40.0), None);
        // Without drag it would be 9.81 m/s after a second; 40 tanh(0.24525) = 9.6177.
        assert!((FALL.speed_after_m_s(1.0) - 9.6177).abs() < 1e-3);
    }
}
