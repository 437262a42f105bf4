//! States in the viewer's space.
//!
//! The world is x as in the log, y to the left of it and z up. The rocket's own axes are x towards the nose, y as
//! the world's, and z to complete them; the pitch from the horizontal turns about -y. In these axes the second
//! body axis of the equations of motion is -z. A vehicle's own log has the viewer's axes already; what a ground station
//! knows of its attitude is the pitch.

use std::f64::consts::FRAC_PI_2;

use protocol::log::flight_v1::RigidState;

/// Where something is and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position, m.
    pub translation_m: [f32; 3],
    /// Orientation as a unit quaternion x, y, z, w.
    pub quaternion_xyzw: [f32; 4],
}

/// The pose of the rocket, from its place and its pitch above the horizontal.
pub fn world_from_telemetry(x_m: f64, z_m: f64, theta_rad: f64) -> Pose {
    Pose { translation_m: [x_m as f32, 0.0, z_m as f32], quaternion_xyzw: about_y_xyzw(-theta_rad) }
}

/// The pose of the nozzle in the rocket. Its x axis is the direction of the thrust: a positive gimbal angle pushes
/// the tail so that the nose pitches down.
pub fn rocket_from_nozzle(gimbal_rad: f64, pivot_x_m: f64) -> Pose {
    Pose { translation_m: [pivot_x_m as f32, 0.0, 0.0], quaternion_xyzw: about_y_xyzw(-gimbal_rad) }
}

/// The pose of a rocket that turns in space.
pub fn world_from_rocket_in_space(state: &RigidState) -> Pose {
    let (at, turned) = (&state.position_m, &state.world_from_body);
    Pose {
        translation_m: [at.x, at.y, at.z].map(|value| value as f32),
        quaternion_xyzw: [turned.x, turned.y, turned.z, turned.w].map(|value| value as f32),
    }
}

/// The pose of a nozzle with two axes in the rocket: its x axis, the direction of the thrust, is
/// `(cos pitch cos yaw, sin yaw, -sin pitch cos yaw)` in body axes.
pub fn rocket_from_nozzle_in_space([pitch_rad, yaw_rad]: [f64; 2], pivot_x_m: f64) -> Pose {
    let ((sin_pitch, cos_pitch), (sin_yaw, cos_yaw)) =
        (libm::sincos(pitch_rad / 2.0), libm::sincos(yaw_rad / 2.0));
    let quaternion = [sin_pitch * sin_yaw, sin_pitch * cos_yaw, cos_pitch * sin_yaw, cos_pitch * cos_yaw];
    Pose {
        translation_m: [pivot_x_m as f32, 0.0, 0.0],
        quaternion_xyzw: quaternion.map(|value| value as f32),
    }
}

/// Pitch away from upright, positive nose up from the x axis, degrees.
pub fn pitch_error_deg(theta_rad: f64) -> f64 {
    (theta_rad - FRAC_PI_2).to_degrees()
}

/// A rotation about y by `angle_rad`, as a quaternion x, y, z, w.
fn about_y_xyzw(angle_rad: f64) -> [f32; 4] {
    let (sin, cos) = libm::sincos(angle_rad / 2.0);
    [0.0, sin as f32, 0.0, cos as f32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight::vehicle::dynamics::PlanarState as FlightState;
    use protocol::log::flight_v1::{Quaternion, Vector3};

    /// `v + 2 q x (q x v + w v)`.
    fn rotate([qx, qy, qz, qw]: [f32; 4], [x, y, z]: [f32; 3]) -> [f32; 3] {
        let cross = |a: [f32; 3], b: [f32; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let inner = cross([qx, qy, qz], [x, y, z]);
        let outer = cross([qx, qy, qz], [inner[0] + qw * x, inner[1] + qw * y, inner[2] + qw * z]);
        [x + 2.0 * outer[0], y + 2.0 * outer[1], z + 2.0 * outer[2]]
    }

    fn assert_close(found: [f32; 3], expected: [f32; 3]) {
        let distance = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(distance < 1e-6, "{found:?} is not {expected:?}");
    }

    fn nose(theta_rad: f64) -> [f32; 3] {
        let pose = world_from_telemetry(0.0, 0.0, theta_rad);
        rotate(pose.quaternion_xyzw, [1.0, 0.0, 0.0])
    }

    #[test]
    fn an_upright_rocket_points_up_and_a_level_one_along_x() {
        assert_close(nose(FRAC_PI_2), [0.0, 0.0, 1.0]);
        assert_close(nose(0.0), [1.0, 0.0, 0.0]);
        assert_close(nose(std::f64::consts::PI), [-1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_position_is_x_and_altitude() {
        assert_close(world_from_telemetry(-3.5, 12.25, 0.0).translation_m, [-3.5, 0.0, 12.25]);
    }

    /// The velocity over the ground is the same whether the equations of motion turn it or the pose does.
    #[test]
    fn body_velocities_turn_as_in_the_equations_of_motion() {
        for step in 0..24 {
            let theta_rad = f64::from(step) * 0.3;
            let (u_m_s, w_m_s) = (1.25, -0.5);
            let (vx, vz) =
                FlightState { theta_rad, u_m_s, w_m_s, ..FlightState::default() }.ground_velocity_m_s();
            let pose = world_from_telemetry(0.0, 0.0, theta_rad);
            let turned = rotate(pose.quaternion_xyzw, [u_m_s as f32, 0.0, -w_m_s as f32]);
            assert_close(turned, [vx as f32, 0.0, vz as f32]);
        }
    }

    #[test]
    fn the_thrust_follows_both_axes_of_the_gimbal() {
        let (pitch_rad, yaw_rad) = (0.2_f64, -0.1_f64);
        let thrust =
            rotate(rocket_from_nozzle_in_space([pitch_rad, yaw_rad], -0.4).quaternion_xyzw, [1.0, 0.0, 0.0]);
        let ((sin_pitch, cos_pitch), (sin_yaw, cos_yaw)) = (libm::sincos(pitch_rad), libm::sincos(yaw_rad));
        assert_close(thrust, [cos_pitch * cos_yaw, sin_yaw, -sin_pitch * cos_yaw].map(|value| value as f32));
    }

    #[test]
    fn a_rocket_in_space_has_the_position_and_attitude_of_its_state() {
        let half = f64::sqrt(0.5);
        let state = RigidState {
            position_m: Vector3 { x: 1.0, y: -2.0, z: 30.0 },
            // Turned by -90 degrees about y: the nose points up.
            world_from_body: Quaternion { w: half, x: 0.0, y: -half, z: 0.0 },
            ..RigidState::default()
        };
        let pose = world_from_rocket_in_space(&state);
        assert_close(pose.translation_m, [1.0, -2.0, 30.0]);
        assert_close(rotate(pose.quaternion_xyzw, [1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
    }

    /// `w' = -(T/m) sin(delta)` along the second body axis, which is -z here.
    #[test]
    fn a_positive_gimbal_angle_pushes_the_tail_of_an_upright_rocket_backwards() {
        let delta_rad: f64 = 0.2;
        let thrust = rotate(rocket_from_nozzle(delta_rad, -0.5).quaternion_xyzw, [1.0, 0.0, 0.0]);
        assert_close(thrust, [libm::cos(delta_rad) as f32, 0.0, libm::sin(delta_rad) as f32]);
        let upright = world_from_telemetry(0.0, 0.0, FRAC_PI_2).quaternion_xyzw;
        assert!(rotate(upright, thrust)[0] < -0.1, "the tail goes back, so the nose pitches down");
    }
}
