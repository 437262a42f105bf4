//! The assumed sensor errors, as data. The defaults are those of hobby-grade sensors: a consumer
//! inertial unit, a barometer, a single-frequency satellite receiver and a 12 m lidar.

use serde::{Deserialize, Serialize};

use crate::vehicle::mission::StartPoint;

/// Standard gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;

with_defaults! {
    /// Noise of the sensors and other assumptions of the filter. Each value is a standard deviation
    /// unless its name says otherwise.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct EstimatorConfig {
        /// Length of one frame, s.
        pub frame_s: f64 = 0.005,
        pub gravity_m_s2: f64 = GRAVITY_M_S2,
        /// Gyro noise density, deg/s/sqrt(Hz).
        pub gyro_noise_deg_s_sqrt_hz: f64 = 0.05,
        /// Wander of the gyro bias, deg/s in one second.
        pub gyro_bias_walk_deg_s_sqrt_s: f64 = 0.002,
        /// Accelerometer noise density, mg/sqrt(Hz).
        pub accelerometer_noise_mg_sqrt_hz: f64 = 0.65,
        /// Noise density that the motor's vibration adds to the gyro, deg/s/sqrt(Hz).
        pub burning_gyro_deg_s_sqrt_hz: f64 = 0.0,
        /// Shift of the gyro bias by the motor's vibration at ignition, each axis, deg/s.
        pub burning_gyro_bias_deg_s: f64 = 0.0,
        /// Noise density that the motor's vibration adds to the accelerometer, mg/sqrt(Hz).
        pub burning_accelerometer_mg_sqrt_hz: f64 = 0.0,
        /// Wander of the accelerometer bias, mg in one second. It covers the scale error while the
        /// thrust changes.
        pub accelerometer_bias_walk_mg_sqrt_s: f64 = 0.4,
        /// Barometer noise of one sample, m.
        pub barometer_m: f64 = 0.08,
        /// Age of a barometer sample, the same for all of a flight, s; 0 takes samples for new.
        pub barometer_late_s: f64 = 0.0,
        /// Wander of the barometer's offset, m in one second.
        pub barometer_offset_walk_m_sqrt_s: f64 = 0.03,
        /// Wander of the ram coefficient, in one second.
        pub barometer_ram_walk_sqrt_s: f64 = 0.001,
        /// Suction of the flow across the axis, divided by its dynamic pressure; 0 excludes it. A
        /// port on a cylinder sees +1 to -1.1 of it, depending on its position; the mean over a
        /// ring of ports is about -0.5 (Hoerner, "Fluid-Dynamic Drag", 1965).
        pub barometer_suction: f64 = 0.0,
        /// Scale error of the barometric height: a day 15 K from the standard atmosphere's
        /// temperature.
        pub barometer_scale: f64 = 0.05,
        /// White noise of a satellite position, horizontal, m.
        pub gnss_horizontal_m: f64 = 0.2,
        /// White noise of a satellite position, vertical, m.
        pub gnss_vertical_m: f64 = 0.3,
        /// Noise of a satellite velocity, m/s.
        pub gnss_velocity_m_s: f64 = 0.05,
        /// Error of the satellite fixes' time tags, constant over a flight, s; 0 trusts the tags.
        pub gnss_time_tag_s: f64 = 0.0,
        /// Additional error of each time tag, s; 0 excludes it. This is the prior before the
        /// flight: from then on it is estimated from the fixes.
        pub gnss_age_jitter_s: f64 = 0.0,
        /// Wander of the satellite position's offset, horizontal, m in one second.
        pub gnss_horizontal_walk_m_sqrt_s: f64 = 0.15,
        /// Wander of the satellite position's offset, vertical, m in one second.
        pub gnss_vertical_walk_m_sqrt_s: f64 = 0.25,
        /// Lidar noise of one sample, m.
        pub lidar_m: f64 = 0.06,
        /// Age of a lidar sample, the same for all of a flight, s.
        pub lidar_late_s: f64 = 0.0,
        /// Slope of the ground about the pad, degrees; 0 takes it as level.
        pub ground_slope_deg: f64 = 0.0,
        /// Misalignment of the inertial unit in the vehicle, about each axis, degrees. No sensor
        /// shows it: it is added to the uncertainty of the attitude.
        pub mounting_deg: f64 = 0.0,
        /// Wander of the wind at the vehicle, m/s in one second, from gusts and from the layers
        /// that it falls through.
        pub wind_walk_m_s_sqrt_s: f64 = 0.5,
        /// Exponent of the wind's power law over height; the estimated wind decreases with it.
        pub wind_shear_exponent: f64 = 1.0 / 7.0,
        /// Uncertainty of the sideways aerodynamic force, as a fraction of it.
        pub sideways_force_share: f64 = 0.1,
        /// Number of linearisations of the sideways force for one correction of the wind. One is
        /// enough where the fins dominate; a body without large fins, whose force is quadratic,
        /// needs about five.
        pub wind_passes: u32 = 1,
        /// A measurement that differs from its prediction by more than this many standard
        /// deviations is rejected.
        pub gate_sigmas: f64 = 5.0,
        /// Limits beyond which the estimate is unhealthy.
        pub health: HealthLimits = HealthLimits::default(),
    }
}

with_defaults! {
    /// Largest standard deviations of a healthy estimate.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct HealthLimits {
        /// Vertical velocity, m/s.
        pub velocity_m_s: f64 = 0.5,
        /// Horizontal velocity, either axis, m/s: crushable legs survive 2 m/s.
        pub lateral_m_s: f64 = 1.2,
        pub height_m: f64 = 2.5,
        /// Horizontal position, either axis, m.
        pub horizontal_m: f64 = 10.0,
        /// Tilt, either axis, degrees.
        pub tilt_deg: f64 = 3.0,
    }
}

/// Standard deviations of the initial state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartUncertainty {
    /// Horizontal position, each axis, m.
    pub horizontal_m: f64,
    pub height_m: f64,
    /// Velocity, each axis, m/s.
    pub velocity_m_s: f64,
    /// Lean, about each horizontal axis, degrees.
    pub tilt_deg: f64,
    /// Heading, about the vertical, degrees.
    pub heading_deg: f64,
    /// Gyro bias that remains after the calibration on the pad, each axis, deg/s.
    pub gyro_bias_deg_s: f64,
    /// Accelerometer bias, each axis, mg.
    pub accelerometer_bias_mg: f64,
    /// Wind, each horizontal axis, m/s.
    pub wind_m_s: f64,
    pub barometer_offset_m: f64,
    /// Ram coefficient of the barometer: its height error is this times `V^2 / 2 g`.
    pub barometer_ram: f64,
    /// Offset of the satellite position since it was zeroed on the pad, horizontal, m.
    pub gnss_horizontal_offset_m: f64,
    /// Offset of the satellite position since it was zeroed on the pad, vertical, m.
    pub gnss_vertical_offset_m: f64,
    /// The lean was measured by the accelerometer at rest, so it has the accelerometer's error.
    pub levelled: bool,
}

impl StartUncertainty {
    /// At rest on the pad after [`alignment`](super::alignment).
    pub fn on_pad() -> Self {
        Self {
            horizontal_m: 0.05,
            height_m: 0.02,
            velocity_m_s: 0.01,
            tilt_deg: 0.2,
            barometer_offset_m: 0.1,
            gnss_horizontal_offset_m: 0.1,
            gnss_vertical_offset_m: 0.1,
            levelled: true,
            ..Self::at_apogee()
        }
    }

    /// Initial uncertainty at a start. A vehicle below a drone was carried up with its estimator
    /// running.
    pub fn at_start(start: StartPoint) -> Self {
        match start {
            StartPoint::Pad => Self::on_pad(),
            StartPoint::Apogee | StartPoint::Drone => Self::at_apogee(),
        }
    }

    /// At apogee, after an ascent of about 10 s during which the estimator ran.
    pub fn at_apogee() -> Self {
        Self {
            horizontal_m: 0.7,
            height_m: 0.5,
            velocity_m_s: 0.15,
            tilt_deg: 0.7,
            heading_deg: 2.0,
            gyro_bias_deg_s: 0.02,
            accelerometer_bias_mg: 3.0,
            wind_m_s: 4.0,
            barometer_offset_m: 0.3,
            barometer_ram: 0.05,
            gnss_horizontal_offset_m: 0.65,
            gnss_vertical_offset_m: 1.1,
            levelled: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_changes_only_the_keys_it_has() {
        let config: EstimatorConfig = toml::from_str("lidar_m = 0.1\n[health]\ntilt_deg = 2.0").unwrap();
        let expected = EstimatorConfig {
            lidar_m: 0.1,
            health: HealthLimits { tilt_deg: 2.0, ..HealthLimits::default() },
            ..EstimatorConfig::default()
        };
        assert_eq!(config, expected);
        assert!(toml::from_str::<EstimatorConfig>("lidar = 0.1").is_err());
    }
}
