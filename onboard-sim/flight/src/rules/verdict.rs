//! Judges a landing by the touchdown limits (Table 2 of the landing paper).

use alloc::borrow::ToOwned as _;

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use core::f64::consts::FRAC_PI_2;

use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::mission::{Mission, TouchdownBox};

/// What counts as a landing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchdownLimits {
    /// Largest horizontal distance, m.
    pub x_m: f64,
    /// Lowest altitude, m.
    pub altitude_min_m: f64,
    /// Highest altitude, m.
    pub altitude_max_m: f64,
    /// Largest pitch error from upright, rad.
    pub pitch_error_rad: f64,
    /// Largest axial speed, m/s.
    pub u_m_s: f64,
    /// Largest lateral speed, m/s.
    pub w_m_s: f64,
    /// Largest pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
}

impl TouchdownLimits {
    /// The limits of a mission's legs, anywhere inside its fence.
    pub fn of_the_legs(mission: &Mission) -> Self {
        let legs = &mission.leg_limits;
        Self {
            x_m: mission.gate.fence_radius_m,
            pitch_error_rad: legs.tilt_deg.to_radians(),
            u_m_s: legs.vertical_m_s,
            w_m_s: legs.lateral_m_s,
            pitch_rate_rad_s: legs.rate_deg_s.to_radians(),
            ..Self::from(&mission.touchdown_limits)
        }
    }
}

impl From<&TouchdownBox> for TouchdownLimits {
    fn from(limits: &TouchdownBox) -> Self {
        Self {
            x_m: limits.x_m,
            altitude_min_m: limits.altitude_min_m,
            altitude_max_m: limits.altitude_max_m,
            pitch_error_rad: limits.pitch_error_deg.to_radians(),
            u_m_s: limits.u_m_s,
            w_m_s: limits.w_m_s,
            pitch_rate_rad_s: limits.pitch_rate_deg_s.to_radians(),
        }
    }
}

/// How far below the ground a plan may end and still count as ending on it, m.
pub const PLAN_HEIGHT_TOLERANCE_M: f64 = 1e-3;

/// One limit and the value that was compared with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitResult {
    /// The name of the quantity.
    pub name: &'static str,
    /// The value, in [`unit`](Self::unit).
    pub value: f64,
    /// The lowest value allowed.
    pub lowest: f64,
    /// The highest value allowed.
    pub highest: f64,
    /// The unit of the three; angles are in degrees, for people.
    pub unit: &'static str,
    /// Whether the value lies inside; a value that is not a number does not.
    pub passed: bool,
}

/// Every touchdown limit, judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandingVerdict {
    /// The limits in state order: x, altitude, pitch, u, w, pitch rate.
    pub results: [LimitResult; 6],
}

impl LandingVerdict {
    /// Judges a state at touchdown.
    pub fn judge(limits: &TouchdownLimits, state: &PlanarState) -> Self {
        let judged = |name, value: f64, lowest: f64, highest: f64, unit| LimitResult {
            name,
            value,
            lowest,
            highest,
            unit,
            passed: (lowest..=highest).contains(&value),
        };
        let within = |name, value, limit: f64, unit| judged(name, value, -limit, limit, unit);
        let pitch_error_deg = (state.theta_rad - FRAC_PI_2).to_degrees();
        Self {
            results: [
                within("x", state.x_m, limits.x_m, "m"),
                judged("altitude", state.z_m, limits.altitude_min_m, limits.altitude_max_m, "m"),
                within("pitch error", pitch_error_deg, limits.pitch_error_rad.to_degrees(), "deg"),
                within("u", state.u_m_s, limits.u_m_s, "m/s"),
                within("w", state.w_m_s, limits.w_m_s, "m/s"),
                within(
                    "pitch rate",
                    state.q_rad_s.to_degrees(),
                    limits.pitch_rate_rad_s.to_degrees(),
                    "deg/s",
                ),
            ],
        }
    }

    /// Judges the end of a plan. A plan meets the ground only within its solver's tolerance, so a height within
    /// [`PLAN_HEIGHT_TOLERANCE_M`] below the lowest limit counts as that limit.
    pub fn judge_plan(limits: &TouchdownLimits, end: &PlanarState) -> Self {
        let lowest_m = limits.altitude_min_m;
        let on_ground = (lowest_m - PLAN_HEIGHT_TOLERANCE_M..lowest_m).contains(&end.z_m);
        let z_m = if on_ground { lowest_m } else { end.z_m };
        Self::judge(limits, &PlanarState { z_m, ..*end })
    }

    /// Whether every limit was kept.
    pub fn landed(&self) -> bool {
        self.results.iter().all(|result| result.passed)
    }

    /// The limits that were not kept.
    pub fn failures(&self) -> impl Iterator<Item = &LimitResult> {
        self.results.iter().filter(|result| !result.passed)
    }

    /// One line: "inside every limit", or the broken limits with their values.
    pub fn summary(&self) -> String {
        let broken: Vec<String> = self
            .failures()
            .map(|result| {
                format!(
                    "{} {:.3} {} (limit {:.3} to {:.3})",
                    result.name, result.value, result.unit, result.lowest, result.highest
                )
            })
            .collect();
        if broken.is_empty() { "inside every limit".to_owned() } else { broken.join(", ") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> TouchdownLimits {
        TouchdownLimits::from(&crate::vehicles::mission::builtin("mk2").unwrap().unwrap().touchdown_limits)
    }

    fn upright() -> PlanarState {
        PlanarState { theta_rad: FRAC_PI_2, ..PlanarState::default() }
    }

    /// Tables 3 to 6 of the landing paper under its own Table 2: 3 of the 7 distinct start states land.
    #[test]
    fn val_landing_paper_tables_4_to_6_judged_by_table_2() {
        // (x m, theta deg, u m/s, w m/s, q deg/s), z is zero in all.
        let rows = [
            ("nominal", -0.27, 87.28, 0.11, 0.040, 0.80, true),
            ("theta0 = 60", -8.02, 90.47, -0.29, 0.011, 1.03, true),
            ("theta0 = 120", 0.41, 89.65, 0.019, 0.0020, -0.039, true),
            ("w0 = -1", -6.84, 88.18, 0.48, 0.010, 1.69, false),
            ("w0 = +1", 6.35, 91.50, 0.46, 0.0039, -1.86, false),
            ("q0 = -5", -18.08, 93.96, -1.00, 0.083, -0.41, false),
            ("q0 = +5", 19.85, 82.50, -0.99, -0.069, 1.77, false),
        ];
        for (name, x_m, theta_deg, u_m_s, w_m_s, q_deg_s, lands) in rows {
            let state = PlanarState {
                x_m,
                z_m: 0.0,
                theta_rad: f64::to_radians(theta_deg),
                u_m_s,
                w_m_s,
                q_rad_s: f64::to_radians(q_deg_s),
            };
            let verdict = LandingVerdict::judge(&limits(), &state);
            assert_eq!(verdict.landed(), lands, "{name}: {}", verdict.summary());
        }
    }

    #[test]
    fn a_plan_may_end_slightly_below_the_ground_and_a_landing_may_not() {
        let end = |z_m| PlanarState { z_m, ..upright() };
        assert!(LandingVerdict::judge_plan(&limits(), &end(-1e-12)).landed());
        assert!(!LandingVerdict::judge_plan(&limits(), &end(-0.002)).landed());
        assert!(!LandingVerdict::judge_plan(&limits(), &end(f64::NAN)).landed());
        assert!(!LandingVerdict::judge(&limits(), &end(-1e-12)).landed());
    }

    #[test]
    fn each_limit_can_fail_alone() {
        let states = [
            ("x", PlanarState { x_m: -20.1, ..upright() }),
            ("altitude", PlanarState { z_m: 0.21, ..upright() }),
            ("altitude", PlanarState { z_m: -0.006, ..upright() }),
            ("pitch error", PlanarState { theta_rad: FRAC_PI_2 - 0.1, ..upright() }),
            ("u", PlanarState { u_m_s: -0.41, ..upright() }),
            ("w", PlanarState { w_m_s: 0.11, ..upright() }),
            ("pitch rate", PlanarState { q_rad_s: 0.036, ..upright() }),
            ("u", PlanarState { u_m_s: f64::NAN, ..upright() }),
        ];
        assert!(LandingVerdict::judge(&limits(), &upright()).landed());
        for (name, state) in states {
            let verdict = LandingVerdict::judge(&limits(), &state);
            let failed: Vec<_> = verdict.failures().map(|result| result.name).collect();
            assert_eq!(failed, [name]);
        }
    }
}
