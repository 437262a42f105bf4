//! The touchdown and its limits as they are shown. Both the limits and the judgement are the vehicle's.

use std::f64::consts::FRAC_PI_2;

use protocol::dialect::{TD_TOUCHDOWN_LIMITS_DATA, TdLimit};

use crate::view::number::shortest;

/// A state at touchdown, predicted or reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touchdown {
    /// Horizontal position, m.
    pub x_m: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Pitch from the horizontal, rad; pi/2 is upright.
    pub pitch_rad: f64,
    /// Axial speed, towards the nose, m/s.
    pub u_m_s: f64,
    /// Lateral speed, m/s.
    pub w_m_s: f64,
    /// Pitch rate, rad/s.
    pub q_rad_s: f64,
    /// The limits that the vehicle found violated.
    pub violated: TdLimit,
}

/// One limit and the value held against it, in the units of the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitRow {
    /// Short name.
    pub name: &'static str,
    /// The value, in degrees where it is an angle.
    pub value: f64,
    /// Unit of value and limit.
    pub unit: &'static str,
    /// The limit, for reading; `--` until the vehicle has said it.
    pub limit: String,
    /// What the vehicle says of it.
    pub kept: bool,
}

impl Touchdown {
    /// Every limit, in state order.
    pub fn rows(&self, limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> [LimitRow; 6] {
        let row = |name, value, unit, bit, words: fn(&TD_TOUCHDOWN_LIMITS_DATA) -> String| LimitRow {
            name,
            value,
            unit,
            limit: limits.map_or_else(|| "--".to_owned(), words),
            kept: !self.violated.contains(bit),
        };
        [
            row("x", self.x_m, "m", TdLimit::TD_LIMIT_X, |l| either_side(f64::from(l.x_m))),
            row("alt", self.altitude_m, "m", TdLimit::TD_LIMIT_ALTITUDE, |l| {
                let (lowest, highest) = (f64::from(l.altitude_min_m), f64::from(l.altitude_max_m));
                format!("{}..{}", shortest(lowest), shortest(highest))
            }),
            row("pitch", self.pitch_rad.to_degrees(), "deg", TdLimit::TD_LIMIT_PITCH, |l| {
                let (upright, error) = (FRAC_PI_2.to_degrees(), f64::from(l.pitch_error_rad).to_degrees());
                format!("{}..{}", shortest(upright - error), shortest(upright + error))
            }),
            row("u", self.u_m_s, "m/s", TdLimit::TD_LIMIT_AXIAL_SPEED, |l| either_side(f64::from(l.u_m_s))),
            row("w", self.w_m_s, "m/s", TdLimit::TD_LIMIT_LATERAL_SPEED, |l| either_side(f64::from(l.w_m_s))),
            row("q", self.q_rad_s.to_degrees(), "deg/s", TdLimit::TD_LIMIT_PITCH_RATE, |l| {
                either_side(f64::from(l.q_rad_s).to_degrees())
            }),
        ]
    }

    /// The names of the limits not kept, or `None` if all are.
    pub fn violations(&self) -> Option<String> {
        let rows = self.rows(None);
        let names: Vec<&str> = rows.iter().filter(|row| !row.kept).map(|row| row.name).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

fn either_side(limit: f64) -> String {
    format!("±{}", shortest(limit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit_words(limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> Vec<String> {
        let touchdown = Touchdown {
            x_m: 0.0,
            altitude_m: 0.0,
            pitch_rad: FRAC_PI_2,
            u_m_s: 0.0,
            w_m_s: 0.0,
            q_rad_s: 0.0,
            violated: TdLimit::empty(),
        };
        touchdown.rows(limits).into_iter().map(|row| row.limit).collect()
    }

    #[test]
    fn limits_are_the_vehicles_own_and_unknown_before_it_has_said_them() {
        assert_eq!(limit_words(None), ["--"; 6]);
        let limits = TD_TOUCHDOWN_LIMITS_DATA {
            x_m: 3.0,
            altitude_min_m: -0.1,
            altitude_max_m: 0.25,
            pitch_error_rad: 7.5_f32.to_radians(),
            u_m_s: 1.5,
            w_m_s: 0.6,
            q_rad_s: 12.0_f32.to_radians(),
            gimbal_limit_rad: 0.1,
        };
        assert_eq!(limit_words(Some(&limits)), ["±3", "-0.1..0.25", "82.5..97.5", "±1.5", "±0.6", "±12"]);
    }
}
