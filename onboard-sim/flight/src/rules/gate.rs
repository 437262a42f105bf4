//! The checks before the landing motor is lit.
//!
//! They use measured and predicted values of this moment. The latches (armed, not inhibited, no abort) are in the
//! [phase table](crate::rules::phase). Loss of the radio link neither fires nor blocks the motor, so it is not checked
//! here.

use alloc::borrow::ToOwned as _;

use alloc::format;
use alloc::vec;
use alloc::vec::Vec;

pub use crate::rules::arming::{Check, all_passed, first_refusal};
use crate::vehicle::mission::GateLimits;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateInput {
    /// Tilt of the nose from the vertical, rad; tail-first descent is near 0.
    pub tilt_rad: f64,
    /// Vertical speed, m/s, up positive.
    pub vertical_speed_m_s: f64,
    pub pitch_rate_rad_s: f64,
    pub speed_m_s: f64,
    /// Speed predicted for this moment, m/s.
    pub predicted_speed_m_s: f64,
    /// Disagreement of the two height sources, m.
    pub height_disagreement_m: f64,
    /// The height at the onset of thrust is inside the feasible band.
    pub landing_feasible: bool,
    /// Horizontal distance of the predicted touchdown from the pad, m.
    pub predicted_touchdown_x_m: f64,
    /// All fins have reached their deployed angle.
    pub fins_confirmed: bool,
    pub parachute_stowed: bool,
    /// The igniter has continuity.
    pub igniter_continuity: bool,
    pub estimator_healthy: bool,
}

/// Every gate check, with the value found.
pub fn gate_checks(limits: &GateLimits, input: &GateInput) -> Vec<Check> {
    let speed_error_percent =
        100.0 * (input.speed_m_s - input.predicted_speed_m_s).abs() / input.predicted_speed_m_s.abs();
    vec![
        Check {
            name: "descending",
            passed: input.vertical_speed_m_s < 0.0,
            found: format!("{:.2} m/s", input.vertical_speed_m_s),
            required: "below 0 m/s".to_owned(),
        },
        Check::at_most("tilt from vertical", input.tilt_rad.to_degrees(), limits.tilt_max_deg, "deg"),
        Check::at_most(
            "pitch rate",
            input.pitch_rate_rad_s.to_degrees(),
            limits.pitch_rate_max_deg_s,
            "deg/s",
        ),
        Check::at_most("speed error", speed_error_percent, 100.0 * limits.speed_error_max_fraction, "%"),
        Check::at_most(
            "height disagreement",
            input.height_disagreement_m,
            limits.height_disagreement_max_m,
            "m",
        ),
        Check::condition(
            "landing plan",
            input.landing_feasible,
            "feasible from here",
            "not feasible from here",
        ),
        Check::at_most("predicted touchdown", input.predicted_touchdown_x_m, limits.fence_radius_m, "m"),
        Check::condition("fins", input.fins_confirmed, "confirmed", "not confirmed"),
        Check::condition("parachute", input.parachute_stowed, "stowed", "not stowed"),
        Check::condition("igniter continuity", input.igniter_continuity, "closed circuit", "open circuit"),
        Check::condition("estimator", input.estimator_healthy, "healthy", "not healthy"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> GateInput {
        GateInput {
            tilt_rad: 0.0,
            vertical_speed_m_s: -5.0,
            pitch_rate_rad_s: 0.0,
            speed_m_s: 5.0,
            predicted_speed_m_s: 5.0,
            height_disagreement_m: 0.5,
            landing_feasible: true,
            predicted_touchdown_x_m: 0.3,
            fins_confirmed: true,
            parachute_stowed: true,
            igniter_continuity: true,
            estimator_healthy: true,
        }
    }

    fn refusal_of(spoil: impl FnOnce(&mut GateInput)) -> Option<String> {
        let limits = crate::vehicles::mission::builtin("mk2").unwrap().unwrap().gate;
        let mut input = good();
        spoil(&mut input);
        first_refusal(&gate_checks(&limits, &input))
    }

    #[test]
    fn the_nominal_start_opens_the_gate() {
        assert_eq!(refusal_of(|_| {}), None);
    }

    /// A wrong input, and the check that must close the gate.
    type Spoiling = (&'static str, fn(&mut GateInput));

    #[test]
    fn each_check_closes_the_gate_alone() {
        let spoilings: [Spoiling; 12] = [
            ("descending", |input| {
                input.vertical_speed_m_s = 0.0;
            }),
            ("tilt from vertical", |input| {
                input.tilt_rad = -0.36;
            }),
            ("pitch rate", |input| {
                input.pitch_rate_rad_s = 1.1;
            }),
            ("speed error", |input| {
                input.speed_m_s = 5.8;
            }),
            ("speed error", |input| {
                input.predicted_speed_m_s = 0.0;
            }),
            ("height disagreement", |input| {
                input.height_disagreement_m = f64::NAN;
            }),
            ("landing plan", |input| {
                input.landing_feasible = false;
            }),
            ("predicted touchdown", |input| {
                input.predicted_touchdown_x_m = -121.0;
            }),
            ("fins", |input| {
                input.fins_confirmed = false;
            }),
            ("parachute", |input| {
                input.parachute_stowed = false;
            }),
            ("igniter continuity", |input| {
                input.igniter_continuity = false;
            }),
            ("estimator", |input| {
                input.estimator_healthy = false;
            }),
        ];
        for (name, spoil) in spoilings {
            let refusal = refusal_of(spoil).unwrap();
            assert!(refusal.starts_with(name), "{refusal}");
        }
    }
}
