//! Each limit of a touchdown with the value reached, as text for the screens and for the closing lines.

use protocol::dialect::TD_TOUCHDOWN_LIMITS_DATA;

use super::number::shortest;
use crate::model::touchdown::{LIMITS, Touchdown};

/// One limit and the value compared with it, in the units of the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitRow {
    pub name: &'static str,
    /// In degrees where it is an angle. Only the height and the sink rate have a sign.
    pub value: f64,
    /// The unit of value and limit.
    pub unit: &'static str,
    /// The limit as text; `--` until the vehicle has reported it.
    pub limit: String,
    /// Whether the vehicle says that the limit is kept.
    pub kept: bool,
}

/// The six limits in the order of the state. Limits and judgement are the vehicle's own.
pub fn limit_rows(touchdown: &Touchdown, limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> [LimitRow; 6] {
    let texts = limits.map(limit_texts);
    let values = [
        (touchdown.x_m.abs(), "m"),
        (touchdown.altitude_m, "m"),
        (touchdown.tilt_rad().to_degrees(), "deg"),
        (-touchdown.u_m_s, "m/s"),
        (touchdown.w_m_s.abs(), "m/s"),
        (touchdown.q_rad_s.abs().to_degrees(), "deg/s"),
    ];
    std::array::from_fn(|place| {
        let ((name, bit), (value, unit)) = (LIMITS[place], values[place]);
        LimitRow {
            name,
            value,
            unit,
            limit: texts.as_ref().map_or_else(|| "--".to_owned(), |texts| texts[place].clone()),
            kept: !touchdown.violated.contains(bit),
        }
    })
}

fn limit_texts(limits: &TD_TOUCHDOWN_LIMITS_DATA) -> [String; 6] {
    [
        either_side(f64::from(limits.x_m)),
        range(f64::from(limits.altitude_min_m), f64::from(limits.altitude_max_m)),
        either_side(f64::from(limits.pitch_error_rad).to_degrees()),
        either_side(f64::from(limits.u_m_s)),
        either_side(f64::from(limits.w_m_s)),
        either_side(f64::from(limits.q_rad_s).to_degrees()),
    ]
}

/// A limit to either side, as in `±0.4`.
fn either_side(limit: f64) -> String {
    format!("±{}", shortest(limit))
}

/// A range, as in `85..95`.
fn range(lowest: f64, highest: f64) -> String {
    format!("{}..{}", shortest(lowest), shortest(highest))
}

/// How many decimals a value gets, so that it takes five characters with its sign.
pub(super) fn decimals(value: f64) -> usize {
    match value.abs() {
        0.0..10.0 => 2,
        10.0..100.0 => 1,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::TdLimit;
    use std::f64::consts::FRAC_PI_2;

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
        limit_rows(&touchdown, limits).into_iter().map(|row| row.limit).collect()
    }

    #[test]
    fn limits_are_the_vehicles_own_and_unknown_before_it_reports_them() {
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
        assert_eq!(limit_words(Some(&limits)), ["±3", "-0.1..0.25", "±7.5", "±1.5", "±0.6", "±12"]);
    }
}
