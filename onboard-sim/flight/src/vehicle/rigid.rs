//! The state of a rigid rocket in space, and its frames.
//!
//! World: `x` and `y` horizontal, `z` up, right-handed, origin at the pad on the ground. Body: `x`
//! along the axis of symmetry towards the nose, `z` along world `x` when upright and not rolled,
//! `y` to complete a right-handed set (world `-y` when upright), origin at the centre of gravity.
//!
//! The nozzle points along body `-x`. Gimbal angles `(pitch, yaw)` turn the thrust to `T (cos p cos
//! y, sin y, -sin p cos y)` in body axes: a positive angle pitches the nose down, or yaws it, by
//! `q' = -T sin p (X_CG - X_THR) / I` and `r' = -T sin y (X_CG - X_THR) / I`.
//!
//! Rotations are unit quaternions (B. L. Stevens and F. L. Lewis, Aircraft Control and Simulation,
//! chapter 1).

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Position, velocity, attitude and rotation of a rigid rocket.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RigidState {
    /// Centre of gravity in the world, m.
    pub position_m: Vector3<f64>,
    pub velocity_m_s: Vector3<f64>,
    /// Rotates body vectors into the world.
    pub world_from_body: UnitQuaternion<f64>,
    /// Rotation rate in body axes, rad/s.
    pub rate_rad_s: Vector3<f64>,
}

impl RigidState {
    /// Upright at rest, not rolled, with the centre of gravity at a height, m.
    pub fn upright(height_m: f64) -> Self {
        Self {
            position_m: Vector3::new(0.0, 0.0, height_m),
            velocity_m_s: Vector3::zeros(),
            world_from_body: upright(),
            rate_rad_s: Vector3::zeros(),
        }
    }

    /// The nose's direction in the world.
    pub fn nose_in_world(&self) -> Vector3<f64> {
        self.world_from_body * Vector3::x()
    }

    /// Angle between the nose and the vertical, rad, 0 to pi.
    pub fn tilt_rad(&self) -> f64 {
        let nose = self.nose_in_world();
        libm::atan2(libm::hypot(nose.x, nose.y), nose.z)
    }

    /// Velocity in body axes, m/s.
    pub fn velocity_in_body_m_s(&self) -> Vector3<f64> {
        self.world_from_body.inverse_transform_vector(&self.velocity_m_s)
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.position_m
            .iter()
            .chain(self.velocity_m_s.iter())
            .chain(self.world_from_body.coords.iter())
            .chain(self.rate_rad_s.iter())
            .all(|value| value.is_finite())
    }
}

/// The upright attitude without roll: body x, y, z along world z, -y, x.
pub fn upright() -> UnitQuaternion<f64> {
    let half = core::f64::consts::FRAC_1_SQRT_2;
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, half, 0.0, half))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upright_attitude_maps_the_body_axes_to_the_stated_world_axes() {
        let attitude = upright();
        for (body, world) in
            [(Vector3::x(), Vector3::z()), (Vector3::y(), -Vector3::y()), (Vector3::z(), Vector3::x())]
        {
            assert!((attitude * body - world).norm() < 1e-15, "{body} goes to {}", attitude * body);
        }
        assert!(RigidState::upright(3.0).tilt_rad().abs() < 1e-15);
    }
}
