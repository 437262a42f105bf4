//! The inertial unit: white noise by its density, a bias that walks, scale, axes and range (Groves
//! 2013, chapter 4).

use core::f64::consts::FRAC_1_SQRT_2;

use flight::computer::{FRAME_MS, FRAME_S};
use flight::estimation::estimator::{GRAVITY_M_S2, ImuSample};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::noise::Flaws;
use super::{SensorParams, SensorTruth, Sensors};
use crate::world::plant::Inertial;

flight::with_defaults! {
    /// Inertial measurement unit.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct ImuParams {
        /// Gyro noise density, deg/s/sqrt(Hz).
        pub gyro_noise_deg_s_sqrt_hz: f64 = 0.05,
        /// Gyro bias that remains after the calibration on the pad, each axis, deg/s. (At turn-on
        /// it is ten times larger.)
        pub gyro_bias_deg_s: f64 = 0.02,
        /// Wander of the gyro bias, deg/s in one second.
        pub gyro_bias_walk_deg_s_sqrt_s: f64 = 0.002,
        /// Largest rate measured, deg/s.
        pub gyro_range_deg_s: f64 = 2000.0,
        /// Accelerometer noise density, mg/sqrt(Hz).
        pub accelerometer_noise_mg_sqrt_hz: f64 = 0.65,
        /// Accelerometer bias, each axis, mg.
        pub accelerometer_bias_mg: f64 = 3.0,
        /// Scale error of each accelerometer axis, as a fraction.
        pub accelerometer_scale_share: f64 = 0.001,
        /// Cross-axis sensitivity of the accelerometer, as a fraction.
        pub accelerometer_cross_axis_share: f64 = 0.0,
        /// Largest specific force measured, g.
        pub accelerometer_range_g: f64 = 16.0,
        /// Vibration while the motor burns, rms of one frame's sample, each axis, g.
        pub vibration_g: f64 = 0.0,
        /// Vibration while the motor burns, rms of one frame's sample, each axis, deg/s.
        pub vibration_deg_s: f64 = 0.0,
        /// Accelerometer bias while the motor burns, each axis, mg: vibration that the sensor
        /// rectifies.
        pub vibration_bias_mg: f64 = 0.0,
        /// Gyro bias while the motor burns, each axis, deg/s: vibration that the sensor rectifies.
        pub vibration_bias_deg_s: f64 = 0.0,
        /// Misalignment of the unit in the vehicle, about each axis, degrees.
        pub mounting_deg: f64 = 0.0,
        /// Distance of the unit from its place in the mission, each axis, m.
        pub off_cg_m: f64 = 0.0,
    }
}

impl Sensors {
    /// Specific force at the inertial unit: that of the centre of gravity, plus the effect of
    /// rotation (Stevens and Lewis, chapter 1).
    pub(super) fn force_at_unit_m_s2(&self, truth: &SensorTruth) -> Vector3<f64> {
        let Inertial { rate_rad_s: rate, specific_force_m_s2, angular_acceleration_rad_s2, .. } =
            truth.inertial;
        let lever_m = self.places.lever_arms(&truth.cg_m).imu_m + self.flaws.unit_m;
        let turning_m_s2 = angular_acceleration_rad_s2.cross(&lever_m) + rate.cross(&rate.cross(&lever_m));
        specific_force_m_s2 + turning_m_s2
    }

    pub(super) fn imu(&mut self, burning: bool) -> ImuSample {
        let imu = &self.params.imu;
        let mean = |sum: &mut Vector3<f64>| core::mem::take(sum) / f64::from(FRAME_MS);
        // White noise of this density, averaged over a frame.
        let spread = 1.0 / libm::sqrt(FRAME_S);
        let milli_g = 1e-3 * GRAVITY_M_S2;

        let walk = imu.gyro_bias_walk_deg_s_sqrt_s.to_radians() * libm::sqrt(FRAME_S);
        self.errors.gyro_bias_rad_s += self.imu_noise.next3() * walk;
        let gyro_white = self.imu_noise.next3() * (imu.gyro_noise_deg_s_sqrt_hz.to_radians() * spread);
        let (shaken_rad_s, shaken_m_s2) =
            if burning { self.flaws.vibration(&self.params) } else { (Vector3::zeros(), Vector3::zeros()) };
        let (rectified_rad_s, rectified_m_s2) = if burning {
            (self.flaws.burning_bias_rad_s, self.flaws.burning_bias_m_s2)
        } else {
            (Vector3::zeros(), Vector3::zeros())
        };
        let gyro = self.flaws.unit_from_body * mean(&mut self.rate_sum_rad_s)
            + rectified_rad_s
            + shaken_rad_s
            + self.errors.gyro_bias_rad_s
            + gyro_white;

        let force_white = self.imu_noise.next3() * (imu.accelerometer_noise_mg_sqrt_hz * milli_g * spread);
        let felt_m_s2 = self.flaws.unit_from_body * mean(&mut self.force_sum_m_s2);
        let force = felt_m_s2.component_mul(&self.accelerometer_scale)
            + self.flaws.cross_axis * felt_m_s2
            + rectified_m_s2
            + shaken_m_s2
            + self.errors.accelerometer_bias_m_s2
            + force_white;

        let clip = |value: Vector3<f64>, range: f64| value.map(|axis| axis.clamp(-range, range));
        ImuSample {
            gyro_rad_s: clip(gyro, imu.gyro_range_deg_s.to_radians()),
            specific_force_m_s2: clip(force, imu.accelerometer_range_g * GRAVITY_M_S2),
        }
    }
}

impl Flaws {
    /// Vibration of one frame's sample: rotation rate, rad/s, and specific force, m/s^2. The mean
    /// rate over a frame is the difference of two angles, which a vibration does not let grow; the
    /// mean force is one of two velocities.
    fn vibration(&mut self, params: &SensorParams) -> (Vector3<f64>, Vector3<f64>) {
        let imu = &params.imu;
        let now = [self.vibration.next3(), self.vibration.next3()];
        let before = core::mem::replace(&mut self.shaken, now);
        let [rate, force] = [0, 1].map(|which: usize| (now[which] - before[which]) * FRAC_1_SQRT_2);
        (rate * imu.vibration_deg_s.to_radians(), force * (imu.vibration_g * GRAVITY_M_S2))
    }
}
