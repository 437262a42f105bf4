//! Estimates the strength of the motor from the specific force along the nose.
//!
//! A solid motor cannot be throttled and differs from its data sheet by a few per cent, and the landing plan is only as
//! good as its thrust. Along the nose axis the specific force is `(T cos d) / m - (rho S C / 2m) V u` (Eq. 18 of the
//! landing paper with its forces divided by mass). The thrust follows from it, and a first-order lag filters the noise.

use crate::computer::memory::remembers;
use crate::vehicle::dynamics::{PlanarParams, PlanarState};

/// Time constant of the lag, s: short compared with the burn, long compared with the roughness of the thrust.
const LAG_S: f64 = 0.2;
/// A sample outside this range is ignored: something else must be wrong.
const PLAUSIBLE: core::ops::RangeInclusive<f64> = 0.5..=1.5;

/// The estimate of thrust over nominal thrust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustEstimate {
    scale: f64,
}

remembers!(ThrustEstimate { scale });

impl Default for ThrustEstimate {
    fn default() -> Self {
        Self { scale: 1.0 }
    }
}

/// The input of one update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustSample {
    /// Specific force along the nose axis, m/s^2, as an accelerometer measures it.
    pub axial_specific_force_m_s2: f64,
    /// State estimate.
    pub state: PlanarState,
    /// Measured gimbal angle, rad.
    pub gimbal_rad: f64,
    /// Nominal thrust at this time, N; if it is zero, the estimate does not change.
    pub nominal_thrust_n: f64,
    /// Time since the last sample, s.
    pub interval_s: f64,
}

impl ThrustEstimate {
    /// An estimate with this scale, to continue from a log.
    pub fn resumed(scale: f64) -> Self {
        Self { scale }
    }

    /// The estimated thrust divided by the nominal thrust; 1 before the first sample.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Takes one sample. A sample that is not finite or not plausible is ignored.
    pub fn update(&mut self, params: &PlanarParams, sample: &ThrustSample) {
        let axial_n = sample.nominal_thrust_n * libm::cos(sample.gimbal_rad);
        let drag_m_s2 = params.drag_per_m * sample.state.speed_m_s() * sample.state.u_m_s;
        let measured = params.mass_kg * (sample.axial_specific_force_m_s2 + drag_m_s2) / axial_n;
        if PLAUSIBLE.contains(&measured) && sample.interval_s > 0.0 {
            let share = 1.0 - libm::exp(-sample.interval_s / LAG_S);
            self.scale += share * (measured - self.scale);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::dynamics::PlanarModel;

    /// The accelerometer's reading: the body-axis acceleration without gravity and rotation.
    fn felt(model: &PlanarModel, state: &PlanarState, gimbal_rad: f64, thrust_n: f64) -> f64 {
        let udot = model.derivative(&state.to_array(), gimbal_rad, thrust_n)[3];
        udot + model.params.gravity_m_s2 * libm::sin(state.theta_rad) + state.q_rad_s * state.w_m_s
    }

    #[test]
    fn a_weak_motor_is_known_within_a_second_at_any_attitude() {
        let profile = crate::vehicles::profile::builtin("paper-calibrated").unwrap();
        let model = profile.planar_model();
        for (theta_rad, gimbal_rad, q_rad_s) in [(1.57, 0.0, 0.0), (1.2, 0.3, -0.5), (2.0, -0.35, 1.0)] {
            let state = PlanarState { x_m: 1.0, z_m: 9.0, theta_rad, u_m_s: -5.0, w_m_s: 0.7, q_rad_s };
            let mut estimate = ThrustEstimate::default();
            for _ in 0..50 {
                let nominal_thrust_n = profile.motor.thrust_n;
                let sample = ThrustSample {
                    axial_specific_force_m_s2: felt(&model, &state, gimbal_rad, 0.94 * nominal_thrust_n),
                    state,
                    gimbal_rad,
                    nominal_thrust_n,
                    interval_s: 0.02,
                };
                estimate.update(&model.params, &sample);
            }
            // The rest of the lag after five time constants.
            assert!((estimate.scale() - 0.94).abs() < 0.06 * 0.0068, "{}", estimate.scale());
        }
    }

    #[test]
    fn bad_samples_do_not_change_the_estimate() {
        let params = crate::vehicles::profile::builtin("paper-calibrated").unwrap().planar_model().params;
        let good = ThrustSample {
            axial_specific_force_m_s2: 11.1,
            state: PlanarState::default(),
            gimbal_rad: 0.0,
            nominal_thrust_n: 33.3,
            interval_s: 0.02,
        };
        let mut estimate = ThrustEstimate::default();
        for bad in [
            ThrustSample { nominal_thrust_n: 0.0, ..good },
            ThrustSample { axial_specific_force_m_s2: f64::NAN, ..good },
            ThrustSample { axial_specific_force_m_s2: -3.0, ..good },
            ThrustSample { axial_specific_force_m_s2: 100.0, ..good },
            ThrustSample { interval_s: 0.0, ..good },
        ] {
            estimate.update(&params, &bad);
            assert_eq!(estimate, ThrustEstimate::default(), "{bad:?}");
        }
    }
}
