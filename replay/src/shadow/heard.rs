//! What the vehicle has said last, in SI units.

use flight::rules::phase::Phase;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use protocol::dialect::{ATTITUDE_QUATERNION_DATA, LOCAL_POSITION_NED_DATA, TD_DESCENT_DATA, TD_FINS_DATA};

/// Attitude and rotation at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Attitude {
    /// The vehicle's time, s.
    pub(super) time_s: f64,
    pub(super) ned_from_body: UnitQuaternion<f64>,
    pub(super) rate_rad_s: Vector3<f64>,
}

impl From<&ATTITUDE_QUATERNION_DATA> for Attitude {
    fn from(told: &ATTITUDE_QUATERNION_DATA) -> Self {
        let [w, x, y, z] = [told.q1, told.q2, told.q3, told.q4].map(f64::from);
        Self {
            time_s: boot_s(told.time_boot_ms),
            ned_from_body: UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)),
            rate_rad_s: Vector3::new(told.rollspeed, told.pitchspeed, told.yawspeed).map(f64::from),
        }
    }
}

/// Position and velocity at one time, north-east-down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    /// The vehicle's time, s.
    pub(super) time_s: f64,
    pub(super) height_m: f64,
    pub(super) velocity_m_s: Vector3<f64>,
}

impl From<&LOCAL_POSITION_NED_DATA> for Motion {
    fn from(told: &LOCAL_POSITION_NED_DATA) -> Self {
        Self {
            time_s: boot_s(told.time_boot_ms),
            height_m: -f64::from(told.z),
            velocity_m_s: Vector3::new(told.vx, told.vy, told.vz).map(f64::from),
        }
    }
}

/// What the descent is steered by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Descent {
    /// The vehicle's time, s.
    pub(super) time_s: f64,
    pub(super) height_m: f64,
    pub(super) vertical_m_s: f64,
    pub(super) chosen_m: f64,
    pub(super) wind_ned_m_s: Vector3<f64>,
    pub(super) drag_scale: f64,
    pub(super) thrust_scale: f64,
}

impl From<&TD_DESCENT_DATA> for Descent {
    fn from(told: &TD_DESCENT_DATA) -> Self {
        Self {
            time_s: boot_s(told.time_boot_ms),
            height_m: f64::from(told.height_m),
            vertical_m_s: f64::from(told.vertical_speed_m_s),
            chosen_m: f64::from(told.chosen_height_m),
            wind_ned_m_s: Vector3::new(told.wind_x_m_s, told.wind_y_m_s, 0.0).map(f64::from),
            drag_scale: f64::from(told.drag_scale),
            thrust_scale: f64::from(told.thrust_scale),
        }
    }
}

/// Fin angles, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fins {
    pub(super) commanded_rad: [f64; 4],
    pub(super) measured_rad: [f64; 4],
}

impl From<&TD_FINS_DATA> for Fins {
    fn from(told: &TD_FINS_DATA) -> Self {
        let rad = |angles: [i16; 4]| angles.map(|angle| degrees(angle).to_radians());
        Self { commanded_rad: rad(told.commanded), measured_rad: rad(told.measured) }
    }
}

/// The last of everything.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Heard {
    pub(super) phase: Option<Phase>,
    /// The vehicle's time at which the landing motor was found to burn, s.
    pub(super) burns_since_s: Option<f64>,
    pub(super) attitude: Option<Attitude>,
    pub(super) motion: Option<Motion>,
    pub(super) descent: Option<Descent>,
    pub(super) fins: Option<Fins>,
}

/// Milliseconds since power-up, in seconds.
pub(super) fn boot_s(time_boot_ms: u32) -> f64 {
    f64::from(time_boot_ms) / 1e3
}

/// Centidegrees, in degrees.
pub(super) fn degrees(centidegrees: i16) -> f64 {
    f64::from(centidegrees) / 100.0
}
