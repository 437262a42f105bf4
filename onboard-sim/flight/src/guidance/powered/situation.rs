//! The inputs of a plan except the state: vehicle, motor and air.

use nalgebra::Vector3;

use crate::vehicle::burn::Burn;
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
    pub air_density_kg_m3: f64,
    pub wind_m_s: Vector3<f64>,
    /// Drag area of body and legs along the axis, m^2.
    pub body_drag_area_m2: f64,
    /// Drag area of the body across its axis, m^2.
    pub crossflow_area_m2: f64,
    /// Drag area of the fins: all open for a plan, which opens them itself; at their present
    /// opening for an aim, m^2.
    pub fin_drag_area_m2: f64,
    /// Largest gimbal angle, rad.
    pub gimbal_limit_rad: f64,
    /// After an abort: the vehicle lands on the ground below, not on the pad.
    pub lands_in_place: bool,
    /// High in the band of feasible heights or above it: more thrust must be wasted than is easily
    /// possible.
    pub high: bool,
}

impl PoweredSituation<'_> {
    pub(super) fn mass_kg(&self) -> f64 {
        self.mass_at_ignition_kg - self.burn.burnt_kg(self.burning_s)
    }

    /// The earliest and the latest end of a plan from a height of the feet, m; times from now, s.
    /// `None` if the thrust never carries the vehicle.
    pub(super) fn ends_s(&self, latest_after_s: f64, height_m: f64) -> Option<(f64, f64)> {
        let carried_until_s = self.burn.falls_through_weight_s(self.mass_at_ignition_kg)?;
        let earliest_s = (carried_until_s - self.burning_s).max(0.05);
        // Late in the burn the end waits only for the ground, not for the thrust to fall.
        let to_ground_s = height_m.max(0.0) / 2.0;
        let latest_s =
            (carried_until_s + latest_after_s - self.burning_s).max(earliest_s + to_ground_s.min(0.4));
        Some((earliest_s, latest_s))
    }

    /// Whether the lowest foot of a vehicle that sinks on as it does touches the ground within a
    /// time, s.
    pub(super) fn touches_within(&self, within_s: f64, state: &RigidState) -> bool {
        let nose = state.nose_in_world();
        let lowest_m = state.position_m.z
            - self.feet_below_cg_m * nose.z
            - self.foot_radius_m * libm::hypot(nose.x, nose.y);
        lowest_m < -within_s * state.velocity_m_s.z
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

    /// Mean thrust between two times from now, N.
    pub(super) fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
        self.burn.mean_thrust_n(self.burning_s + from_s, to_s - from_s)
    }

    /// Mass in the middle between two times from now, kg.
    pub(super) fn mean_mass_kg(&self, from_s: f64, to_s: f64) -> f64 {
        let middle_s = self.burning_s + 0.5 * (from_s + to_s);
        self.mass_at_ignition_kg - self.burn.burnt_kg(middle_s)
    }
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
        // With 10 degrees of lean a foot is 0.4 sin 10 = 69.5 mm lower, and the body's end 0.44
        // (1 - cos 10) = 6.7 mm higher.
        let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 10.0_f64.to_radians());
        let leaning = RigidState { world_from_body: lean * upright.world_from_body, ..upright };
        assert!(!situation.touches_within(0.073, &leaning));
        assert!(situation.touches_within(0.076, &leaning));
        let rising = RigidState { velocity_m_s: 0.5 * Vector3::z(), ..leaning };
        assert!(!situation.touches_within(10.0, &rising));
    }
}
