//! The checks before the landing motor is lit.
//!
//! They use measured and predicted values of this moment. The latches (armed, not inhibited, no abort) are in the
//! [phase table](crate::rules::phase). Loss of the radio link neither fires nor blocks the motor, so it is not checked
//! here.

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

/// The first check that keeps the gate shut; `None` if it is open. A value that is not a number keeps it shut.
pub fn shut_by(limits: &GateLimits, input: &GateInput) -> Option<&'static str> {
    let within = |found: f64, most: f64| found.abs() <= most;
    let tilt_deg = input.tilt_rad.to_degrees();
    let pitch_rate_deg_s = input.pitch_rate_rad_s.to_degrees();
    let speed_error = (input.speed_m_s - input.predicted_speed_m_s) / input.predicted_speed_m_s;
    let checks = [
        ("descending", input.vertical_speed_m_s < 0.0),
        ("tilt from vertical", within(tilt_deg, limits.tilt_max_deg)),
        ("pitch rate", within(pitch_rate_deg_s, limits.pitch_rate_max_deg_s)),
        ("speed error", within(speed_error, limits.speed_error_max_fraction)),
        ("height disagreement", within(input.height_disagreement_m, limits.height_disagreement_max_m)),
        ("landing plan", input.landing_feasible),
        ("predicted touchdown", within(input.predicted_touchdown_x_m, limits.fence_radius_m)),
        ("fins", input.fins_confirmed),
        ("parachute", input.parachute_stowed),
        ("igniter continuity", input.igniter_continuity),
        ("estimator", input.estimator_healthy),
    ];
    checks.iter().find(|(_, passed)| !passed).map(|(name, _)| *name)
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

    fn shut_after(spoil: impl FnOnce(&mut GateInput)) -> Option<&'static str> {
        let limits = crate::vehicles::mission::builtin("mk2").unwrap().unwrap().gate;
        let mut input = good();
        spoil(&mut input);
        shut_by(&limits, &input)
    }

    #[test]
    fn the_nominal_start_opens_the_gate() {
        assert_eq!(shut_after(|_| {}), None);
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
            assert_eq!(shut_after(spoil), Some(name));
        }
    }
}
