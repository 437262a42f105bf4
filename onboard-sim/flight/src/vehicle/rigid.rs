//! The state of a rigid rocket in space, and its frames.
//!
//! World: `x` and `y` horizontal, `z` up, right-handed, origin at the pad on the ground. Body: `x` along the axis of
//! symmetry towards the nose, `z` along world `x` when upright and not rolled, `y` to complete a right-handed set
//! (world `-y` when upright), origin at the centre of gravity. So the planar state of [`crate::vehicle::dynamics`] is
//! the motion in the world's x-z plane: `theta` is the nose's elevation, `u` and `w` are the body velocities along `x`
//! and `z`, and `q` is the rotation rate about body `y`.
//!
//! The nozzle points along body `-x`. Gimbal angles `(pitch, yaw)` turn the thrust to
//! `T (cos p cos y, sin y, -sin p cos y)` in body axes: a positive angle pitches the nose down, or yaws it, by
//! `q' = -T sin p (X_CG - X_THR) / I` and `r' = -T sin y (X_CG - X_THR) / I`.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::vehicle::dynamics::PlanarState;

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

impl From<PlanarState> for RigidState {
    /// The planar motion in the world's x-z plane.
    fn from(planar: PlanarState) -> Self {
        let (sin, cos) = libm::sincos(planar.theta_rad);
        let (u, w) = (planar.u_m_s, planar.w_m_s);
        let lean = UnitQuaternion::from_axis_angle(
            &Vector3::y_axis(),
            core::f64::consts::FRAC_PI_2 - planar.theta_rad,
        );
        Self {
            position_m: Vector3::new(planar.x_m, 0.0, planar.z_m),
            velocity_m_s: Vector3::new(u * cos + w * sin, 0.0, u * sin - w * cos),
            world_from_body: lean * upright(),
            rate_rad_s: Vector3::new(0.0, planar.q_rad_s, 0.0),
        }
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

    #[test]
    fn a_planar_state_keeps_its_body_velocities_and_its_elevation() {
        let planar =
            PlanarState { x_m: 1.0, z_m: 20.0, theta_rad: 1.2, u_m_s: -7.0, w_m_s: 0.8, q_rad_s: 0.3 };
        let rigid = RigidState::from(planar);
        let body = rigid.velocity_in_body_m_s();
        assert!((body - Vector3::new(-7.0, 0.0, 0.8)).norm() < 1e-12, "{body}");
        let nose = rigid.nose_in_world();
        assert!((nose - Vector3::new(libm::cos(1.2), 0.0, libm::sin(1.2))).norm() < 1e-12, "{nose}");
        assert!((rigid.tilt_rad() - (core::f64::consts::FRAC_PI_2 - 1.2)).abs() < 1e-12);
        // The nose rises at q.
        let rate_in_world = rigid.world_from_body * rigid.rate_rad_s;
        assert!(rate_in_world.cross(&nose).z > 0.0);
    }
}
