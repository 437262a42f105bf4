//! The measurements of one frame, as plain data. A log of them is enough to run the estimator again.

use nalgebra::Vector3;

/// Beyond the range of hobby gyros (4,000 deg/s), rad/s.
pub const LARGEST_RATE_RAD_S: f64 = 75.0;
/// Beyond the range of high-g accelerometers (200 g), m/s^2.
pub const LARGEST_SPECIFIC_FORCE_M_S2: f64 = 2000.0;

/// Inertial measurement unit, the mean over the frame that has just ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuSample {
    /// Rotation rate in body axes, rad/s.
    pub gyro_rad_s: Vector3<f64>,
    /// Specific force (acceleration minus gravity) at the centre of gravity, body axes, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
}

impl ImuSample {
    /// Whether an inertial unit can send these numbers: they are below [`LARGEST_RATE_RAD_S`] and
    /// [`LARGEST_SPECIFIC_FORCE_M_S2`] in each axis.
    pub fn is_plausible(&self) -> bool {
        self.gyro_rad_s.iter().all(|rate| rate.abs() <= LARGEST_RATE_RAD_S)
            && self.specific_force_m_s2.iter().all(|force| force.abs() <= LARGEST_SPECIFIC_FORCE_M_S2)
    }
}

/// One fix of the satellite receiver. It arrives late: it has the position at the time `valid_at_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssFix {
    /// Position in the world, relative to the pad, m.
    pub position_m: Vector3<f64>,
    pub velocity_m_s: Vector3<f64>,
    /// Time of validity, s on the flight computer's clock.
    pub valid_at_s: f64,
}

/// All measurements of one frame; a sensor that did not report is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurements {
    /// The inertial sample; every frame has one.
    pub imu: ImuSample,
    /// Height of the centre of gravity above the pad from the static pressure, m.
    pub pressure_altitude_m: Option<f64>,
    pub gnss: Option<GnssFix>,
    /// Distance to the ground along body `-x` from the lidar, m.
    pub lidar_range_m: Option<f64>,
}
