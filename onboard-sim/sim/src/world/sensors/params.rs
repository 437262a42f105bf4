//! The errors of the sensors, as data. The defaults are those of sensors that a student club can buy.

use serde::Deserialize;

use super::barometer::BarometerParams;
use super::gnss::GnssParams;
use super::imu::ImuParams;
use super::lidar::LidarParams;
use super::switches::SwitchParams;

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
    /// Switches and feedback.
    pub switches: SwitchParams,
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
    /// The first parameter of a sensor that is out of range.
    pub fn validate(&self) -> Result<(), SensorParamError> {
        let Self { imu, barometer, gnss, lidar, switches } = self;
        let wrong = imu.wrong().or_else(|| barometer.wrong()).or_else(|| gnss.wrong());
        wrong.or_else(|| lidar.wrong()).or_else(|| switches.wrong()).map_or(Ok(()), Err)
    }
}

type Named = (&'static str, f64);

fn first_not(
    fields: &[Named],
    accepted: &'static str,
    is_right: impl Fn(f64) -> bool,
) -> Option<SensorParamError> {
    let (field, found) = *fields.iter().find(|(_, found)| !is_right(*found))?;
    Some(SensorParamError { field, found, accepted })
}

pub(super) fn not_below_zero(fields: &[Named]) -> Option<SensorParamError> {
    first_not(fields, "a finite number not below 0", |found| found.is_finite() && found >= 0.0)
}

pub(super) fn above_zero(fields: &[Named]) -> Option<SensorParamError> {
    first_not(fields, "a finite number above 0", |found| found.is_finite() && found > 0.0)
}

pub(super) fn shares(fields: &[Named]) -> Option<SensorParamError> {
    first_not(fields, "0 to 1", |found| (0.0..=1.0).contains(&found))
}

pub(super) fn multiple_of_a_frame(field: &'static str, period_ms: u32) -> Option<SensorParamError> {
    let is_right = period_ms > 0 && period_ms.is_multiple_of(flight::computer::FRAME_MS);
    let found = f64::from(period_ms);
    (!is_right).then_some(SensorParamError { field, found, accepted: "a multiple of 5 above 0" })
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
