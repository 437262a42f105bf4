//! Finds the initial attitude on the pad: at rest the accelerometer shows the vertical and the gyro shows its own bias.
//!
//! This is the levelling of a strapdown unit (Groves 2013, section 5.6).

use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

use super::ImuSample;
use crate::vehicle::rigid::upright;

/// Fewest samples for an alignment: one second at 200 Hz.
const FEWEST: u32 = 200;
/// Largest mean rate of a vehicle at rest, rad/s: the turn-on bias of a hobby gyro with some margin.
pub(crate) const STILL_RAD_S: f64 = 0.017;
/// Length of the specific force of a vehicle at rest, m/s^2: gravity, with 5 % for scale, bias and place.
pub(crate) const FELT_AT_REST_M_S2: core::ops::RangeInclusive<f64> = 9.3..=10.3;

/// Running means over the samples taken at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PadAlignment {
    samples: u32,
    gyro_rad_s: Vector3<f64>,
    specific_force_m_s2: Vector3<f64>,
}

/// Why there is no alignment yet.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AlignmentError {
    /// Too few samples.
    #[error("{found} samples at rest, {FEWEST} are needed")]
    TooShort {
        /// The number of samples.
        found: u32,
    },
    /// The mean rate is too large for a vehicle at rest.
    #[error("turns at {found_deg_s:.2} deg/s, at rest is below 0.97 deg/s")]
    Turning {
        /// The mean rate, deg/s.
        found_deg_s: f64,
    },
    /// The mean specific force is not gravity's.
    #[error("feels {found_m_s2:.2} m/s^2, at rest is 9.3 to 10.3 m/s^2")]
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
    /// The gyro's bias, body, rad/s, for [`Estimator::with_gyro_bias`](super::Estimator::with_gyro_bias).
    pub gyro_bias_rad_s: Vector3<f64>,
}

impl PadAlignment {
    /// Takes one sample; an impossible sample is ignored.
    pub fn take(&mut self, imu: &ImuSample) {
        if !imu.is_plausible() {
            return;
        }
        self.samples = self.samples.saturating_add(1);
        let share = 1.0 / f64::from(self.samples);
        self.gyro_rad_s += (imu.gyro_rad_s - self.gyro_rad_s) * share;
        self.specific_force_m_s2 += (imu.specific_force_m_s2 - self.specific_force_m_s2) * share;
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
        if rate > STILL_RAD_S {
            return Err(AlignmentError::Turning { found_deg_s: rate.to_degrees() });
        }
        let felt = self.specific_force_m_s2.norm();
        if !FELT_AT_REST_M_S2.contains(&felt) {
            return Err(AlignmentError::NotAtRest { found_m_s2: felt });
        }
        let headed = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad) * upright();
        let up_in_world = headed * self.specific_force_m_s2;
        // The shortest rotation from the measured direction to the vertical does not change the heading.
        let lean = UnitQuaternion::rotation_between(&up_in_world, &Vector3::z())
            .unwrap_or_else(UnitQuaternion::identity);
        Ok(PadStart { world_from_body: lean * headed, gyro_bias_rad_s: self.gyro_rad_s })
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
    fn the_lean_of_the_pad_is_found_and_the_heading_kept() {
        let heading = 0.4;
        let lean = UnitQuaternion::from_scaled_axis(Vector3::new(0.05, -0.03, 0.0));
        let truth = lean * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * upright();
        let mut alignment = PadAlignment::default();
        for _ in 0..200 {
            alignment.take(&at_rest(&truth));
        }
        let start = alignment.finish(heading).unwrap();
        assert!(start.world_from_body.angle_to(&truth) < 1e-9, "{}", start.world_from_body.angle_to(&truth));
        assert!((start.gyro_bias_rad_s - Vector3::new(0.002, -0.003, 0.001)).norm() < 1e-12);
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
            of(ImuSample { gyro_rad_s: Vector3::new(0.0, 0.0, 0.05), ..good }, 300),
            "turns at 2.86 deg/s, at rest is below 0.97 deg/s"
        );
        assert_eq!(
            of(ImuSample { specific_force_m_s2: Vector3::new(12.0, 0.0, 0.0), ..good }, 300),
            "feels 12.00 m/s^2, at rest is 9.3 to 10.3 m/s^2"
        );
        assert!(
            of(ImuSample { gyro_rad_s: Vector3::new(f64::NAN, 0.0, 0.0), ..good }, 300)
                .starts_with("0 samples")
        );
    }
}
