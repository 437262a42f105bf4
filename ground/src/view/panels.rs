//! The panels of the pages: flight, controller, actuators, touchdown, and the predicted position of a lost vehicle.

use std::time::Duration;

use protocol::dialect::{
    TD_CONTROLLER_DATA, TD_TOUCHDOWN_LIMITS_DATA, TdControlLevel, TdLanding, TdLimit, TdSolverStatus,
};
use ratatui::text::Line;

use super::{TextRole, Theme, age_mark, fixed, row, seconds, shortest};
use crate::model::{
    BodySpeed, Deflection, Ending, Gimbal, LIMITS, Model, Motion, Sample, Touchdown, Verdict,
    dead_reckoning::{Basis, is_unheard, predict_position},
    words,
};

/// Title and rows: altitude, speeds and attitude; after the loss of the link the predicted position.
pub fn flight_panel(model: &Model, theme: Theme, now: Duration) -> (&'static str, Vec<Line<'static>>) {
    if is_lost(model, now) {
        return ("PREDICTED, not heard", lost_rows(model, theme, now));
    }
    ("Flight", flight_rows(model, theme, now))
}

/// Altitude, speeds and attitude.
pub fn flight_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let vehicle = &model.vehicle;
    let of_body = |pick: fn(&BodySpeed) -> f64| vehicle.body_speed().map(|known| known.map(pick));
    let line = |label, value, decimals, unit| row(theme, label, value, decimals, unit, now);
    vec![
        line("altitude", vehicle.of_motion(|m| m.altitude_m), 2, "m"),
        line("vertical", vehicle.of_motion(|m| m.climb_m_s), 2, "m/s"),
        line("horizontal", vehicle.of_motion(Motion::horizontal_m_s), 2, "m/s"),
        line("distance", vehicle.of_motion(Motion::distance_m), 1, "m"),
        line("along axis", of_body(|b| b.u_m_s), 2, "m/s"),
        line("across", of_body(BodySpeed::lateral_m_s), 3, "m/s"),
        line("tilt", vehicle.tilt_deg(), 2, "deg"),
        line("turn rate", vehicle.of_attitude(|a| a.turn_rate_rad_s().to_degrees()), 2, "deg/s"),
    ]
}

// The panel of the landing controller (NMPC).

/// The panel's rows.
pub fn controller_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let told = model.vehicle.last::<TD_CONTROLLER_DATA>();
    let controller = told.as_ref();
    let number = |value: Option<f64>| {
        value
            .zip(controller.map(|controller| controller.received_at))
            .map(|(value, received_at)| Sample { value, received_at })
    };
    let data = controller.map(|controller| &controller.value);
    let (mark, age_role) = controller.map_or((" ", TextRole::Label), |controller| age_mark(controller, now));
    let wide_text = |label: &str, text: String, role: TextRole| {
        let role = if age_role == TextRole::Stale { age_role } else { role };
        Line::from(vec![
            theme.label(format!(" {label:<6}")),
            theme.span(format!("{mark}{text:>17.17}"), role),
        ])
    };
    let level = data.map_or_else(|| "--".to_owned(), |d| steered(d.level));
    let status =
        data.map_or_else(|| "--".to_owned(), |d| words::lower_case(&d.solver_status, "TD_SOLVER_STATUS_"));
    let missed = data.is_some_and(|d| d.deadline_margin_us < 0);
    let margin = number(data.map(|d| f64::from(d.deadline_margin_us) / 1_000.0));
    vec![
        wide_text("burn", level, data.map_or(TextRole::Label, |d| level_role(d.level))),
        wide_text("solver", status, data.map_or(TextRole::Label, |d| status_role(d.solver_status))),
        row(theme, "iterations", number(data.map(|d| f64::from(d.iterations))), 0, "", now),
        row(theme, "solve time", number(data.map(|d| f64::from(d.solve_time_us) / 1_000.0)), 2, "ms", now),
        row(theme, if missed { "MISSED BY" } else { "margin" }, margin, 2, "ms", now),
        row(theme, "thrust", model.vehicle.of_descent(|d| d.thrust_scale), 3, "x", now),
    ]
}

/// What steers the burn, in words.
fn steered(level: TdControlLevel) -> String {
    match level {
        TdControlLevel::TD_CONTROL_LEVEL_CONVERGED => "on its plan".to_owned(),
        TdControlLevel::TD_CONTROL_LEVEL_BEST_FEASIBLE => "near its plan".to_owned(),
        TdControlLevel::TD_CONTROL_LEVEL_SHIFTED_PLAN => "on its last plan".to_owned(),
        TdControlLevel::TD_CONTROL_LEVEL_STABILISER => "UPRIGHT, NO PLAN".to_owned(),
        other => words::lower_case(&other, "TD_CONTROL_LEVEL_"),
    }
}

fn level_role(level: TdControlLevel) -> TextRole {
    match level {
        TdControlLevel::TD_CONTROL_LEVEL_CONVERGED => TextRole::Good,
        TdControlLevel::TD_CONTROL_LEVEL_BEST_FEASIBLE | TdControlLevel::TD_CONTROL_LEVEL_SHIFTED_PLAN => {
            TextRole::Caution
        }
        TdControlLevel::TD_CONTROL_LEVEL_STABILISER => TextRole::Alarm,
        _ => TextRole::Plain,
    }
}

fn status_role(status: TdSolverStatus) -> TextRole {
    match status {
        TdSolverStatus::TD_SOLVER_STATUS_CONVERGED => TextRole::Good,
        TdSolverStatus::TD_SOLVER_STATUS_NOT_RUN => TextRole::Plain,
        _ => TextRole::Caution,
    }
}

// The panels of fins and gimbal: commanded and measured angles.

/// One row for each of the four fins.
pub fn fin_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let fin = |k: usize| model.vehicle.fins().map(|fins| fins.map(|fins| fins[k]));
    (0..4).map(|k| deflection(&format!(" fin {} ", k + 1), fin(k), " deg", theme, now)).collect()
}

/// A row for each of the gimbal's two planes, with its stop.
pub fn gimbal_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let limit = model.vehicle.limits().map(|limits| f64::from(limits.gimbal_limit_rad).to_degrees());
    let limit = limit.filter(|limit| limit.is_finite() && *limit > 0.0);
    let stop = limit.map_or_else(String::new, |limit| theme.either_side(&format!(" ±{}", shortest(limit))));
    let plane = |name: &str, pick: fn(&Gimbal) -> Deflection| {
        let angle = model.vehicle.gimbal().map(|gimbal| gimbal.map(pick));
        deflection(name, angle, &format!("{stop}°"), theme, now)
    };
    vec![plane(" pitch", |g| g.pitch), plane(" yaw  ", |g| g.yaw)]
}

/// An angle as commanded and as measured.
fn deflection(
    name: &str,
    angle: Option<Sample<Deflection>>,
    unit: &str,
    theme: Theme,
    now: Duration,
) -> Line<'static> {
    let (mark, role) = angle.map_or((" ", TextRole::Label), |angle| age_mark(&angle, now));
    let degrees = |pick: fn(&Deflection) -> f64| {
        angle.map_or_else(|| "--".to_owned(), |angle| fixed(pick(&angle.value).to_degrees(), 1))
    };
    let (commanded, measured) = (degrees(|d| d.commanded_rad), degrees(|d| d.measured_rad));
    Line::from(vec![
        theme.label(name.to_owned()),
        theme.span(format!("{mark}{commanded:>6} | {measured:>5}"), role),
        theme.label(unit.to_owned()),
    ])
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

// Each limit of a touchdown with the value reached, as text for the screens and for the closing lines.

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
    /// Whether the vehicle says that the limit is kept.
    pub kept: bool,
}

/// A touchdown and the design envelope of the legs. Limits and judgement are the vehicle's own.
pub fn limit_rows(at: &Touchdown, limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> [LimitRow; 6] {
    let told = |pick: fn(&TD_TOUCHDOWN_LIMITS_DATA) -> f32| {
        limits.map_or(f64::NAN, |limits| f64::from(pick(limits)))
    };
    let degrees = f64::to_degrees;
    let rows = [
        (at.distance_m, f64::NAN, "m"),
        (at.height_m, f64::NAN, "m"),
        (-at.vertical_m_s, told(|l| l.vertical_m_s), "m/s"),
        (at.lateral_m_s, told(|l| l.lateral_m_s), "m/s"),
        (degrees(at.tilt_rad), degrees(told(|l| l.tilt_rad)), "deg"),
        (degrees(at.rate_rad_s), degrees(told(|l| l.rate_rad_s)), "deg/s"),
    ];
    std::array::from_fn(|place| {
        let ((name, bit), (value, most, unit)) = (LIMITS[place], rows[place]);
        let limit = match bit {
            TdLimit::TD_LIMIT_DISTANCE | TdLimit::TD_LIMIT_HEIGHT => String::new(),
            _ if limits.is_none() => format!("-- {unit}"),
            _ => format!("±{} {unit}", shortest(most)),
        };
        LimitRow { name, value, unit, limit, used: value.abs() / most, kept: !at.violated.contains(bit) }
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

/// Whether the position of a vehicle in flight is stale.
pub fn is_lost(model: &Model, now: Duration) -> bool {
    is_unheard(&model.vehicle, now)
}

/// The rows of the prediction; none while the vehicle is heard.
pub fn lost_rows(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    if !is_lost(model, now) {
        return Vec::new();
    }
    let Some(at) = predict_position(&model.vehicle, now) else {
        return vec![
            theme.line(" position unknown:", TextRole::Alarm),
            theme.line(" not heard since the pad", TextRole::Caution),
        ];
    };
    let row = |label: &str, value: f64| {
        Line::from(vec![
            theme.label(format!(" {label:<6}pred")),
            theme.span(
                theme.either_side(&format!("{:>7} ±{} m", fixed(value, 1), fixed(at.error_m, 1))),
                TextRole::Stale,
            ),
        ])
    };
    let source = match at.basis {
        Basis::Plan => "along the last plan",
        Basis::LastThrust => "last acceleration",
        Basis::FallThenBurn => "fall, then the burn",
        Basis::Fall => "fall, last drag",
        Basis::FreeFall => "free fall; no plan",
    };
    vec![
        row("alt", at.altitude_m),
        row("north", at.x_m),
        row("east", at.y_m),
        theme.line(format!(" {source}"), TextRole::Label),
        theme.line(format!(" last heard {} ago", seconds(at.age)), TextRole::Caution),
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
    fn limits_are_the_vehicles_own_and_unknown_before_it_reports_them() {
        let words = |limits| limit_rows(&at(0.0), limits).map(|row| row.limit);
        assert_eq!(words(None), ["", "", "-- m/s", "-- m/s", "-- deg", "-- deg/s"]);
        assert_eq!(words(Some(&LIMITS)), ["", "", "±1.5 m/s", "±0.6 m/s", "±7.5 deg", "±12 deg/s"]);
    }

    #[test]
    fn every_limit_is_used_from_a_perfect_landing_to_its_edge() {
        for share in [0.0, 1.0, 2.0] {
            let used = limit_rows(&at(share), Some(&LIMITS)).map(|row| row.used);
            assert!(used[..2].iter().all(|used| used.is_nan()), "they have no limit");
            assert!(used[2..].iter().all(|used| (used - share).abs() < 1e-6), "{used:?}");
        }
    }
}
