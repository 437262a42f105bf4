//! The guidance's data: vehicle, motor and air, the vertical plane of a landing, and the plan being flown.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, TAU};
use nalgebra::Vector3;
use nmpc::free_time::{FreeTimeSolution, Motor};
use serde::Serialize;

use crate::vehicle::burn::Burn;
use crate::vehicle::dynamics::{ModelKind, PlanarModel, PlanarParams, PlanarState};
use crate::vehicle::rigid::RigidState;

/// The inputs of a tick except the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoweredSituation<'a> {
    /// The motor.
    pub burn: Burn<'a>,
    /// Time since thrust began, s.
    pub burning_s: f64,
    /// Mass before ignition, kg.
    pub mass_at_ignition_kg: f64,
    /// Moment of inertia across the axis, kg m^2.
    pub inertia_kg_m2: f64,
    /// Arm of the thrust about the centre of gravity, m.
    pub arm_m: f64,
    /// Centre of gravity above the feet when upright, m.
    pub feet_below_cg_m: f64,
    /// Distance of the feet from the axis, m.
    pub foot_radius_m: f64,
    pub gravity_m_s2: f64,
    pub air_density_kg_m3: f64,
    pub wind_m_s: Vector3<f64>,
    /// Drag area of body and legs along the axis, m^2.
    pub body_drag_area_m2: f64,
    /// Drag area of the body across its axis, m^2.
    pub crossflow_area_m2: f64,
    /// Drag area of the fins at their present opening, m^2.
    pub fin_drag_area_m2: f64,
    /// Largest gimbal angle, rad.
    pub gimbal_limit_rad: f64,
    /// After an abort: the vehicle lands on the ground below, not on the pad.
    pub lands_in_place: bool,
    /// High in the band of feasible heights or above it: more thrust has to be turned away than is easy.
    pub high: bool,
}

impl PoweredSituation<'_> {
    pub(super) fn mass_kg(&self) -> f64 {
        self.mass_at_ignition_kg - self.burn.burnt_kg(self.burning_s)
    }

    /// The earliest and the latest end of a plan from a height of the feet, m; times from now, s. `None` if the thrust never
    /// carries the vehicle.
    pub(super) fn ends_s(&self, latest_after_s: f64, height_m: f64) -> Option<(f64, f64)> {
        let carried_until_s =
            self.burn.falls_through_weight_s(self.mass_at_ignition_kg, self.gravity_m_s2)?;
        let earliest_s = (carried_until_s - self.burning_s).max(0.05);
        // Late in the burn the end waits only for the ground, not for the thrust to fall.
        let to_ground_s = height_m.max(0.0) / 2.0;
        let latest_s =
            (carried_until_s + latest_after_s - self.burning_s).max(earliest_s + to_ground_s.min(0.4));
        Some((earliest_s, latest_s))
    }

    /// Whether the lowest foot of a vehicle that sinks on as it does touches the ground within a time, s.
    pub(super) fn touches_within(&self, within_s: f64, state: &RigidState) -> bool {
        let nose = state.nose_in_world();
        let lowest_m = state.position_m.z
            - self.feet_below_cg_m * nose.z
            - self.foot_radius_m * libm::hypot(nose.x, nose.y);
        lowest_m < -within_s * state.velocity_m_s.z
    }

    pub(super) fn model(&self) -> PlanarModel {
        let mass_kg = self.mass_kg();
        let per_m = |area_m2: f64| 0.5 * self.air_density_kg_m3 * area_m2 / mass_kg;
        PlanarModel {
            params: PlanarParams {
                mass_kg,
                pitch_inertia_kg_m2: self.inertia_kg_m2,
                thrust_arm_m: self.arm_m,
                drag_per_m: per_m(self.body_drag_area_m2 + self.fin_drag_area_m2),
                lateral_drag_per_m: per_m(self.fin_drag_area_m2),
                crossflow_per_m: per_m(self.crossflow_area_m2),
                gravity_m_s2: self.gravity_m_s2,
            },
            kind: ModelKind::Consistent,
        }
    }

    /// Horizontal acceleration from the air, m/s^2.
    pub(super) fn air_m_s2(&self, state: &RigidState) -> Vector3<f64> {
        let through_air = state.velocity_m_s - self.wind_m_s;
        let nose = state.nose_in_world();
        let across = through_air - nose * through_air.dot(&nose);
        let per_mass = -0.5 * self.air_density_kg_m3 / self.mass_kg();
        through_air * (per_mass * self.fin_drag_area_m2 * through_air.norm())
            + across * (per_mass * self.crossflow_area_m2 * across.norm())
    }
}

/// The rest of the burn from a moment on, in the form that the planner needs.
pub(super) struct Ahead<'a, 'b>(pub(super) &'a PoweredSituation<'b>);

impl Motor for Ahead<'_, '_> {
    fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
        self.0.burn.mean_thrust_n(self.0.burning_s + from_s, to_s - from_s)
    }

    fn mean_mass_kg(&self, from_s: f64, to_s: f64) -> f64 {
        let middle_s = self.0.burning_s + 0.5 * (from_s + to_s);
        self.0.mass_at_ignition_kg - self.0.burn.burnt_kg(middle_s)
    }
}

// The vertical plane of a planned landing.

/// If the correction (velocity and weighted distance) is smaller than this, the plane lies along the wind, m/s.
const CHOOSING_SPEED_M_S: f64 = 1.0;

/// Weight of the distance from the pad, as a velocity, when the plane is chosen, 1/s. It is the ratio of the terms
/// `6 p / t^2` and `4 v / t` of the least-effort law in four seconds.
const HOMING_PER_S: f64 = 0.375;

/// The elevation of a direction, rad, from -pi/2 to 3 pi/2. It is continuous except straight down, where it jumps by a
/// full turn.
fn elevation_rad(up: f64, along: f64) -> f64 {
    let elevation_rad = libm::atan2(up, along);
    if elevation_rad < -FRAC_PI_2 { elevation_rad + TAU } else { elevation_rad }
}

/// A vertical plane through the pad's axis, and the direction across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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

// The plan being flown, and its values at a given time.

/// A plan being flown.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct Flown {
    pub(super) begins_s: f64,
    /// Rotational acceleration of a unit sine of the gimbal angle in each interval, rad/s^2.
    pub(super) turning_rad_s2: Vec<f64>,
    pub(super) plan: FreeTimeSolution,
    /// It lands, planned with the higher cost of tilt.
    pub(super) upright: bool,
}

impl Flown {
    pub(super) fn left_s(&self, time_s: f64) -> f64 {
        self.begins_s + self.plan.final_time_s - time_s
    }

    /// Planned velocity over the ground along the plane at a time, m/s; zero after the plan's end.
    pub(super) fn along_m_s(&self, time_s: f64, wind_m_s: f64) -> f64 {
        let solution = &self.plan.solution;
        let since = (time_s - self.begins_s).max(0.0) / solution.step_s;
        let k = since as usize;
        let along_m_s = |state: &PlanarState| {
            let (sin, cos) = libm::sincos(state.theta_rad);
            state.u_m_s * cos + state.w_m_s * sin + wind_m_s
        };
        match (solution.states.get(k), solution.states.get(k + 1)) {
            (Some(before), Some(after)) => {
                let share = since - k as f64;
                (1.0 - share) * along_m_s(before) + share * along_m_s(after)
            }
            _ => 0.0,
        }
    }

    /// Elevation, its rate and its acceleration at a time; upright and at rest after the plan's end.
    pub(super) fn elevation(&self, time_s: f64) -> (f64, f64, f64) {
        let solution = &self.plan.solution;
        let since_s = (time_s - self.begins_s).max(0.0);
        let k = (since_s / solution.step_s) as usize;
        let planned = solution.states.get(k).zip(solution.inputs_rad.get(k)).zip(self.turning_rad_s2.get(k));
        let Some(((state, input_rad), turning)) = planned else {
            return (FRAC_PI_2, 0.0, 0.0);
        };
        let along_s = since_s - k as f64 * solution.step_s;
        let acceleration = -turning * libm::sin(*input_rad);
        (
            state.theta_rad + along_s * (state.q_rad_s + 0.5 * along_s * acceleration),
            state.q_rad_s + along_s * acceleration,
            acceleration,
        )
    }
}

/// Largest planned tilt, rad.
pub(super) fn largest_tilt_rad(plan: &FreeTimeSolution) -> f64 {
    plan.solution.states.iter().map(|planned| (planned.theta_rad - FRAC_PI_2).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    use crate::vehicles::motors;

    #[test]
    fn val_hand_a_leaning_vehicle_touches_earlier() {
        let curve = motors::builtin("H45W").expect("a built-in motor");
        let situation = PoweredSituation {
            burn: Burn::nominal(&curve),
            burning_s: 4.0,
            mass_at_ignition_kg: 3.1,
            inertia_kg_m2: 0.12,
            arm_m: 0.4,
            feet_below_cg_m: 0.44,
            foot_radius_m: 0.4,
            gravity_m_s2: 9.8,
            air_density_kg_m3: 1.2,
            wind_m_s: Vector3::zeros(),
            body_drag_area_m2: 0.004,
            crossflow_area_m2: 0.05,
            fin_drag_area_m2: 0.01,
            gimbal_limit_rad: 0.1,
            lands_in_place: false,
            high: false,
        };
        // 0.1 m above the ground and sinking at 0.5 m/s.
        let upright = RigidState { velocity_m_s: -0.5 * Vector3::z(), ..RigidState::upright(0.54) };
        assert!(!situation.touches_within(0.19, &upright));
        assert!(situation.touches_within(0.21, &upright));
        // With 10 degrees of lean a foot is 0.4 sin 10 = 69.5 mm lower, and the body's end 0.44 (1 - cos 10) = 6.7 mm higher.
        let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 10.0_f64.to_radians());
        let leaning = RigidState { world_from_body: lean * upright.world_from_body, ..upright };
        assert!(!situation.touches_within(0.073, &leaning));
        assert!(situation.touches_within(0.076, &leaning));
        let rising = RigidState { velocity_m_s: 0.5 * Vector3::z(), ..leaning };
        assert!(!situation.touches_within(10.0, &rising));
    }

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
