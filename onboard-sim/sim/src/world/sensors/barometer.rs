//! The barometer: the errors of its ports go with the dynamic pressure (W. Gracey, NASA Reference
//! Publication 1046, 1980).

use flight::estimation::estimator::GRAVITY_M_S2;
use serde::{Deserialize, Serialize};

use super::noise::EJECTION_LASTS_S;
use super::{MS_S, SensorTruth, Sensors};

flight::with_defaults! {
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct BarometerParams {
        /// Time between samples, ms; a multiple of the frame's 5 ms.
        pub period_ms: u32 = 20,
        /// Noise of one sample, m.
        pub noise_m: f64 = 0.08,
        /// Scale error of the height: air that is not as warm as the standard's.
        pub scale_share: f64 = 0.0,
        /// Offset at the start, m, from weather and warming since the pad.
        pub offset_m: f64 = 0.3,
        /// Wander of the offset, m in one second.
        pub offset_walk_m_sqrt_s: f64 = 0.03,
        /// Ram coefficient: the pressure error divided by the dynamic pressure.
        pub ram_coefficient: f64 = 0.05,
        /// Suction of the flow across the axis, divided by its dynamic pressure: lowest and
        /// highest.
        pub crossflow: [f64; 2] = [0.0; 2],
        /// Age of a sample beyond the flight computer's assumption, constant over a flight, s.
        pub late_s: f64 = 0.0,
        /// Offset while the motor burns, m: the exhaust changes the pressure around the vehicle.
        pub plume_m: f64 = 0.0,
        /// Height error when the parachute is ejected, m, from the charge's pressure; it leaks out
        /// through the vents.
        pub ejection_m: f64 = 0.0,
    }
}

impl Sensors {
    pub(super) fn barometer(&mut self, truth: &SensorTruth) -> Option<f64> {
        let barometer = &self.params.barometer;
        if !self.elapsed_ms.is_multiple_of(barometer.period_ms) {
            return None;
        }
        let walk = barometer.offset_walk_m_sqrt_s * libm::sqrt(f64::from(barometer.period_ms) * MS_S);
        self.errors.barometer_offset_m += walk * self.barometer_noise.next();
        // A pressure that is too high by k rho V^2 / 2 gives a height that is too low by k V^2 / 2
        // g.
        let speed_height_m = truth.airspeed_m_s * truth.airspeed_m_s / (2.0 * GRAVITY_M_S2);
        let then_m = truth.state.position_m.z - truth.state.velocity_m_s.z * self.flaws.barometer_late_s;
        let plume_m = if truth.burning { self.flaws.barometer_plume_m } else { 0.0 };
        let ejection_m = truth
            .ejected_for_s
            .map_or(0.0, |for_s| self.flaws.barometer_ejection_m * libm::exp(-for_s / EJECTION_LASTS_S));
        let across_m_s = truth.airspeed_across_m_s;
        let suction_m = self.flaws.barometer_crossflow * across_m_s * across_m_s / (2.0 * GRAVITY_M_S2);
        let lever_m = self.places.lever_arms(&truth.cg_m).barometer_m;
        let ports_m = (truth.state.world_from_body * lever_m).z - lever_m.x;
        Some(
            (then_m + ports_m) * self.flaws.barometer_scale
                + self.errors.barometer_offset_m
                + plume_m
                + ejection_m
                + suction_m
                - self.errors.barometer_ram * speed_height_m
                + barometer.noise_m * self.barometer_noise.next(),
        )
    }
}
