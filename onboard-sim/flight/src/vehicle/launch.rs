//! The ascent as data: the rail on the pad, and the booster stage that carries the vehicle up.
//!
//! Stations are heights above the landing vehicle's nozzle exit, towards the nose positive. The
//! booster sits below it, so its stations are negative.

use alloc::string::String;

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::airframe::BadValue;
use super::rigid::{RigidState, upright};
use super::thrust_curve::ThrustCurve;

/// A launch from a rail.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Launch {
    pub rail: Rail,
    /// Time before the expected apogee at which the booster is separated, s. A stack that is still
    /// fast points along its path; close to apogee it would follow the path over the top.
    pub separate_before_apogee_s: f64,
    pub booster: Booster,
}

/// The rail.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Rail {
    /// Travel until nothing guides the stack any more, m.
    pub length_m: f64,
    /// Angle from the vertical, degrees.
    pub tilt_deg: f64,
    /// Direction of the tilt in the world, from x towards y, degrees.
    pub towards_deg: f64,
    /// Position of its foot from the middle of the landing pad, to the north, m.
    pub x_m: f64,
    /// To the west, m.
    pub y_m: f64,
    /// The crew places it upwind of the landing pad by this time times the mean wind at 10 m that
    /// it measures, s, and writes where it stands into `x_m` and `y_m`. A simulated crew does so
    /// where both are zero.
    #[serde(default)]
    pub upwind_s: f64,
}

impl Rail {
    /// Position of its foot, world, m.
    pub fn foot_m(&self) -> Vector3<f64> {
        Vector3::new(self.x_m, self.y_m, 0.0)
    }
}

/// The booster stage, and the air on the whole stack. Coefficients are on the reference area of the
/// vehicle's body.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Booster {
    /// Name of a built-in motor, or the text of its `.eng` or `.rse` file.
    pub motor: String,
    /// The certified thrust curve of that motor. The reader of the mission looks it up.
    #[serde(skip)]
    pub motor_curve: ThrustCurve,
    /// From its lower end, which is its nozzle, to the landing vehicle's nozzle exit, m.
    pub length_m: f64,
    /// Mass with the empty motor case, kg.
    pub dry_kg: f64,
    /// Centre of gravity of that mass, m.
    pub cg_station_m: f64,
    /// Moment of inertia of that mass about a cross axis through its centre of gravity, kg m^2.
    pub pitch_inertia_kg_m2: f64,
    #[serde(default)]
    pub roll_inertia_kg_m2: f64,
    /// Middle of the propellant, m.
    #[serde(default)]
    pub propellant_station_m: f64,
    /// Axial drag coefficient of the whole stack, nose first.
    pub stack_drag_coefficient: f64,
    /// Of the nose.
    pub nose: NormalForce,
    pub fins: BoosterFins,
    /// Of the booster's fins. The reader of the mission computes it.
    #[serde(skip)]
    pub fin_force: NormalForce,
    /// Distance from the axis at which the force on a fin acts, m. The reader of the mission
    /// computes it.
    #[serde(skip)]
    pub fin_radius_m: f64,
    /// Momentum that the separation charge gives the vehicle, N s.
    pub separation_impulse_n_s: f64,
}

/// A force across the axis in proportion to the angle of attack.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NormalForce {
    /// Slope of the coefficient, 1/rad.
    pub slope_per_rad: f64,
    /// Where the force acts, m.
    #[serde(default)]
    pub station_m: f64,
}

/// The booster's three fins: trapezoids.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BoosterFins {
    pub root_chord_m: f64,
    pub tip_chord_m: f64,
    /// From the skin to the tip, m.
    pub span_m: f64,
    /// How far the tip's leading edge lies below the root's, m.
    pub sweep_m: f64,
    /// Where the root ends, above the booster's lower end, m.
    pub above_end_m: f64,
}

impl BoosterFins {
    /// Force across the axis on a body of this diameter, m, whose lower end is at a station, m (J.
    /// S. and J. A. Barrowman, The Theoretical Prediction of the Center of Pressure, 1966; with its
    /// interference of fins and body).
    pub fn force(&self, diameter_m: f64, end_station_m: f64) -> NormalForce {
        let Self { root_chord_m: root_m, tip_chord_m: tip_m, span_m, sweep_m, above_end_m } = *self;
        let both_m = root_m + tip_m;
        let middle_m = libm::hypot(span_m, sweep_m + 0.5 * (tip_m - root_m));
        let (slender, span_share) = (2.0 * middle_m / both_m, span_m / diameter_m);
        let interference = 1.0 + 0.5 * diameter_m / (span_m + 0.5 * diameter_m);
        let slope_per_rad =
            interference * 12.0 * span_share * span_share / (1.0 + libm::sqrt(1.0 + slender * slender));
        let behind_m =
            sweep_m / 3.0 * (root_m + 2.0 * tip_m) / both_m + (both_m - root_m * tip_m / both_m) / 6.0;
        NormalForce { slope_per_rad, station_m: end_station_m + above_end_m + root_m - behind_m }
    }
}

impl Launch {
    /// The vehicle on the rail, at rest: its centre of gravity at a station, m.
    pub fn standing(&self, cg_station_m: f64) -> RigidState {
        let (sin, cos) = libm::sincos(self.rail.towards_deg.to_radians());
        let axis = Vector3::new(-sin, cos, 0.0) * self.rail.tilt_deg.to_radians();
        let world_from_body = UnitQuaternion::from_scaled_axis(axis) * upright();
        // From the stack's lower end.
        let along_m = cg_station_m + self.booster.length_m;
        RigidState {
            position_m: self.rail.foot_m() + world_from_body * Vector3::x() * along_m,
            world_from_body,
            ..RigidState::upright(0.0)
        }
    }

    /// Checks the values that depend on the booster's length, and the computed values.
    ///
    /// # Errors
    /// [`BadValue`] names the first key with a wrong value.
    pub fn validate(&self) -> Result<(), BadValue> {
        let Booster { length_m, cg_station_m, propellant_station_m, fin_force, fin_radius_m, .. } =
            self.booster;
        let below = (-length_m..=0.0, "between launch.booster.length_m below the vehicle and 0");
        let rows = [
            ("launch.booster.cg_station_m", cg_station_m, below.clone()),
            ("launch.booster.propellant_station_m", propellant_station_m, below.clone()),
            ("launch.booster.fins", fin_force.station_m, below),
            ("launch.booster.fins", fin_force.slope_per_rad, (0.0..=100.0, "0 to 100")),
            ("launch.booster.fin_radius_m", fin_radius_m, (0.001..=1.0, "0.001 to 1")),
        ];
        match rows.into_iter().find(|(_, found, (range, _))| !range.contains(found)) {
            Some((key, found, (_, required))) => Err(BadValue::new(key, &found, required)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_hand_the_rail_leans_in_its_direction() {
        let mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
        let mut launch = mission.launch.unwrap();
        (launch.rail.tilt_deg, launch.rail.towards_deg) = (30.0, 90.0);
        launch.booster.length_m = 0.6;
        let standing = launch.standing(0.4);
        // A metre above the lower end, 30 degrees from the vertical towards y.
        assert!((standing.position_m - Vector3::new(0.0, 0.5, 0.866_025_403_784)).norm() < 1e-9);
        assert!((standing.nose_in_world() - standing.position_m).norm() < 1e-9);
        // The pad may lie elsewhere.
        (launch.rail.x_m, launch.rail.y_m) = (-20.0, 5.0);
        let moved = launch.standing(0.4);
        assert!((moved.position_m - Vector3::new(-20.0, 5.5, 0.866_025_403_784)).norm() < 1e-9);
        assert_eq!(moved.world_from_body, standing.world_from_body);
    }

    #[test]
    fn a_bad_value_is_named_in_the_error() {
        let mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
        let mut launch = mission.launch.unwrap();
        assert_eq!(launch.validate(), Ok(()));
        launch.booster.fin_force.station_m = 0.1;
        let error = launch.validate().unwrap_err().to_string();
        let expected =
            "launch.booster.fins is 0.1; between launch.booster.length_m below the vehicle and 0 is accepted";
        assert_eq!(error, expected);
    }
}
