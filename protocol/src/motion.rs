//! Position, velocity and attitude of a vehicle, converted from north-east-down on the wire to
//! north, east and up; and places on the Earth.

use alloc::format;
use alloc::string::String;
use core::str::FromStr;

use crate::dialect::{ATTITUDE_QUATERNION_DATA, GLOBAL_POSITION_INT_DATA, LOCAL_POSITION_NED_DATA};

/// The Earth's equatorial radius, m, and its first eccentricity squared (WGS 84).
const EQUATORIAL_RADIUS_M: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;
/// The greatest latitude, degrees: close to a pole a path to the east circles the pole.
const LATITUDE_MAX_DEG: f64 = 85.0;

/// A point on the Earth, degrees, north and east positive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct Degrees {
    pub latitude: f64,
    pub longitude: f64,
}

impl FromStr for Degrees {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{given}` is no place; give latitude,longitude in degrees, as in 35.347,-117.809");
        let (latitude, longitude) = given.split_once(',').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_no_number| wrong());
        let (latitude, longitude) = (number(latitude)?, number(longitude)?);
        Some(Self { latitude, longitude }).filter(|place| place.is_valid()).ok_or_else(wrong)
    }
}

impl Degrees {
    /// Whether it is a place, and not close to a pole.
    pub fn is_valid(self) -> bool {
        self.latitude.abs() <= LATITUDE_MAX_DEG && self.longitude.abs() <= 180.0
    }

    /// A position in ten millionths of a degree, as in messages; 0, 0 stands for none.
    pub fn of_e7(latitude: i32, longitude: i32) -> Option<Self> {
        let [latitude, longitude] = [latitude, longitude].map(|e7| f64::from(e7) * 1e-7);
        let is_told = latitude != 0.0 || longitude != 0.0;
        Some(Self { latitude, longitude }).filter(|place| is_told && place.is_valid())
    }

    /// Metres per degree of latitude and of longitude here.
    fn metres_per_degree(self) -> (f64, f64) {
        let latitude_rad = self.latitude.to_radians();
        let flattened = 1.0 - ECCENTRICITY_SQUARED * libm::pow(libm::sin(latitude_rad), 2.0);
        let across_m = EQUATORIAL_RADIUS_M / libm::sqrt(flattened);
        let along_m = across_m * (1.0 - ECCENTRICITY_SQUARED) / flattened;
        (along_m.to_radians(), (across_m * libm::cos(latitude_rad)).to_radians())
    }

    /// The point at a distance north and east of this one, m; exact to a millimetre within a
    /// kilometre.
    #[must_use]
    pub fn moved(self, north_m: f64, east_m: f64) -> Self {
        let (north_m_deg, east_m_deg) = self.metres_per_degree();
        Self {
            latitude: self.latitude + north_m / north_m_deg,
            longitude: wrapped(self.longitude + east_m / east_m_deg),
        }
    }

    /// How far north and east another point is, m.
    pub fn to(self, other: Self) -> (f64, f64) {
        let (north_m_deg, east_m_deg) = self.metres_per_degree();
        let east_deg = wrapped(other.longitude - self.longitude);
        ((other.latitude - self.latitude) * north_m_deg, east_deg * east_m_deg)
    }
}

/// Degrees from -180 to 180.
fn wrapped(degrees: f64) -> f64 {
    match degrees {
        east if east > 180.0 => east - 360.0,
        west if west < -180.0 => west + 360.0,
        degrees => degrees,
    }
}

/// A direction or a velocity: north, east, up.
pub type NorthEastUp = [f64; 3];

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Pitch above the horizontal, seen from the east; pi/2 is upright.
    pub pitch_rad: f64,
    /// Angle between nose and vertical, 0 to pi.
    pub tilt_rad: f64,
    /// Rotation rate about the body y axis.
    pub pitch_rate_rad_s: f64,
    /// Rotation rate about the body z axis.
    pub yaw_rate_rad_s: f64,
    /// The body axes: x towards the nose, y, z.
    pub axes: [NorthEastUp; 3],
}

/// Position and velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// North of the pad.
    pub x_m: f64,
    /// East of the pad.
    pub y_m: f64,
    /// Altitude, up.
    pub altitude_m: f64,
    /// Speed towards north.
    pub vx_m_s: f64,
    /// Speed towards east.
    pub vy_m_s: f64,
    /// Vertical speed, up.
    pub climb_m_s: f64,
}

/// Speeds along the body's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySpeed {
    /// Axial, towards the nose.
    pub u_m_s: f64,
    /// Lateral, along the body y axis.
    pub v_m_s: f64,
    /// Lateral, along the body z axis.
    pub w_m_s: f64,
}

/// Commanded and measured angle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deflection {
    /// Commanded angle.
    pub commanded_rad: f64,
    /// Measured angle.
    pub measured_rad: f64,
}

impl Deflection {
    /// Of hundredths of a degree.
    pub fn of_centidegrees(commanded: i16, measured: i16) -> Self {
        let radians = |angle: i16| (f64::from(angle) / 100.0).to_radians();
        Self { commanded_rad: radians(commanded), measured_rad: radians(measured) }
    }

    /// How far it is from where it was commanded, degrees.
    pub fn error_deg(&self) -> f64 {
        (self.commanded_rad - self.measured_rad).abs().to_degrees()
    }
}

impl Attitude {
    /// `None` if the quaternion is no rotation. Pitch and tilt come from the direction of the nose,
    /// which has no singularity at upright.
    pub fn of(data: &ATTITUDE_QUATERNION_DATA) -> Option<Self> {
        let [w, x, y, z] = [data.q1, data.q2, data.q3, data.q4].map(f64::from);
        let norm_squared = w * w + x * x + y * y + z * z;
        // Sent as f32 and perhaps never normalised; an all-zero or NaN quaternion means "unknown".
        if !(0.5..2.0).contains(&norm_squared) {
            return None;
        }
        let twice = 2.0 / norm_squared;
        // The columns of the rotation to north-east-down, with the sign of the down row changed.
        let nose = [1.0 - twice * (y * y + z * z), twice * (x * y + w * z), -twice * (x * z - w * y)];
        let body_y = [twice * (x * y - w * z), 1.0 - twice * (x * x + z * z), -twice * (y * z + w * x)];
        let body_z = [twice * (x * z + w * y), twice * (y * z - w * x), twice * (x * x + y * y) - 1.0];
        let [north, east, up] = nose;
        Some(Self {
            pitch_rad: libm::atan2(up, north),
            tilt_rad: libm::atan2(libm::hypot(north, east), up),
            pitch_rate_rad_s: f64::from(data.pitchspeed),
            yaw_rate_rad_s: f64::from(data.yawspeed),
            axes: [nose, body_y, body_z],
        })
    }

    /// How fast the nose turns, in any direction, rad/s.
    pub fn turn_rate_rad_s(&self) -> f64 {
        libm::hypot(self.pitch_rate_rad_s, self.yaw_rate_rad_s)
    }
}

impl Motion {
    pub fn of(data: &LOCAL_POSITION_NED_DATA) -> Self {
        Self {
            x_m: f64::from(data.x),
            y_m: f64::from(data.y),
            altitude_m: -f64::from(data.z),
            vx_m_s: f64::from(data.vx),
            vy_m_s: f64::from(data.vy),
            climb_m_s: -f64::from(data.vz),
        }
    }

    /// Height above the pad and climb of a vehicle that sends no local position. Not of VFR_HUD:
    /// its height is above mean sea level.
    pub fn of_global(data: &GLOBAL_POSITION_INT_DATA) -> Self {
        Self::vertical(f64::from(data.relative_alt) / 1e3, -f64::from(data.vz) / 1e2)
    }

    /// A motion with only altitude and climb rate.
    pub fn vertical(altitude_m: f64, climb_m_s: f64) -> Self {
        let unknown = f64::NAN;
        Self { x_m: unknown, y_m: unknown, altitude_m, vx_m_s: unknown, vy_m_s: unknown, climb_m_s }
    }

    /// Horizontal speed, m/s.
    pub fn horizontal_m_s(&self) -> f64 {
        libm::hypot(self.vx_m_s, self.vy_m_s)
    }

    /// Horizontal distance from the pad, m.
    pub fn distance_m(&self) -> f64 {
        libm::hypot(self.x_m, self.y_m)
    }

    pub fn speed_m_s(&self) -> f64 {
        libm::hypot(self.horizontal_m_s(), self.climb_m_s)
    }
}

impl BodySpeed {
    /// Converts the velocity to the body axes.
    pub fn of(attitude: &Attitude, motion: &Motion) -> Self {
        let along = |axis: &NorthEastUp| {
            axis[0] * motion.vx_m_s + axis[1] * motion.vy_m_s + axis[2] * motion.climb_m_s
        };
        let [x, y, z] = &attitude.axes;
        Self { u_m_s: along(x), v_m_s: along(y), w_m_s: along(z) }
    }

    /// Speed across the body axis, m/s.
    pub fn lateral_m_s(&self) -> f64 {
        libm::hypot(self.v_m_s, self.w_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rotation([w, x, y, z]: [f64; 4]) -> Attitude {
        let [q1, q2, q3, q4] = [w, x, y, z].map(|part| part as f32);
        Attitude::of(&ATTITUDE_QUATERNION_DATA { q1, q2, q3, q4, ..Default::default() }).unwrap()
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
    }

    /// A rocket that leans 10 deg towards the east, which the plane of north and up does not show:
    /// a rotation about east by 90 deg, then about north by 10 deg.
    #[test]
    fn a_lean_towards_the_east_is_a_tilt() {
        let (sin, cos) = libm::sincos(5.0_f64.to_radians());
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let leaning = rotation([cos * half, sin * half, cos * half, sin * half]);
        close(leaning.tilt_rad.to_degrees(), 10.0);
        let [north, east, up] = leaning.axes[0];
        close(north, 0.0);
        close(east, libm::sin(10.0_f64.to_radians()));
        close(up, libm::cos(10.0_f64.to_radians()));
        // Falling straight down, it moves along its axis and, across it, along its y axis.
        let falling = Motion { vx_m_s: 0.0, vy_m_s: 0.0, climb_m_s: -10.0, ..Motion::vertical(0.0, 0.0) };
        let speed = BodySpeed::of(&leaning, &falling);
        close(speed.u_m_s, -9.848_078);
        close(speed.lateral_m_s(), 1.736_482);
        close(speed.w_m_s, 0.0);
    }

    #[test]
    fn motion_towards_the_east_counts_in_speed_and_distance() {
        let wire = LOCAL_POSITION_NED_DATA {
            x: 3.0,
            y: -4.0,
            z: -7.0,
            vx: 1.0,
            vy: 2.0,
            vz: 2.0,
            ..Default::default()
        };
        let motion = Motion::of(&wire);
        close(motion.distance_m(), 5.0);
        close(motion.speed_m_s(), 3.0);
        close(motion.horizontal_m_s(), 2.236_068);
    }

    proptest! {
        /// A rotation preserves the length: the components along the body axes add up to the speed.
        #[test]
        fn the_components_along_the_body_axes_add_up_to_the_speed(
            q in prop::array::uniform4(-1.0..1.0_f64),
            v in prop::array::uniform3(-50.0..50.0_f64),
        ) {
            let norm = q.iter().map(|part| part * part).sum::<f64>().sqrt();
            prop_assume!(norm > 0.1);
            let attitude = rotation(q.map(|part| part / norm));
            let motion = Motion { vx_m_s: v[0], vy_m_s: v[1], climb_m_s: v[2], ..Motion::vertical(0.0, 0.0) };
            let speed = BodySpeed::of(&attitude, &motion);
            let whole = libm::hypot(speed.u_m_s, speed.lateral_m_s());
            prop_assert!((whole - motion.speed_m_s()).abs() < 1e-4);
            prop_assert!((attitude.tilt_rad - libm::acos(attitude.axes[0][2].clamp(-1.0, 1.0))).abs() < 1e-3);
        }
    }
}
