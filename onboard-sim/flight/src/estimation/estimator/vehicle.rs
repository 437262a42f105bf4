//! The known data of the vehicle in one frame, and the force of the air that follows from them.

use nalgebra::{Vector2, Vector3};

use crate::vehicle::airframe::{Airframe, MassProperties};
use crate::vehicle::fins::{COS_30, PITCH, ROLL, SIN_30, YAW};
use crate::vehicle::mission::Exhaust;

/// The data of the vehicle that the estimator needs in this frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleNow {
    pub mass_kg: f64,
    pub air_density_kg_m3: f64,
    /// Axial drag coefficient of the body times its area, m^2.
    pub body_drag_area_m2: f64,
    /// Sum over the fins of drag coefficient times area at their present openings, m^2. Their drag is along the
    /// relative wind, so this counts sideways as well.
    pub fin_drag_area_m2: f64,
    /// Sum over the fins of lift coefficient times area times the direction from the axis to the fin, body y and z,
    /// m^2, each with the sign of its roll moment: zero while the openings are equal.
    pub fin_lift_area_m2: Vector2<f64>,
    /// Distance of the fins ahead of the centre of gravity, m.
    pub fin_ahead_of_cg_m: f64,
    /// Cross-flow drag coefficient of the body times its side area, m^2: the force sideways is that times the
    /// dynamic pressure of the sideways wind alone.
    pub crossflow_area_m2: f64,
    /// The igniter has been fired, so the landing motor may burn. The wind is then not estimated from the sideways
    /// force, because the motor's own sideways force is not known well enough.
    pub motor_burning: bool,
    /// Distance of the lidar behind the centre of gravity, m.
    pub lidar_behind_cg_m: f64,
}

impl VehicleNow {
    /// The data from an airframe, its masses, the air density, kg/m^3, the present fin openings, rad, and the lidar's
    /// distance ahead of the feet, m.
    pub fn of(
        airframe: &Airframe,
        mass: &MassProperties,
        air_density_kg_m3: f64,
        fins_rad: [f64; 4],
        motor_burning: bool,
        lidar_ahead_of_feet_m: f64,
    ) -> Self {
        let body = &airframe.body;
        let sines = fins_rad.map(libm::sin);
        let lift_area_m2 = body.reference_area_m2 * airframe.fins.lift_coefficient;
        let mut fin_lift_area_m2 = Vector2::zeros();
        for fin in 0..4 {
            let outward = Vector2::new(-YAW[fin] * COS_30, PITCH[fin] * SIN_30);
            fin_lift_area_m2 += outward * (lift_area_m2 * sines[fin] * ROLL[fin]);
        }
        Self {
            mass_kg: mass.mass_kg,
            air_density_kg_m3,
            body_drag_area_m2: body.reference_area_m2 * body.axial_drag_coefficient,
            fin_drag_area_m2: body.reference_area_m2
                * airframe.fins.drag_coefficient
                * sines.iter().sum::<f64>(),
            fin_lift_area_m2,
            fin_ahead_of_cg_m: airframe.fins.station_m - mass.cg_station_m,
            crossflow_area_m2: body.crossflow_drag_coefficient * body.length_m * body.diameter_m,
            motor_burning,
            lidar_behind_cg_m: airframe.above_feet_m(mass.cg_station_m) - lidar_ahead_of_feet_m,
        }
    }

    /// The vehicle with what its exhaust leaves of the drag of body and fins.
    #[must_use]
    pub fn in_exhaust(self, exhaust: &Exhaust) -> Self {
        let fins = 1.0 - exhaust.fin_loss;
        Self {
            body_drag_area_m2: self.body_drag_area_m2 * (1.0 - exhaust.body_loss),
            fin_drag_area_m2: self.fin_drag_area_m2 * fins,
            fin_lift_area_m2: self.fin_lift_area_m2 * fins,
            ..self
        }
    }

    /// Force of the air in body axes, N, for a velocity through the air in body axes, m/s, and a rotation rate, rad/s:
    /// drag of the body along its axis (Eq. 8 of the landing paper) and across it, drag and lift of the fins.
    pub fn air_force_n(&self, through_air_m_s: &Vector3<f64>, rate_rad_s: &Vector3<f64>) -> Vector3<f64> {
        let velocity = through_air_m_s;
        let at_fins = velocity + rate_rad_s.cross(&Vector3::new(self.fin_ahead_of_cg_m, 0.0, 0.0));
        let sideways = Vector3::new(0.0, velocity.y, velocity.z);
        let (speed, speed_at_fins) = (velocity.norm(), at_fins.norm());
        let body = Vector3::new(self.body_drag_area_m2 * speed * velocity.x, 0.0, 0.0)
            + sideways * (self.crossflow_area_m2 * sideways.norm());
        let lift = at_fins.cross(&self.fin_lift_area_m2.insert_row(0, 0.0)) * speed_at_fins;
        let fins = at_fins * (self.fin_drag_area_m2 * speed_at_fins) + lift;
        (body + fins) * (-0.5 * self.air_density_kg_m3)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::VEHICLE;
    use super::*;

    #[test]
    fn val_hand_air_force() {
        let vehicle = VehicleNow { fin_lift_area_m2: Vector2::new(0.0, 0.002), ..VEHICLE };
        // 40 m/s down the axis and 3 m/s sideways: V = 40.112342. Body: 0.0043 V 40 along, 0.09 * 9 sideways.
        // Fins: 0.031 V (40, 3); lift: v x G with G = (0, 0, 0.002) is (3 * 0.002, 40 * 0.002, 0), times V.
        let force = vehicle.air_force_n(&Vector3::new(-40.0, 3.0, 0.0), &Vector3::zeros());
        // -0.6 (-6.899323 - 49.739304 + 0.240674, 0.81 + 3.730448 + 3.208987, 0)
        assert!((force - Vector3::new(33.838_772, -4.649_661, 0.0)).norm() < 1e-5, "{force}");
        // A yaw rate of half a radian per second moves only the fins, at 0.055 m/s sideways.
        let turning = vehicle.air_force_n(&Vector3::new(-40.0, 3.0, 0.0), &Vector3::new(0.0, 0.0, 0.5));
        assert!((turning.y - force.y + 0.6 * 0.031 * 40.1165 * 0.055).abs() < 1e-3, "{turning}");
    }

    #[test]
    fn equal_openings_have_the_airframes_drag_and_no_side_force() {
        let airframe = crate::vehicles::airframe::builtin("mk2").unwrap();
        let mass = crate::vehicle::airframe::MassModel::new(&airframe.mass, 0.2).at(0.0);
        let opening_rad = 1.2;
        let vehicle = VehicleNow::of(&airframe, &mass, 1.2, [opening_rad; 4], false, 0.15);
        let area_m2 = vehicle.body_drag_area_m2 + vehicle.fin_drag_area_m2;
        assert!((area_m2 - airframe.drag_area_m2(opening_rad)).abs() < 1e-12);
        assert!(vehicle.fin_lift_area_m2.norm() < 1e-15, "{vehicle:?}");
        let steered = VehicleNow::of(&airframe, &mass, 1.2, [1.3, 1.1, 1.1, 1.3], false, 0.15);
        assert!(steered.fin_lift_area_m2.norm() > 1e-4, "{steered:?}");
    }
}
