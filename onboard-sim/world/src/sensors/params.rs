//! The errors of the sensors, as data. The defaults are those of sensors that a student club can buy.

use serde::Deserialize;

/// The parameters of every sensor. Each value is a standard deviation unless its name says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorParams {
    /// Inertial measurement unit.
    pub imu: ImuParams,
    pub barometer: BarometerParams,
    /// Satellite receiver.
    pub gnss: GnssParams,
    pub lidar: LidarParams,
}

/// Inertial measurement unit.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImuParams {
    /// Gyro noise density, deg/s/sqrt(Hz).
    pub gyro_noise_deg_s_sqrt_hz: f64,
    /// Gyro bias that remains after the calibration on the pad, each axis, deg/s. (At turn-on it is ten times larger.)
    pub gyro_bias_deg_s: f64,
    /// Wander of the gyro bias, deg/s in one second.
    pub gyro_bias_walk_deg_s_sqrt_s: f64,
    /// Largest rate measured, deg/s.
    pub gyro_range_deg_s: f64,
    /// Accelerometer noise density, mg/sqrt(Hz).
    pub accelerometer_noise_mg_sqrt_hz: f64,
    /// Accelerometer bias, each axis, mg.
    pub accelerometer_bias_mg: f64,
    /// Scale error of each accelerometer axis, as a fraction.
    pub accelerometer_scale_share: f64,
    /// Largest specific force measured, g.
    pub accelerometer_range_g: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BarometerParams {
    /// Time between samples, ms; a multiple of the frame's 5 ms.
    pub period_ms: u32,
    /// Noise of one sample, m.
    pub noise_m: f64,
    /// Offset at the start, m, from weather and warming since the pad.
    pub offset_m: f64,
    /// Wander of the offset, m in one second.
    pub offset_walk_m_sqrt_s: f64,
    /// Ram coefficient: the pressure error divided by the dynamic pressure.
    pub ram_coefficient: f64,
}

/// Satellite receiver. Its position is zeroed on the pad before the flight and wanders from then on.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GnssParams {
    /// Time between fixes, ms.
    pub period_ms: u32,
    /// Age of a fix when it arrives, ms; below the period.
    pub delay_ms: u32,
    /// Velocity noise, each axis, m/s.
    pub velocity_m_s: f64,
    /// White position noise, horizontal, each axis, m.
    pub horizontal_white_m: f64,
    /// White position noise, vertical, m.
    pub vertical_white_m: f64,
    /// Wandering position error, horizontal, each axis, m.
    pub horizontal_wander_m: f64,
    /// Wandering position error, vertical, m.
    pub vertical_wander_m: f64,
    /// Correlation time of the wandering error, s.
    pub wander_correlation_s: f64,
    /// Time from the zeroing on the pad to the start of the simulation, s.
    pub zeroed_before_s: f64,
}

/// Lidar, looking backwards along the axis.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LidarParams {
    /// Time between samples, ms; a multiple of the frame's 5 ms.
    pub period_ms: u32,
    /// Noise of one range, m.
    pub noise_m: f64,
    /// Shortest range, m.
    pub range_min_m: f64,
    /// Longest range, m, straight down; it shrinks as the beam leans.
    pub range_max_m: f64,
    /// Beyond this tilt the ground gives no echo, degrees.
    pub tilt_max_deg: f64,
    /// Its position along the axis, ahead of the feet, m.
    pub ahead_of_feet_m: f64,
}

impl LidarParams {
    /// Its distance behind the centre of gravity, m, from that centre's height above the feet, m.
    pub fn behind_cg_m(&self, cg_over_feet_m: f64) -> f64 {
        cg_over_feet_m - self.ahead_of_feet_m
    }
}

impl Default for ImuParams {
    fn default() -> Self {
        Self {
            gyro_noise_deg_s_sqrt_hz: 0.05,
            gyro_bias_deg_s: 0.02,
            gyro_bias_walk_deg_s_sqrt_s: 0.002,
            gyro_range_deg_s: 2000.0,
            accelerometer_noise_mg_sqrt_hz: 0.65,
            accelerometer_bias_mg: 3.0,
            accelerometer_scale_share: 0.001,
            accelerometer_range_g: 16.0,
        }
    }
}

impl Default for BarometerParams {
    fn default() -> Self {
        Self {
            period_ms: 20,
            noise_m: 0.08,
            offset_m: 0.3,
            offset_walk_m_sqrt_s: 0.03,
            ram_coefficient: 0.05,
        }
    }
}

impl Default for GnssParams {
    fn default() -> Self {
        Self {
            period_ms: 200,
            delay_ms: 120,
            velocity_m_s: 0.05,
            horizontal_white_m: 0.2,
            vertical_white_m: 0.3,
            horizontal_wander_m: 1.5,
            vertical_wander_m: 2.5,
            wander_correlation_s: 200.0,
            zeroed_before_s: 20.0,
        }
    }
}

impl Default for LidarParams {
    fn default() -> Self {
        Self {
            period_ms: 10,
            noise_m: 0.06,
            range_min_m: 0.05,
            range_max_m: 12.0,
            tilt_max_deg: 45.0,
            ahead_of_feet_m: 0.15,
        }
    }
}

/// Why a sensor parameter is wrong.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("sensors: {field} is {found}, accepted is {accepted}")]
pub struct SensorParamError {
    /// Section and field.
    pub field: &'static str,
    pub found: f64,
    pub accepted: &'static str,
}

impl SensorParams {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    pub fn validate(&self) -> Result<(), SensorParamError> {
        let (imu, baro, gnss, lidar) = (&self.imu, &self.barometer, &self.gnss, &self.lidar);
        let sigmas = [
            ("imu.gyro_noise_deg_s_sqrt_hz", imu.gyro_noise_deg_s_sqrt_hz),
            ("imu.gyro_bias_deg_s", imu.gyro_bias_deg_s),
            ("imu.gyro_bias_walk_deg_s_sqrt_s", imu.gyro_bias_walk_deg_s_sqrt_s),
            ("imu.accelerometer_noise_mg_sqrt_hz", imu.accelerometer_noise_mg_sqrt_hz),
            ("imu.accelerometer_bias_mg", imu.accelerometer_bias_mg),
            ("imu.accelerometer_scale_share", imu.accelerometer_scale_share),
            ("barometer.noise_m", baro.noise_m),
            ("barometer.offset_m", baro.offset_m),
            ("barometer.offset_walk_m_sqrt_s", baro.offset_walk_m_sqrt_s),
            ("barometer.ram_coefficient", baro.ram_coefficient),
            ("gnss.velocity_m_s", gnss.velocity_m_s),
            ("gnss.horizontal_white_m", gnss.horizontal_white_m),
            ("gnss.vertical_white_m", gnss.vertical_white_m),
            ("gnss.horizontal_wander_m", gnss.horizontal_wander_m),
            ("gnss.vertical_wander_m", gnss.vertical_wander_m),
            ("gnss.zeroed_before_s", gnss.zeroed_before_s),
            ("lidar.noise_m", lidar.noise_m),
            ("lidar.range_min_m", lidar.range_min_m),
            ("lidar.ahead_of_feet_m", lidar.ahead_of_feet_m),
        ];
        for (field, found) in sigmas {
            if !(found.is_finite() && found >= 0.0) {
                return Err(SensorParamError { field, found, accepted: "a finite number not below 0" });
            }
        }
        let sizes = [
            ("imu.gyro_range_deg_s", imu.gyro_range_deg_s),
            ("imu.accelerometer_range_g", imu.accelerometer_range_g),
            ("gnss.wander_correlation_s", gnss.wander_correlation_s),
            ("lidar.range_max_m", lidar.range_max_m),
        ];
        for (field, found) in sizes {
            if !(found.is_finite() && found > 0.0) {
                return Err(SensorParamError { field, found, accepted: "a finite number above 0" });
            }
        }
        for (field, period_ms) in
            [("barometer.period_ms", baro.period_ms), ("lidar.period_ms", lidar.period_ms)]
        {
            if period_ms == 0 || !period_ms.is_multiple_of(flight::computer::FRAME_MS) {
                let found = f64::from(period_ms);
                return Err(SensorParamError { field, found, accepted: "a multiple of 5 above 0" });
            }
        }
        if gnss.delay_ms >= gnss.period_ms {
            return Err(SensorParamError {
                field: "gnss.delay_ms",
                found: f64::from(gnss.delay_ms),
                accepted: "below gnss.period_ms",
            });
        }
        if !(0.0..90.0).contains(&lidar.tilt_max_deg) {
            return Err(SensorParamError {
                field: "lidar.tilt_max_deg",
                found: lidar.tilt_max_deg,
                accepted: "0 to below 90",
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_out_of_range_is_named_in_the_error() {
        let good = SensorParams::default();
        assert_eq!(good.validate(), Ok(()));
        let of = |params: SensorParams| params.validate().unwrap_err().to_string();
        assert_eq!(
            of(SensorParams { imu: ImuParams { gyro_bias_deg_s: -0.1, ..good.imu }, ..good }),
            "sensors: imu.gyro_bias_deg_s is -0.1, accepted is a finite number not below 0"
        );
        assert_eq!(
            of(SensorParams { lidar: LidarParams { period_ms: 7, ..good.lidar }, ..good }),
            "sensors: lidar.period_ms is 7, accepted is a multiple of 5 above 0"
        );
        assert_eq!(
            of(SensorParams { gnss: GnssParams { delay_ms: 200, ..good.gnss }, ..good }),
            "sensors: gnss.delay_ms is 200, accepted is below gnss.period_ms"
        );
        assert_eq!(
            of(SensorParams { lidar: LidarParams { range_max_m: f64::NAN, ..good.lidar }, ..good }),
            "sensors: lidar.range_max_m is NaN, accepted is a finite number above 0"
        );
    }
}
