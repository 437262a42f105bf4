//! The vertical plane of a planned landing.

use core::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;

use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::rigid::RigidState;

/// If the correction (velocity and weighted distance) is smaller than this, the plane lies along the wind, m/s.
/// Halved and doubled: 144, 143.
const CHOOSING_SPEED_M_S: f64 = 1.0;

/// Weight of the distance from the pad, as a velocity, when the plane is chosen, 1/s. It is the ratio of the terms
/// `6 p / t^2` and `4 v / t` of the least-effort law in four seconds. Halved and doubled: 146, 143.
const HOMING_PER_S: f64 = 0.375;

/// The elevation of a direction, rad, from -pi/2 to 3 pi/2. It is continuous except straight down, where it jumps by a
/// full turn.
fn elevation_rad(up: f64, along: f64) -> f64 {
    let elevation_rad = libm::atan2(up, along);
    if elevation_rad < -FRAC_PI_2 { elevation_rad + TAU } else { elevation_rad }
}

/// A vertical plane through the pad's axis, and the direction across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Horizontal direction in the plane, of length 1.
    pub along: Vector3<f64>,
    /// Horizontal direction across it: up cross along.
    pub across: Vector3<f64>,
}

impl Plane {
    /// The plane with the largest correction: along the horizontal velocity to be lost and the way back to the pad. If
    /// both are small, the plane lies along the wind; in still air over the pad it is the world's x-z plane.
    pub fn choose(position_m: &Vector3<f64>, velocity_m_s: &Vector3<f64>, wind_m_s: &Vector3<f64>) -> Self {
        let level = |vector: &Vector3<f64>| Vector3::new(vector.x, vector.y, 0.0);
        let directions = [level(&(velocity_m_s + position_m * HOMING_PER_S)), level(wind_m_s)];
        let along = directions
            .iter()
            .find(|direction| direction.norm() > CHOOSING_SPEED_M_S)
            .map_or_else(Vector3::x, |direction| direction / direction.norm());
        Self { along, across: Vector3::z().cross(&along) }
    }

    /// The motion in the plane, through air that moves with `wind_m_s` along it. Positions are over the ground, and the
    /// altitude is the height of the feet.
    ///
    /// The nose's component across the plane is neglected: elevation and rate are those of its projection.
    pub fn project(&self, state: &RigidState, feet_below_cg_m: f64, wind_m_s: f64) -> PlanarState {
        let nose = state.nose_in_world();
        let theta_rad = elevation_rad(nose.z, nose.dot(&self.along));
        let (sin, cos) = libm::sincos(theta_rad);
        let along_m_s = state.velocity_m_s.dot(&self.along) - wind_m_s;
        let up_m_s = state.velocity_m_s.z;
        // Elevation grows with a rotation about the negative across axis.
        let rate = state.world_from_body * state.rate_rad_s;
        PlanarState {
            x_m: state.position_m.dot(&self.along),
            z_m: state.position_m.z - feet_below_cg_m,
            theta_rad,
            u_m_s: along_m_s * cos + up_m_s * sin,
            w_m_s: along_m_s * sin - up_m_s * cos,
            q_rad_s: -rate.dot(&self.across),
        }
    }

    /// The nose's direction at an elevation in the plane, with a lean across it, given as a tangent.
    pub fn nose(&self, theta_rad: f64, across_tangent: f64) -> Vector3<f64> {
        let (sin, cos) = libm::sincos(theta_rad);
        let nose = self.along * cos + Vector3::z() * sin + self.across * across_tangent;
        nose / nose.norm()
    }

    /// The rotation vector in the world of an elevation's rate (or acceleration).
    pub fn turning(&self, elevation_rate: f64) -> Vector3<f64> {
        self.across * -elevation_rate
    }

    /// A planned state over the ground, `since_s` after its plan began, in air that moves with `wind_m_s` along the
    /// plane.
    pub fn over_ground(planned: &PlanarState, wind_m_s: f64, since_s: f64) -> PlanarState {
        let (sin, cos) = libm::sincos(planned.theta_rad);
        PlanarState {
            x_m: planned.x_m + wind_m_s * since_s,
            u_m_s: planned.u_m_s + wind_m_s * cos,
            w_m_s: planned.w_m_s + wind_m_s * sin,
            ..*planned
        }
    }

    /// The state of an upright vehicle at rest on the ground, in the frame of air that moves with `wind_m_s` along the
    /// plane.
    pub fn rest(wind_m_s: f64) -> PlanarState {
        PlanarState { theta_rad: FRAC_PI_2, w_m_s: -wind_m_s, ..PlanarState::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_x_z_plane_gives_the_planar_state_back() {
        let planar =
            PlanarState { x_m: 1.0, z_m: 20.0, theta_rad: 1.2, u_m_s: -7.0, w_m_s: 0.8, q_rad_s: 0.3 };
        let plane = Plane::choose(&Vector3::zeros(), &Vector3::zeros(), &Vector3::zeros());
        let found = plane.project(&RigidState::from(planar), 0.0, 0.0);
        for (found, put) in found.to_array().iter().zip(planar.to_array()) {
            assert!((found - put).abs() < 1e-12, "{found} for {put}");
        }
        let nose = plane.nose(1.2, 0.0);
        assert!((nose - RigidState::from(planar).nose_in_world()).norm() < 1e-12);
        let turning = RigidState::from(planar).world_from_body * Vector3::new(0.0, 0.3, 0.0);
        assert!((plane.turning(0.3) - turning).norm() < 1e-12);
    }

    #[test]
    fn the_pitch_passes_the_horizontal_backwards_without_a_jump() {
        let plane = Plane::choose(&Vector3::zeros(), &Vector3::zeros(), &Vector3::zeros());
        for theta_rad in [-1.5, 0.1, 3.1, 3.2, 4.7] {
            let planar = PlanarState { theta_rad, ..PlanarState::default() };
            let found = plane.project(&RigidState::from(planar), 0.0, 0.0);
            assert!((found.theta_rad - theta_rad).abs() < 1e-12, "{} for {theta_rad}", found.theta_rad);
        }
    }

    #[test]
    fn a_plan_at_rest_on_the_ground_has_no_velocity_over_the_ground() {
        let wind_m_s = 4.0;
        let planned = PlanarState { x_m: -12.0, ..Plane::rest(wind_m_s) };
        let found = Plane::over_ground(&planned, wind_m_s, 3.0);
        let expected = PlanarState { theta_rad: FRAC_PI_2, ..PlanarState::default() };
        for (found, expected) in found.to_array().iter().zip(expected.to_array()) {
            assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
        }
    }

    #[test]
    fn the_velocity_chooses_the_plane_and_without_it_the_wind() {
        let plane =
            Plane::choose(&Vector3::zeros(), &Vector3::new(0.0, -3.0, -40.0), &Vector3::new(9.0, 0.0, 0.0));
        assert!((plane.along - -Vector3::y()).norm() < 1e-15);
        let plane =
            Plane::choose(&Vector3::zeros(), &Vector3::new(0.0, -0.3, -40.0), &Vector3::new(9.0, 0.0, 0.0));
        assert!((plane.along - Vector3::x()).norm() < 1e-15);
        let plane = Plane::choose(&Vector3::new(0.0, 30.0, 60.0), &Vector3::zeros(), &Vector3::zeros());
        assert!((plane.along - Vector3::y()).norm() < 1e-15, "far from the pad, the way back");
    }

    #[test]
    fn a_vehicle_at_rest_on_the_ground_moves_through_the_wind() {
        let plane = Plane::choose(&Vector3::zeros(), &Vector3::zeros(), &Vector3::zeros());
        let standing = plane.project(&RigidState::upright(0.58), 0.58, 4.0);
        let rest = Plane::rest(4.0);
        for (standing, rest) in standing.to_array().iter().zip(rest.to_array()) {
            assert!((standing - rest).abs() < 1e-12);
        }
    }
}
