//! The upright law: the simplest controller that keeps the vehicle upright, used when there is no plan.
//!
//! Under thrust the vehicle's pitch is a double integrator of the gimbal angle. The law is sampled with the input held
//! and gives the closed loop two equal real poles `exp(-decay_rate * sample_time)`. When the vehicle is upright, the
//! full thrust acts vertically.

use core::f64::consts::FRAC_PI_2;

use crate::vehicle::dynamics::{PlanarParams, PlanarState};
use crate::vehicle::profile::Profile;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stabiliser {
    /// Commanded angular acceleration per radian of pitch error, 1/s^2.
    pitch_gain_per_s2: f64,
    /// Commanded angular acceleration per rad/s of pitch rate error, 1/s.
    rate_gain_per_s: f64,
    /// Arm of the thrust divided by the pitch inertia, 1/(kg m).
    arm_per_inertia: f64,
}

impl Stabiliser {
    /// The law of a profile.
    pub fn from_profile(profile: &Profile) -> Self {
        Self::from_rate(
            &profile.planar_params(),
            profile.nmpc.sample_time_s,
            profile.stabiliser.decay_rate_per_s,
        )
    }

    /// The law whose closed-loop poles decay at `decay_rate_per_s`, sampled every `sample_time_s`.
    pub fn from_rate(params: &PlanarParams, sample_time_s: f64, decay_rate_per_s: f64) -> Self {
        let pole = libm::exp(-decay_rate_per_s * sample_time_s);
        Self {
            pitch_gain_per_s2: (1.0 - pole) * (1.0 - pole) / (sample_time_s * sample_time_s),
            rate_gain_per_s: (1.0 - pole) * (3.0 + pole) / (2.0 * sample_time_s),
            arm_per_inertia: params.thrust_arm_m / params.pitch_inertia_kg_m2,
        }
    }

    /// Gimbal angle towards upright, rad, within `limit_rad`; 0 without thrust or from a state that is not finite.
    pub fn gimbal(&self, state: &PlanarState, thrust_n: f64, limit_rad: f64) -> f64 {
        self.gimbal_towards(state, FRAC_PI_2, 0.0, thrust_n, limit_rad)
    }

    /// Gimbal angle towards a pitch and pitch rate, rad, within `limit_rad`.
    pub fn gimbal_towards(
        &self,
        state: &PlanarState,
        theta_rad: f64,
        q_rad_s: f64,
        thrust_n: f64,
        limit_rad: f64,
    ) -> f64 {
        let wanted_rad_s2 = -self.pitch_gain_per_s2 * (state.theta_rad - theta_rad)
            - self.rate_gain_per_s * (state.q_rad_s - q_rad_s);
        // q' = -T sin(delta) arm / I; the sine's limit is the gimbal's.
        let sine = -wanted_rad_s2 / (thrust_n * self.arm_per_inertia);
        let sine_limit = libm::sin(limit_rad);
        if !(sine.is_finite() && sine_limit >= 0.0) {
            return 0.0;
        }
        libm::asin(sine.clamp(-sine_limit, sine_limit))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn profile() -> Profile {
        crate::vehicles::profile::builtin("paper-calibrated").unwrap()
    }

    /// The closed loop is linear in pitch and rate away from the limits; its two poles are exp(-4 * 0.1).
    #[test]
    fn val_double_pole_decays_as_designed() {
        let profile = profile();
        let law = Stabiliser::from_profile(&profile);
        let model = profile.planar_model();
        let pole = libm::exp(-0.4);
        let error = 0.01;
        let mut state = PlanarState { theta_rad: FRAC_PI_2 + error, z_m: 15.0, ..PlanarState::default() };
        // x_k = (1 + a k) pole^k error for a double pole; a follows from the first step.
        let mut first = None;
        for k in 1..=20 {
            let gimbal_rad = law.gimbal(&state, 33.3, 0.35);
            state = model.rk4_step(&state, gimbal_rad, 33.3, 0.1);
            let scaled = (state.theta_rad - FRAC_PI_2) / (error * libm::pow(pole, f64::from(k)));
            let slope = *first.get_or_insert(scaled - 1.0);
            assert!((scaled - 1.0 - slope * f64::from(k)).abs() < 1e-9, "{k}: {scaled}");
        }
    }

    proptest! {
        #[test]
        fn never_beyond_the_limit_and_never_nan(
            theta in prop::num::f64::ANY, q in prop::num::f64::ANY, thrust in prop::num::f64::ANY,
        ) {
            let state = PlanarState { theta_rad: theta, q_rad_s: q, ..PlanarState::default() };
            let gimbal_rad = Stabiliser::from_profile(&profile()).gimbal(&state, thrust, 0.35);
            prop_assert!(gimbal_rad.abs() <= 0.35 + 1e-12);
        }

        #[test]
        fn upright_from_any_tilt_within_three_seconds(theta_deg in 40.0..140.0_f64, q_deg_s in -60.0..60.0_f64) {
            let profile = profile();
            let law = Stabiliser::from_profile(&profile);
            let model = profile.planar_model();
            let mut state = PlanarState {
                theta_rad: theta_deg.to_radians(), q_rad_s: q_deg_s.to_radians(), ..PlanarState::default()
            };
            for _ in 0..30 {
                let gimbal_rad = law.gimbal(&state, 33.3, profile.gimbal.limit_rad());
                state = model.rk4_step(&state, gimbal_rad, 33.3, 0.1);
            }
            prop_assert!((state.theta_rad - FRAC_PI_2).abs() < 0.01, "{}", state.theta_rad);
        }
    }
}
