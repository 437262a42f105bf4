//! Rows of the pages: what steers the burn, the limits of a touchdown, and the predicted position
//! of a lost vehicle.

use std::time::Duration;

use protocol::dialect::{TD_TOUCHDOWN_LIMITS_DATA, TdControlLevel, TdLanding, TdLimit};
use ratatui::text::Line;

use super::{TextRole, Theme, fixed, seconds, shortest};
use crate::model::dead_reckoning::{Basis, predict_position};
use crate::model::{Ending, LIMITS, Model, Sample, Touchdown, Verdict, words};

/// What steers the burn.
pub fn steered(level: TdControlLevel) -> (String, TextRole) {
    let role = match level {
        TdControlLevel::TD_CONTROL_LEVEL_CONVERGED => TextRole::Good,
        TdControlLevel::TD_CONTROL_LEVEL_BEST_FEASIBLE | TdControlLevel::TD_CONTROL_LEVEL_SHIFTED_PLAN => {
            TextRole::Caution
        }
        TdControlLevel::TD_CONTROL_LEVEL_STABILISER => TextRole::Alarm,
        _ => TextRole::Plain,
    };
    (words::steered(&words::without_prefix(&level, "TD_CONTROL_LEVEL_")), role)
}

/// How the flight ended.
pub fn ending_role(model: &Model, now: Duration) -> Option<(Ending, TextRole)> {
    let ending = Ending::of(&model.vehicle, now)?;
    let inside = |verdict: Sample<Verdict>| verdict.value.landing.contains(TdLanding::TD_LANDING_ENVELOPE);
    let role = match ending {
        Ending::Stands if model.vehicle.verdict().is_some_and(inside) => TextRole::Good,
        Ending::Stands | Ending::UnderParachute => TextRole::Caution,
        Ending::Upright | Ending::Hard | Ending::Lost => TextRole::Alarm,
    };
    Some((ending, role))
}

// Each limit of a touchdown with the value reached, as text for the screens and for the closing
// lines.

/// One limit and the value compared with it, in the units of the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitRow {
    pub name: &'static str,
    /// In degrees where it is an angle. Only the height and the sink rate have a sign.
    pub value: f64,
    /// The unit of value and limit.
    pub unit: &'static str,
    /// The limit with its unit; `--` until the vehicle has reported it, empty where there is none.
    pub limit: String,
    /// How much of the limit is used: 0 for a perfect landing, 1 at the limit; NaN without one.
    pub used: f64,
    /// Whether the limit is met, as the vehicle reports it.
    pub is_met: bool,
    /// The limit of the landing paper's Table 2, in the same unit. The vehicle judges speed and
    /// rotation along its axis; `value` is over the ground, so near the limit the two may differ.
    pub table_2: f64,
}

/// Limits of the landing paper's Table 2, m, m, m/s, m/s, deg, deg/s. No message carries them.
const TABLE_2: [f64; 6] = [20.0, 0.2, 0.4, 0.1, 5.0, 2.0];

/// A touchdown against the fence and the design envelope of the legs, as the vehicle limits and
/// judges it; under a parachute against the fence alone.
pub fn limit_rows(
    at: &Touchdown,
    limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>,
    under_parachute: bool,
) -> [LimitRow; 6] {
    let reported = |pick: fn(&TD_TOUCHDOWN_LIMITS_DATA) -> f32| {
        limits.map_or(f64::NAN, |limits| f64::from(pick(limits)))
    };
    let degrees = f64::to_degrees;
    let rows = [
        (at.distance_m, reported(|l| l.fence_m), "m"),
        (at.height_m, f64::NAN, "m"),
        (-at.vertical_m_s, reported(|l| l.vertical_m_s), "m/s"),
        (at.lateral_m_s, reported(|l| l.lateral_m_s), "m/s"),
        (degrees(at.tilt_rad), degrees(reported(|l| l.tilt_rad)), "deg"),
        (degrees(at.rate_rad_s), degrees(reported(|l| l.rate_rad_s)), "deg/s"),
    ];
    std::array::from_fn(|place| {
        let ((name, bit), (value, most, unit)) = (LIMITS[place], rows[place]);
        let limit = match bit {
            TdLimit::TD_LIMIT_HEIGHT => String::new(),
            TdLimit::TD_LIMIT_DISTANCE if most.is_nan() || most <= 0.0 => String::new(),
            _ if limits.is_none() => format!("-- {unit}"),
            _ => format!("±{} {unit}", shortest(most)),
        };
        if under_parachute && bit != TdLimit::TD_LIMIT_DISTANCE {
            let name = if bit == TdLimit::TD_LIMIT_VERTICAL_SPEED { "descent" } else { name };
            let (limit, used, table_2) = (String::new(), f64::NAN, f64::INFINITY);
            return LimitRow { name, value, unit, limit, used, is_met: true, table_2 };
        }
        let beyond_fence = bit == TdLimit::TD_LIMIT_DISTANCE && most > 0.0 && value > most;
        let is_met = !at.violated.contains(bit) && !beyond_fence;
        LimitRow { name, value, unit, limit, used: value.abs() / most, is_met, table_2: TABLE_2[place] }
    })
}

/// How many decimals a value gets, so that it takes five characters with its sign.
pub(super) fn decimals(value: f64) -> usize {
    match value.abs() {
        0.0..10.0 => 2,
        10.0..100.0 => 1,
        _ => 0,
    }
}

// The panel of the predicted position after the link is lost in flight.

/// The rows of the prediction.
pub fn lost_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let Some(at) = predict_position(&model.vehicle, now) else {
        return vec![
            theme.line(" position unknown:", TextRole::Alarm),
            theme.line(" no data since the pad", TextRole::Caution),
        ];
    };
    let row = |label: &str, value: f64| {
        let words = theme.either_side(&format!("{:>6} ±{} m", fixed(value, 0), fixed(at.spot.error_m, 0)));
        Line::from_iter([theme.label(format!(" {label:<6}pred")), theme.span(words, TextRole::Stale)])
    };
    let source = match at.basis {
        Basis::Plan => "along the last plan",
        Basis::LastThrust => "last acceleration",
        Basis::FallThenBurn => "fall, then the burn",
        Basis::Fall => "fall, last drag",
        Basis::FreeFall => "free fall; no plan",
    };
    // The error is that of the position over the ground.
    let height = format!("{:>6} m", fixed(at.altitude_m, 0));
    vec![
        Line::from_iter([theme.label(format!(" {:<6}pred", "alt")), theme.span(height, TextRole::Stale)]),
        row("north", at.spot.north_m),
        row("east", at.spot.east_m),
        theme.line(format!(" {source}"), TextRole::Label),
        theme.line(format!(" last data {} ago", seconds(at.age)), TextRole::Caution),
    ]
}

#[cfg(test)]
mod limit_rows_tests {
    use super::*;

    const LIMITS: TD_TOUCHDOWN_LIMITS_DATA = TD_TOUCHDOWN_LIMITS_DATA {
        boot_number: 0,
        vertical_m_s: 1.5,
        lateral_m_s: 0.6,
        tilt_rad: 7.5_f32.to_radians(),
        rate_rad_s: 12_f32.to_radians(),
        fence_m: 120.0,
        gimbal_limit_rad: 0.1,
    };

    /// So much of every limit, sinking.
    fn at(share: f64) -> Touchdown {
        Touchdown {
            distance_m: 3.0,
            height_m: 0.0,
            vertical_m_s: -1.5 * share,
            lateral_m_s: 0.6 * share,
            tilt_rad: share * 7.5_f64.to_radians(),
            rate_rad_s: share * 12_f64.to_radians(),
            violated: TdLimit::empty(),
        }
    }

    #[test]
    fn under_a_parachute_the_fence_alone_is_a_limit() {
        let mut hard = at(5.0);
        hard.violated = TdLimit::all();
        let met = |under_parachute| limit_rows(&hard, Some(&LIMITS), under_parachute).map(|row| row.is_met);
        assert_eq!(met(false), [false; 6]);
        assert_eq!(met(true), [false, true, true, true, true, true]);
        assert_eq!(limit_rows(&hard, Some(&LIMITS), true)[2].name, "descent");
    }

    #[test]
    fn limits_come_from_the_vehicle_and_are_blank_before_its_report() {
        let words = |limits| limit_rows(&at(0.0), limits, false).map(|row| row.limit);
        assert_eq!(words(None), ["", "", "-- m/s", "-- m/s", "-- deg", "-- deg/s"]);
        assert_eq!(words(Some(&LIMITS)), ["±120 m", "", "±1.5 m/s", "±0.6 m/s", "±7.5 deg", "±12 deg/s"]);
    }

    #[test]
    fn table_2_has_the_limits_by_which_the_vehicle_judges() {
        use flight::rules::verdict::TABLE_2 as OF_THE_VEHICLE;
        let flight::rules::verdict::Touchdown { distance_m, height_m, vertical_m_s, .. } = OF_THE_VEHICLE;
        let flight::rules::verdict::Touchdown { lateral_m_s, tilt_rad, rate_rad_s, .. } = OF_THE_VEHICLE;
        let [tilt_deg, rate_deg_s] = [tilt_rad, rate_rad_s].map(f64::to_degrees);
        let expected = [distance_m, height_m, vertical_m_s, lateral_m_s, tilt_deg, rate_deg_s];
        for (row, expected) in limit_rows(&at(0.0), None, false).iter().zip(expected) {
            assert!((row.table_2 - expected).abs() < 1e-9, "{}: {} {expected}", row.name, row.table_2);
        }
    }

    #[test]
    fn every_limit_is_used_from_a_perfect_landing_to_its_edge() {
        for share in [0.0, 1.0, 2.0] {
            let used = limit_rows(&at(share), Some(&LIMITS), false).map(|row| row.used);
            assert!((used[0] - 3.0 / 120.0).abs() < 1e-9, "of the fence");
            assert!(used[1].is_nan(), "it has no limit");
            assert!(used[2..].iter().all(|used| (used - share).abs() < 1e-6), "{used:?}");
        }
    }
}
