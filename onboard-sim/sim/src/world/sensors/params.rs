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
    /// Switches and feedback.
    pub switches: SwitchParams,
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
    /// What each accelerometer axis feels of each other axis, as a fraction.
    pub accelerometer_cross_axis_share: f64,
    /// Largest specific force measured, g.
    pub accelerometer_range_g: f64,
    /// Vibration while the motor burns, rms of one frame's sample, each axis, g.
    pub vibration_g: f64,
    /// Vibration while the motor burns, rms of one frame's sample, each axis, deg/s.
    pub vibration_deg_s: f64,
    /// Accelerometer bias while the motor burns, each axis, mg: vibration that the sensor rectifies.
    pub vibration_bias_mg: f64,
    /// Misalignment of the unit in the vehicle, about each axis, degrees.
    pub mounting_deg: f64,
    /// Distance of the unit from the centre of gravity, each axis, m.
    pub off_cg_m: f64,
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
    /// Suction of the flow across the axis, divided by its dynamic pressure: lowest and highest.
    pub crossflow: [f64; 2],
    /// Age of a sample beyond what the flight computer assumes, the same for all of a flight, s.
    pub late_s: f64,
    /// Offset while the motor burns, m: the exhaust changes the pressure around the vehicle.
    pub plume_m: f64,
    /// Height error when the parachute is ejected, m, from the charge's pressure; it leaks out through the vents.
    pub ejection_m: f64,
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
    /// Error of the fixes' time tags, the same for all of a flight, s.
    pub time_tag_s: f64,
    /// Error of each fix's time tag beside that, s.
    pub age_jitter_s: f64,
    /// Wandering velocity error, each axis, m/s, and its correlation time, s.
    pub velocity_wander_m_s: f64,
    pub velocity_wander_correlation_s: f64,
    /// Probability that a fix is lost.
    pub dropout_share: f64,
    /// Probability that a fix is an outlier, and how far an outlier's position is off, each axis, m.
    pub outlier_share: f64,
    pub outlier_m: f64,
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
    /// Below this height of the feet there is no echo while the motor burns, m: dust.
    pub blind_below_m: f64,
    /// Lean of the beam against the axis, each way, degrees.
    pub beam_deg: f64,
    /// Height of the grass whose tops the beam meets, lowest and highest, m; the feet stand on the ground.
    pub grass_m: [f64; 2],
    /// Age of a range beyond what the flight computer assumes, the same for all of a flight, s.
    pub late_s: f64,
    /// Probability that a range is lost.
    pub dropout_share: f64,
    /// Probability that a range is an outlier: any value within the sensor's limits.
    pub outlier_share: f64,
}

/// Switches and feedback: what tells the flight computer of contact, of the igniter and of the fins.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SwitchParams {
    /// Time from the first contact until it is reported, ms.
    pub contact_late_ms: u32,
    /// Probability that the igniter's continuity is reported as lost, for all of a flight.
    pub continuity_lost_share: f64,
    /// Error of each fin's feedback, the same for all of a flight, degrees.
    pub fin_feedback_deg: f64,
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
            accelerometer_cross_axis_share: 0.0,
            accelerometer_range_g: 16.0,
            vibration_g: 0.0,
            vibration_deg_s: 0.0,
            vibration_bias_mg: 0.0,
            mounting_deg: 0.0,
            off_cg_m: 0.0,
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
            crossflow: [0.0; 2],
            late_s: 0.0,
            plume_m: 0.0,
            ejection_m: 0.0,
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
            time_tag_s: 0.0,
            age_jitter_s: 0.0,
            velocity_wander_m_s: 0.0,
            velocity_wander_correlation_s: 60.0,
            dropout_share: 0.0,
            outlier_share: 0.0,
            outlier_m: 0.0,
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
            blind_below_m: 0.0,
            beam_deg: 0.0,
            grass_m: [0.0; 2],
            late_s: 0.0,
            dropout_share: 0.0,
            outlier_share: 0.0,
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
        let Self { imu, barometer: baro, gnss, lidar, switches } = self;
        let sigmas = [
            ("imu.gyro_noise_deg_s_sqrt_hz", imu.gyro_noise_deg_s_sqrt_hz),
            ("imu.gyro_bias_deg_s", imu.gyro_bias_deg_s),
            ("imu.gyro_bias_walk_deg_s_sqrt_s", imu.gyro_bias_walk_deg_s_sqrt_s),
            ("imu.accelerometer_noise_mg_sqrt_hz", imu.accelerometer_noise_mg_sqrt_hz),
            ("imu.accelerometer_bias_mg", imu.accelerometer_bias_mg),
            ("imu.accelerometer_scale_share", imu.accelerometer_scale_share),
            ("imu.accelerometer_cross_axis_share", imu.accelerometer_cross_axis_share),
            ("imu.vibration_g", imu.vibration_g),
            ("imu.vibration_deg_s", imu.vibration_deg_s),
            ("imu.vibration_bias_mg", imu.vibration_bias_mg),
            ("imu.mounting_deg", imu.mounting_deg),
            ("imu.off_cg_m", imu.off_cg_m),
            ("barometer.crossflow, lowest", baro.crossflow[0]),
            ("barometer.crossflow, highest", baro.crossflow[1]),
            ("barometer.late_s", baro.late_s),
            ("barometer.plume_m", baro.plume_m),
            ("barometer.ejection_m", baro.ejection_m),
            ("gnss.time_tag_s", gnss.time_tag_s),
            ("gnss.age_jitter_s", gnss.age_jitter_s),
            ("gnss.velocity_wander_m_s", gnss.velocity_wander_m_s),
            ("gnss.outlier_m", gnss.outlier_m),
            ("lidar.blind_below_m", lidar.blind_below_m),
            ("lidar.beam_deg", lidar.beam_deg),
            ("lidar.grass_m, lowest", lidar.grass_m[0]),
            ("lidar.grass_m, highest", lidar.grass_m[1]),
            ("lidar.late_s", lidar.late_s),
            ("switches.fin_feedback_deg", switches.fin_feedback_deg),
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
            ("gnss.velocity_wander_correlation_s", gnss.velocity_wander_correlation_s),
            ("lidar.range_max_m", lidar.range_max_m),
        ];
        for (field, found) in sizes {
            if !(found.is_finite() && found > 0.0) {
                return Err(SensorParamError { field, found, accepted: "a finite number above 0" });
            }
        }
        let shares = [
            ("gnss.dropout_share", gnss.dropout_share),
            ("gnss.outlier_share", gnss.outlier_share),
            ("lidar.dropout_share", lidar.dropout_share),
            ("lidar.outlier_share", lidar.outlier_share),
            ("switches.continuity_lost_share", switches.continuity_lost_share),
        ];
        for (field, found) in shares {
            if !(0.0..=1.0).contains(&found) {
                return Err(SensorParamError { field, found, accepted: "0 to 1" });
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
