//! Finds the initial attitude on the pad: at rest the accelerometer shows the vertical and the gyro
//! shows its bias.
//!
//! This is the levelling of a strapdown unit (Groves 2013, section 5.6).

use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

use super::ImuSample;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::rigid::upright;

/// Fewest samples for an alignment: one second at 200 Hz.
const FEWEST: u32 = 200;
/// Largest turn-on bias of a calibrated gyro, rad/s: 10 deg/s. Hobby gyros show up to 7.2.
pub(crate) const BIAS_MAX_RAD_S: f64 = 0.175;
/// Specific force of a vehicle at rest, m/s^2: gravity, with 7 % for scale and bias. Hobby
/// accelerometers show 9.7 to 10.44.
pub(crate) const AT_REST_M_S2: core::ops::RangeInclusive<f64> = 9.12..=10.5;
/// Largest difference between the two halves of the record of a vehicle at rest: of the gyro, rad/s
/// (0.3 deg/s, five standard deviations of two seconds' noise), and of the specific force, m/s^2.
const GYRO_DRIFT_RAD_S: f64 = 0.005;
const FORCE_DRIFT_M_S2: f64 = 0.15;

/// Means over the samples taken at rest in one second.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PadAlignment {
    samples: u32,
    gyro_rad_s: Vector3<f64>,
    specific_force_m_s2: Vector3<f64>,
}

/// Newest seconds, which show a drift.
const RECORD: usize = 8;
/// Weight of all seconds before them, s: together the white noise of a gyro (0.05 deg/s/sqrt(Hz))
/// is down to 0.009 deg/s, as much as its bias walks in 20 s.
const OLDER_S: u32 = 24;
/// Largest difference of the older seconds' gyro from the newest ones', rad/s: 0.08 deg/s.
const OLDER_OFF_RAD_S: f64 = 0.0014;

/// The means of the last seconds at rest: a longer mean, and a motion that one second does not
/// show.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PadRecord {
    seconds: [PadAlignment; RECORD],
    filled: usize,
    older: PadAlignment,
    /// The first second is over. It is not recorded: at power-up the vehicle may still sway on its
    /// legs.
    begun: bool,
}

/// Why no alignment is available yet.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// Too few samples.
    #[error("{found} samples at rest, {FEWEST} are needed")]
    TooShort {
        /// The number of samples.
        found: u32,
    },
    /// The mean rate is too large for the bias of a gyro at rest.
    #[error("turns at {found_deg_s:.2} deg/s, at rest is below 10 deg/s")]
    Turning {
        /// The mean rate, deg/s.
        found_deg_s: f64,
    },
    /// Rate or specific force change from second to second.
    #[error("gyro drifts by {found_deg_s:.2} deg/s, specific force by {found_m_s2:.2} m/s^2")]
    Drifting {
        /// Change of the mean rate, deg/s.
        found_deg_s: f64,
        /// Change of the mean specific force, m/s^2.
        found_m_s2: f64,
    },
    /// The mean specific force is not gravity's.
    #[error("measured {found_m_s2:.2} m/s^2, at rest is 9.12 to 10.5 m/s^2")]
    NotAtRest {
        /// Its length, m/s^2.
        found_m_s2: f64,
    },
}

/// The result of the alignment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PadStart {
    /// The attitude, with the given heading.
    pub world_from_body: UnitQuaternion<f64>,
    pub calibration: ImuCalibration,
}

/// Errors of the inertial unit as measured at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImuCalibration {
    /// Bias of the gyro, body, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Measured specific force over the true one.
    pub accelerometer_scale: f64,
}

/// Largest deviation of the scale from 1 that is treated as a bias: 25 mg, half of what data sheets
/// allow. One position cannot distinguish them, but in a boost they differ.
const BIAS_MAX_SHARE: f64 = 0.025;

impl ImuCalibration {
    /// The divisor of the measured specific force, and the standard deviation of the remaining
    /// bias, m/s^2.
    pub(super) fn scale_and_bias(&self) -> (f64, f64) {
        let off = (self.accelerometer_scale - 1.0).abs();
        if off > BIAS_MAX_SHARE {
            (self.accelerometer_scale, 0.0)
        } else {
            (1.0, 0.5 * off * STANDARD_GRAVITY_M_S2)
        }
    }
}

impl PadRecord {
    /// Adds a second. A second that differs from the record begins a new one.
    ///
    /// # Errors
    /// The second is not of a vehicle at rest, or differs from those before it.
    pub fn take(&mut self, second: &PadAlignment, heading_rad: f64) -> Result<PadStart, AlignmentError> {
        let alone = second.finish(heading_rad);
        if alone.is_err() {
            *self = Self::default();
            return alone;
        }
        if !core::mem::replace(&mut self.begun, true) {
            return alone;
        }
        if self.filled == RECORD {
            self.older = PadAlignment::mean(&[self.older, self.seconds[RECORD - 1]]);
            self.older.samples = self.older.samples.min(OLDER_S * FEWEST);
        }
        self.seconds.rotate_right(1);
        self.seconds[0] = *second;
        self.filled = (self.filled + 1).min(RECORD);
        let half = self.filled.div_ceil(2);
        let [newer, older] =
            [&self.seconds[..half], &self.seconds[half..self.filled]].map(PadAlignment::mean);
        if older.samples > 0 {
            let found_deg_s = (newer.gyro_rad_s - older.gyro_rad_s).norm().to_degrees();
            let found_m_s2 = (newer.specific_force_m_s2 - older.specific_force_m_s2).norm();
            if found_deg_s > GYRO_DRIFT_RAD_S.to_degrees() || found_m_s2 > FORCE_DRIFT_M_S2 {
                (self.filled, self.older) = (1, PadAlignment::default());
                return Err(AlignmentError::Drifting { found_deg_s, found_m_s2 });
            }
        }
        let newest = PadAlignment::mean(&self.seconds[..self.filled]);
        if (self.older.gyro_rad_s - newest.gyro_rad_s).norm() > OLDER_OFF_RAD_S {
            self.older = PadAlignment::default();
        }
        PadAlignment::mean(&[self.older, newest]).finish(heading_rad)
    }
}

impl PadAlignment {
    /// The mean of several seconds.
    fn mean(seconds: &[Self]) -> Self {
        let mut mean = Self::default();
        for second in seconds {
            mean.add(second.samples, &second.gyro_rad_s, &second.specific_force_m_s2);
        }
        mean
    }

    fn add(&mut self, samples: u32, gyro_rad_s: &Vector3<f64>, specific_force_m_s2: &Vector3<f64>) {
        self.samples = self.samples.saturating_add(samples);
        let share = f64::from(samples) / f64::from(self.samples.max(1));
        self.gyro_rad_s += (gyro_rad_s - self.gyro_rad_s) * share;
        self.specific_force_m_s2 += (specific_force_m_s2 - self.specific_force_m_s2) * share;
    }

    /// Takes one sample; an impossible sample is ignored.
    pub fn take(&mut self, imu: &ImuSample) {
        if imu.is_plausible() {
            self.add(1, &imu.gyro_rad_s, &imu.specific_force_m_s2);
        }
    }

    /// The alignment for a heading about the vertical, rad: 0 is [`upright`].
    ///
    /// # Errors
    /// There are too few samples, or the vehicle is not at rest.
    pub fn finish(&self, heading_rad: f64) -> Result<PadStart, AlignmentError> {
        if self.samples < FEWEST {
            return Err(AlignmentError::TooShort { found: self.samples });
        }
        let rate = self.gyro_rad_s.norm();
        if rate > BIAS_MAX_RAD_S {
            return Err(AlignmentError::Turning { found_deg_s: rate.to_degrees() });
        }
        let sensed = self.specific_force_m_s2.norm();
        if !AT_REST_M_S2.contains(&sensed) {
            return Err(AlignmentError::NotAtRest { found_m_s2: sensed });
        }
        let headed = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad) * upright();
        let up_in_world = headed * self.specific_force_m_s2;
        // The shortest rotation from the measured direction to the vertical does not change the
        // heading.
        let lean = UnitQuaternion::rotation_between(&up_in_world, &Vector3::z())
            .unwrap_or_else(UnitQuaternion::identity);
        let calibration = ImuCalibration {
            gyro_bias_rad_s: self.gyro_rad_s,
            accelerometer_scale: sensed / STANDARD_GRAVITY_M_S2,
        };
        Ok(PadStart { world_from_body: lean * headed, calibration })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest(attitude: &UnitQuaternion<f64>) -> ImuSample {
        ImuSample {
            gyro_rad_s: Vector3::new(0.002, -0.003, 0.001),
            specific_force_m_s2: attitude.inverse() * Vector3::new(0.0, 0.0, 9.80665),
        }
    }

    #[test]
    fn the_lean_of_the_pad_is_found_and_the_heading_unchanged() {
        let heading = 0.4;
        let lean = UnitQuaternion::from_scaled_axis(Vector3::new(0.05, -0.03, 0.0));
        let truth = lean * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * upright();
        let mut alignment = PadAlignment::default();
        for _ in 0..200 {
            alignment.take(&at_rest(&truth));
        }
        let start = alignment.finish(heading).unwrap();
        assert!(start.world_from_body.angle_to(&truth) < 1e-9, "{}", start.world_from_body.angle_to(&truth));
        assert!((start.calibration.gyro_bias_rad_s - Vector3::new(0.002, -0.003, 0.001)).norm() < 1e-12);
    }

    #[test]
    fn a_vehicle_that_is_not_at_rest_is_refused_with_the_value_found() {
        let good = at_rest(&upright());
        let of = |imu: ImuSample, samples: u32| {
            let mut alignment = PadAlignment::default();
            for _ in 0..samples {
                alignment.take(&imu);
            }
            alignment.finish(0.0).unwrap_err().to_string()
        };
        assert_eq!(of(good, 199), "199 samples at rest, 200 are needed");
        assert_eq!(
            of(ImuSample { gyro_rad_s: Vector3::new(0.0, 0.0, 0.25), ..good }, 300),
            "turns at 14.32 deg/s, at rest is below 10 deg/s"
        );
        assert_eq!(
            of(ImuSample { specific_force_m_s2: Vector3::new(12.0, 0.0, 0.0), ..good }, 300),
            "measured 12.00 m/s^2, at rest is 9.12 to 10.5 m/s^2"
        );
        assert!(
            of(ImuSample { gyro_rad_s: Vector3::new(f64::NAN, 0.0, 0.0), ..good }, 300)
                .starts_with("0 samples")
        );
    }

    /// A second with this rate, deg/s, of an accelerometer with this scale on a vehicle at rest.
    fn second(rate_deg_s: f64, scale: f64, lean_deg: f64) -> PadAlignment {
        let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean_deg.to_radians()) * upright();
        let good = at_rest(&lean);
        let mut second = PadAlignment::default();
        for _ in 0..200 {
            second.take(&ImuSample {
                gyro_rad_s: Vector3::z() * rate_deg_s.to_radians(),
                specific_force_m_s2: good.specific_force_m_s2 * scale,
            });
        }
        second
    }

    #[test]
    fn a_constant_bias_and_a_wrong_scale_are_calibrated() {
        let mut record = PadRecord::default();
        for _ in 0..20 {
            let start = record.take(&second(7.2, 1.06, 1.0), 0.0).unwrap();
            assert!((start.calibration.gyro_bias_rad_s.z.to_degrees() - 7.2).abs() < 1e-9);
            assert!((start.calibration.accelerometer_scale - 1.06).abs() < 1e-9);
        }
        assert!(record.take(&second(12.0, 1.0, 0.0), 0.0).is_err());
    }

    #[test]
    fn a_drifting_bias_and_a_turning_vehicle_are_refused() {
        let errors = |of: &dyn Fn(f64) -> PadAlignment| {
            let mut record = PadRecord::default();
            (0..20).filter(|time_s| record.take(&of(f64::from(*time_s)), 0.0).is_err()).count()
        };
        assert_eq!(errors(&|_| second(5.0, 1.0, 0.0)), 0);
        assert!(errors(&|time_s| second(0.1 * time_s, 1.0, 0.0)) >= 2, "drift");
        assert!(errors(&|time_s| second(0.5, 1.0, 0.5 * time_s)) >= 4, "turns about a level axis");
    }
}
