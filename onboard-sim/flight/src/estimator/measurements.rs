//! What one frame of the flight computer sees of the world. Plain data: a log of these flies the estimator again.

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
    /// Acceleration less gravity at the centre of gravity, body axes, m/s^2.
    pub specific_force_m_s2: Vector3<f64>,
}

impl ImuSample {
    /// Every number is one that an inertial unit can send: below [`LARGEST_RATE_RAD_S`] and
    /// [`LARGEST_SPECIFIC_FORCE_M_S2`] in each axis.
    pub fn is_plausible(&self) -> bool {
        self.gyro_rad_s.iter().all(|rate| rate.abs() <= LARGEST_RATE_RAD_S)
            && self.specific_force_m_s2.iter().all(|force| force.abs() <= LARGEST_SPECIFIC_FORCE_M_S2)
    }
}

/// One fix of the satellite receiver. It arrives late: it tells where the vehicle was at `valid_at_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssFix {
    /// Position in the world, relative to the pad, m.
    pub position_m: Vector3<f64>,
    /// Velocity in the world, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// When this was so, s on the flight computer's clock.
    pub valid_at_s: f64,
}

/// Everything one frame measured; what did not report is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurements {
    /// Every frame has one.
    pub imu: ImuSample,
    /// Height over the pad that the static pressure says, m, of the centre of gravity.
    pub pressure_altitude_m: Option<f64>,
    /// Satellite fix.
    pub gnss: Option<GnssFix>,
    /// Distance to the ground along body `-x` from the lidar, m.
    pub lidar_range_m: Option<f64>,
}
