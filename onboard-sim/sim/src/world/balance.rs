//! The balance of a tail-first fall: where the air's force across the axis acts.
//!
//! With the centre of pressure above the centre of gravity (the fins trail) the air turns the tail
//! into the wind: the fall is stable. Below it, the air turns the nose down. The fins' force across
//! the axis grows with the sine of the angle to the wind, that of the bare body with its square, so
//! the centre of pressure comes down as the angle grows.
//!
//! Forces across a slender body at large angles: H. J. Allen and E. W. Perkins, NACA Report
//! 1048, 1951.

use flight::vehicle::airframe::Airframe;
use nalgebra::Vector3;

use crate::world::aero::{Configuration, Flow, Plume, Shape};
use crate::world::truth::Truth;

/// The vehicle's shape, held still in the air.
#[derive(Debug, Clone)]
pub struct Balance {
    shape: Shape,
}

/// The force of the air across the axis at one angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AcrossForce {
    /// Force over dynamic pressure, m^2; positive if it pushes the vehicle away from the wind, as
    /// it always does.
    pub area_m2: f64,
    /// The station at which this force alone has the complete aerodynamic moment, m above the
    /// nozzle.
    pub centre_of_pressure_m: f64,
}

impl Balance {
    /// The shape of an airframe.
    pub fn new(airframe: &Airframe) -> Self {
        Self { shape: Shape::new(airframe, &Truth::default()) }
    }

    /// The force with the wind from the tail at an angle to the axis, rad, above 0 and below pi.
    /// `roll_rad` turns the plane of that angle about the axis, from body z towards body y. `None`
    /// where there is no force across the axis.
    pub fn across(&self, opening_rad: f64, angle_rad: f64, roll_rad: f64) -> Option<AcrossForce> {
        /// The force is divided by it again.
        const SPEED_M_S: f64 = 1.0;
        const DENSITY_KG_M3: f64 = 2.0;
        let ((sin, cos), (roll_sin, roll_cos)) = (libm::sincos(angle_rad), libm::sincos(roll_rad));
        let sideways = Vector3::new(0.0, roll_sin, roll_cos);
        let flow = Flow {
            density_kg_m3: DENSITY_KG_M3,
            velocity_m_s: (sideways * sin - Vector3::x() * cos) * SPEED_M_S,
            rate_rad_s: Vector3::zeros(),
        };
        let configuration = Configuration {
            fin_sines: [libm::sin(opening_rad); 4],
            legs_out: true,
            parachute_area_m2: 0.0,
            plume: Plume { body: 1.0, fins: 1.0 },
            // So moments are about the nozzle.
            cg_m: Vector3::zeros(),
        };
        let load = self.shape.load(&flow, &configuration);
        let area_m2 = -load.force_n.dot(&sideways) / (0.5 * DENSITY_KG_M3 * SPEED_M_S * SPEED_M_S);
        // A force of -1 along `sideways` at the station 1 has the moment of `sideways` crossed with
        // x.
        let moment_n_m = load.moment_n_m.dot(&sideways.cross(&Vector3::x()));
        (area_m2 > 0.0).then(|| AcrossForce { area_m2, centre_of_pressure_m: moment_n_m / area_m2 })
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use super::*;

    fn balance() -> (Airframe, Balance) {
        let airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        let balance = Balance::new(&airframe);
        (airframe, balance)
    }

    /// Closed fins have no force, and the crossflow of a cylinder acts at half its length and grows
    /// with the square of the sine.
    #[test]
    fn val_hoerner_the_bare_body_is_held_at_its_middle() {
        let (airframe, balance) = balance();
        let body = &airframe.body;
        for angle_deg in [3.0_f64, 10.0, 40.0, 90.0] {
            let angle_rad = angle_deg.to_radians();
            let across = balance.across(0.0, angle_rad, 0.4).unwrap();
            let sin = libm::sin(angle_rad);
            let area_m2 = body.crossflow_drag_coefficient * body.diameter_m * body.length_m * sin * sin;
            assert!((across.area_m2 - area_m2).abs() < 1e-12, "{across:?}");
            assert!((across.centre_of_pressure_m - 0.5 * body.length_m).abs() < 1e-12, "{across:?}");
        }
        assert_eq!(balance.across(0.0, 0.0, 0.0), None);
    }

    /// By hand: the fins' drag along the wind at their station, the crossflow at the middle, and
    /// the couple of the four fins' lifts, whose axial parts push on opposite sides: 4 times lift
    /// times radius times sin 30 deg times cos 30 deg.
    #[test]
    fn val_hand_open_fins_drag_behind_and_their_lifts_are_a_couple() {
        let (airframe, balance) = balance();
        let (body, fins) = (&airframe.body, &airframe.fins);
        let radius_m = 0.5 * (body.diameter_m + fins.length_m);
        for (angle_deg, roll_deg) in [(2.0_f64, 0.0_f64), (12.0, 0.0), (12.0, 90.0), (12.0, 180.0)] {
            let across = balance.across(FRAC_PI_2, angle_deg.to_radians(), roll_deg.to_radians()).unwrap();
            let sin = libm::sin(angle_deg.to_radians());
            let body_m2 = body.crossflow_drag_coefficient * body.diameter_m * body.length_m * sin * sin;
            let fins_m2 = 4.0 * body.reference_area_m2 * fins.drag_coefficient * sin;
            let lift_m2 = 4.0 * body.reference_area_m2 * fins.lift_coefficient * sin;
            let couple_m3 = lift_m2 * radius_m * 0.25 * 3.0_f64.sqrt();
            let sign = if (roll_deg - 90.0).abs() < 1.0 { -1.0 } else { 1.0 };
            let moment_m3 = 0.5 * body.length_m * body_m2 + fins.station_m * fins_m2 + sign * couple_m3;
            // The side parts of the lifts cancel in the sum of forces.
            assert!((across.area_m2 - body_m2 - fins_m2).abs() < 1e-12, "{across:?}");
            let expected_m = moment_m3 / (body_m2 + fins_m2);
            assert!((across.centre_of_pressure_m - expected_m).abs() < 1e-12, "{across:?} {expected_m}");
        }
    }
}
