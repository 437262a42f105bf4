//! The errors of the sensors, as data. The defaults are those of sensors that a student club can
//! buy.

use flight::computer::FRAME_MS;
use serde::{Deserialize, Serialize};

use super::barometer::BarometerParams;
use super::gnss::GnssParams;
use super::imu::ImuParams;
use super::lidar::LidarParams;
use super::switches::SwitchParams;
use crate::world::numbers;

/// The parameters of every sensor. Each value is a standard deviation unless its name says
/// otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorParams {
    /// Inertial measurement unit.
    pub imu: ImuParams,
    pub barometer: BarometerParams,
    /// Satellite receiver.
    pub gnss: GnssParams,
    pub lidar: LidarParams,
    /// Switches and feedback.
    pub switches: SwitchParams,
}

/// Why a sensor parameter is wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("sensors: {field} is {found}, accepted is {accepted}")]
pub struct SensorParamError {
    /// Section and field.
    pub field: String,
    pub found: f64,
    pub accepted: &'static str,
}

impl SensorParams {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter of a sensor that is out of range.
    pub fn validate(&self) -> Result<(), SensorParamError> {
        for (field, found) in numbers(self) {
            let is_finite = found.is_finite();
            let (is_right, accepted) = match field.as_str() {
                "imu.gyro_range_deg_s"
                | "imu.accelerometer_range_g"
                | "gnss.wander_correlation_s"
                | "gnss.velocity_wander_correlation_s"
                | "lidar.range_max_m" => (is_finite && found > 0.0, "a finite number above 0"),
                "gnss.delay_ms" => (self.gnss.delay_ms < self.gnss.period_ms, "below gnss.period_ms"),
                "barometer.period_ms" | "lidar.period_ms" => {
                    (found > 0.0 && found % f64::from(FRAME_MS) == 0.0, "a multiple of 5 above 0")
                }
                "lidar.tilt_max_deg" => ((0.0..90.0).contains(&found), "0 to below 90"),
                "imu.accelerometer_scale_share" | "imu.accelerometer_cross_axis_share" => {
                    (is_finite && found >= 0.0, "a finite number not below 0")
                }
                share if share.ends_with("_share") => ((0.0..=1.0).contains(&found), "0 to 1"),
                _ => (is_finite && found >= 0.0, "a finite number not below 0"),
            };
            if !is_right {
                return Err(SensorParamError { field, found, accepted });
            }
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
        // A name that no parameter has would check nothing.
        let names: Vec<String> = numbers(&good).into_iter().map(|(name, _)| name).collect();
        for name in [
            "imu.gyro_range_deg_s",
            "imu.accelerometer_range_g",
            "imu.accelerometer_scale_share",
            "imu.accelerometer_cross_axis_share",
            "gnss.wander_correlation_s",
            "gnss.velocity_wander_correlation_s",
            "gnss.delay_ms",
            "barometer.period_ms",
            "lidar.period_ms",
            "lidar.range_max_m",
            "lidar.tilt_max_deg",
        ] {
            assert!(names.iter().any(|known| known == name), "{name}");
        }
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
