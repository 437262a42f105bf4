//! The checks before ignition of the landing motor.
//!
//! They use measured and predicted values of this moment. The latches (armed, not inhibited, no
//! abort) are in the [phase table](crate::rules::phase). Loss of the radio link neither fires nor
//! blocks the motor, so it is not checked here.
//!
//! One list serves three uses: which checks inhibit ignition now, which ones abandon the landing
//! because they will not recover, and what is reported to the crew about both.

use crate::text::{Text, text};
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
    /// The certified motor lands from here or from lower.
    pub lands_ahead: bool,
    /// Horizontal distance of the predicted touchdown under the motor from the pad, m.
    pub touchdown_distance_m: f64,
    /// All fins have reached their deployed angle.
    pub fins_confirmed: bool,
    /// The gyro shows the motor swing about both axes, or would show too little to decide.
    pub gimbal_moves: bool,
    pub parachute_stowed: bool,
    /// The igniter has continuity.
    pub igniter_continuity: bool,
    pub estimator_healthy: bool,
    /// The inertial unit is alive, and no two of the three vertical speeds contradict the estimate.
    pub sensors_agree: bool,
}

/// One check of the gate with its result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateCheck {
    pub name: &'static str,
    /// In the unit; NaN for a condition.
    pub found: f64,
    /// Upper limit; NaN for a condition.
    pub limit: f64,
    pub unit: &'static str,
    /// It inhibits ignition now. NaN does.
    pub shut: bool,
    /// It is lasting: it seldom recovers.
    pub lasts: bool,
}

/// Factor on a limit beyond which a check is lasting. Tilt, pitch rate, speed and heights often
/// recover from less; beyond it the vehicle tumbles, or its position is lost.
const FAR_BEYOND: f64 = 2.0;

/// Number of checks of the gate.
pub const GATE_CHECKS: usize = 14;

/// The checks of the gate, in the order in which they are reported.
///
/// The fence needs no margin besides the prediction's: steering does not bring the vehicle back.
/// From the commit height to ignition it has a second.
pub fn checks(limits: &GateLimits, input: &GateInput) -> [GateCheck; GATE_CHECKS] {
    let value = |name, found: f64, limit: f64, unit, beyond: f64| GateCheck {
        name,
        found: found.abs(),
        limit,
        unit,
        shut: found.is_nan() || found.abs() > limit,
        lasts: found.abs() > beyond * limit,
    };
    let condition = |name, holds: bool, lasts: bool| GateCheck {
        name,
        found: f64::NAN,
        limit: f64::NAN,
        unit: "",
        shut: !holds,
        lasts: !holds && lasts,
    };
    let (rate_deg_s, apart_m) = (input.pitch_rate_rad_s.to_degrees(), input.height_disagreement_m);
    let speed_error = (input.speed_m_s - input.predicted_speed_m_s) / input.predicted_speed_m_s;
    [
        condition("sensors contradict the estimate", input.sensors_agree, true),
        condition("estimator in doubt", input.estimator_healthy, true),
        condition("igniter continuity lost", input.igniter_continuity, true),
        condition("a fin does not follow", input.fins_confirmed, true),
        condition("the gimbal does not move", input.gimbal_moves, true),
        value("touchdown beyond the fence", input.touchdown_distance_m, limits.fence_radius_m, "m", 1.0),
        condition("no landing ahead", input.lands_ahead, true),
        value("tilt", input.tilt_rad.to_degrees(), limits.tilt_max_deg, "deg", FAR_BEYOND),
        value("pitch rate", rate_deg_s, limits.pitch_rate_max_deg_s, "deg/s", FAR_BEYOND),
        value("speed error", 100.0 * speed_error, 100.0 * limits.speed_error_max_fraction, "%", FAR_BEYOND),
        value("heights disagree", apart_m, limits.height_disagreement_max_m, "m", FAR_BEYOND),
        condition("no landing plan", input.landing_feasible, false),
        condition("not descending", input.vertical_speed_m_s < 0.0, false),
        condition("parachute not stowed", input.parachute_stowed, false),
    ]
}

impl GateCheck {
    /// The check with its result, as text.
    pub fn words(&self) -> Text {
        let Self { name, found, limit, unit, .. } = self;
        if limit.is_nan() { text!("{name}") } else { text!("{name} {found:.0} {unit}, limit {limit:.0}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    fn good() -> GateInput {
        GateInput {
            tilt_rad: 0.0,
            vertical_speed_m_s: -5.0,
            pitch_rate_rad_s: 0.0,
            speed_m_s: 5.0,
            predicted_speed_m_s: 5.0,
            height_disagreement_m: 0.5,
            landing_feasible: true,
            lands_ahead: true,
            touchdown_distance_m: 0.3,
            fins_confirmed: true,
            gimbal_moves: true,
            parachute_stowed: true,
            igniter_continuity: true,
            estimator_healthy: true,
            sensors_agree: true,
        }
    }

    /// The checks that inhibit ignition.
    fn shut_after(spoil: impl FnOnce(&mut GateInput)) -> Vec<GateCheck> {
        let limits = crate::vehicles::mission::builtin("mk2").unwrap().unwrap().gate;
        let mut input = good();
        spoil(&mut input);
        checks(&limits, &input).into_iter().filter(|check| check.shut).collect()
    }

    #[test]
    fn the_nominal_start_opens_the_gate() {
        assert_eq!(shut_after(|_| {}), []);
    }

    /// A faulty input, and the check that must inhibit ignition.
    type Spoiling = (&'static str, fn(&mut GateInput));

    #[test]
    fn each_check_closes_the_gate_alone() {
        let spoilings: [Spoiling; 15] = [
            ("not descending", |input| {
                input.vertical_speed_m_s = 0.0;
            }),
            ("tilt", |input| {
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
            ("heights disagree", |input| {
                input.height_disagreement_m = f64::NAN;
            }),
            ("no landing plan", |input| {
                input.landing_feasible = false;
            }),
            ("touchdown beyond the fence", |input| {
                input.touchdown_distance_m = 121.0;
            }),
            ("a fin does not follow", |input| {
                input.fins_confirmed = false;
            }),
            ("the gimbal does not move", |input| {
                input.gimbal_moves = false;
            }),
            ("parachute not stowed", |input| {
                input.parachute_stowed = false;
            }),
            ("igniter continuity lost", |input| {
                input.igniter_continuity = false;
            }),
            ("no landing ahead", |input| {
                input.lands_ahead = false;
            }),
            ("sensors contradict the estimate", |input| {
                input.sensors_agree = false;
            }),
            ("estimator in doubt", |input| {
                input.estimator_healthy = false;
            }),
        ];
        for (name, spoil) in spoilings {
            let shut = shut_after(spoil);
            assert_eq!(shut.iter().map(|check| check.name).collect::<Vec<_>>(), [name]);
        }
    }

    /// A value slightly beyond its limit recovers; one far beyond it, or outside the fence, does
    /// not.
    #[test]
    fn a_lasting_refusal_is_far_beyond_its_limit_and_is_reported_with_values() {
        for (tilt_deg, lasts) in [(25.0_f64, false), (41.0, true)] {
            let shut = shut_after(|input| input.tilt_rad = tilt_deg.to_radians());
            assert_eq!(shut[0].lasts, lasts);
            assert_eq!(shut[0].words(), text!("tilt {tilt_deg:.0} deg, limit 20"));
        }
        let shut = shut_after(|input| input.touchdown_distance_m = 131.0);
        assert!(shut[0].lasts);
        assert_eq!(shut[0].words().as_str(), "touchdown beyond the fence 131 m, limit 120");
        assert_eq!(shut_after(|input| input.lands_ahead = false)[0].words().as_str(), "no landing ahead");
    }
}
