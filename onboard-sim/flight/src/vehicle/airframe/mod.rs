//! The vehicle as data: masses, shape, fins, gimbal, legs and parachute.
//!
//! Stations are heights above the nozzle exit of the upright vehicle, positive towards the nose. So the arm of the
//! thrust is the station of the centre of gravity. The controller's model and the simulated truth use the same data.

mod mass;
mod sections;
mod validate;

pub use mass::{MassModel, MassProperties};
pub use sections::{Body, FinData, Gimbal, Igniter, Legs, Mass, Parachute, Servo};

use alloc::string::String;

use serde::Deserialize;

use crate::vehicle::fins::FinModel;

/// A vehicle.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Airframe {
    /// Name of a built-in landing motor, or the text of its `.eng` or `.rse` file.
    pub motor: String,
    /// How the landing motor is lit. A single igniter if absent.
    #[serde(default)]
    pub igniter: Igniter,
    /// Masses and their positions.
    pub mass: Mass,
    /// The fuselage.
    pub body: Body,
    pub fins: FinData,
    /// The thrust-vectoring actuator.
    pub gimbal: Gimbal,
    pub legs: Legs,
    /// The recovery parachute.
    pub parachute: Parachute,
}

/// A value of an airframe is outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key} is {found}; {required} is accepted")]
pub struct BadValue {
    pub key: &'static str,
    pub found: f64,
    pub required: &'static str,
}

impl Airframe {
    /// Checks that every value is inside its range.
    ///
    /// # Errors
    ///
    /// [`BadValue`] names the first key with a wrong value.
    pub fn validate(&self) -> Result<(), BadValue> {
        validate::validate(self)
    }

    /// The fins' aerodynamic model.
    pub fn fin_model(&self) -> FinModel {
        FinModel {
            reference_area_m2: self.body.reference_area_m2,
            drag_coefficient: self.fins.drag_coefficient,
            lift_coefficient: self.fins.lift_coefficient,
            length_m: self.fins.length_m,
            body_diameter_m: self.body.diameter_m,
        }
    }

    /// Drag area in a tail-first fall with all fins at one opening angle, m^2.
    pub fn drag_area_m2(&self, opening_rad: f64) -> f64 {
        self.body.reference_area_m2
            * (self.body.axial_drag_coefficient + 4.0 * self.fins.drag_coefficient * libm::sin(opening_rad))
    }

    /// Drag area of the fins together at their opening angles, m^2.
    pub fn fin_drag_area_m2(&self, openings_rad: &[f64; 4]) -> f64 {
        let each_m2 = self.fins.drag_coefficient * self.body.reference_area_m2;
        each_m2 * openings_rad.iter().map(|opening| libm::sin(*opening)).sum::<f64>()
    }

    /// Height of a station above the feet when upright, m.
    pub fn above_feet_m(&self, station_m: f64) -> f64 {
        station_m - self.legs.foot_station_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicles::motors;

    #[test]
    fn every_builtin_airframe_is_sound_and_has_its_motor() {
        for name in crate::vehicles::airframe::builtin_names() {
            let airframe = crate::vehicles::airframe::builtin(name).unwrap();
            let motor = motors::builtin(&airframe.motor).unwrap();
            let propellant_kg = motor.propellant_mass_kg();
            let model = MassModel::new(&airframe.mass, propellant_kg);
            let (full, empty) = (model.at(0.0), model.at(propellant_kg));
            assert!(empty.pitch_inertia_kg_m2 > 0.0 && empty.pitch_inertia_kg_m2 < full.pitch_inertia_kg_m2);
            // A vehicle that falls for long is turned by its fins; one that is dropped must not be.
            let turned_by_fins = !name.starts_with("vlr");
            assert!(empty.cg_station_m > full.cg_station_m, "{name}");
            assert!(!turned_by_fins || empty.cg_station_m < airframe.fins.station_m, "{name}");
            // The propellant burns in the middle of the motor.
            assert!((airframe.mass.propellant_station_m - motor.length_m() / 2.0).abs() < 1e-3, "{name}");
        }
    }

    /// The terminal speed with open fins is the landing paper's 39.4 m/s at 3 kg and sea level.
    #[test]
    fn val_landing_paper_terminal_speed_with_open_fins() {
        let airframe = crate::vehicles::airframe::builtin("mk2-h53").unwrap();
        let area_m2 = airframe.drag_area_m2(core::f64::consts::FRAC_PI_2);
        let speed_m_s = (2.0 * airframe.mass.loaded_kg * 9.806_65 / (1.225 * area_m2)).sqrt();
        assert!((speed_m_s - 39.4).abs() < 0.05, "{speed_m_s}");
    }

    #[test]
    fn a_bad_value_is_named_in_the_error() {
        let mut airframe = crate::vehicles::airframe::builtin("mk2").unwrap();
        airframe.gimbal.limit_deg = -3.0;
        let error = airframe.validate().unwrap_err().to_string();
        assert_eq!(error, "gimbal.limit_deg is -3; above 0 and below 90 is accepted");
    }

    #[test]
    fn a_single_igniter_is_the_default_and_the_scatter_has_a_range() {
        let mut airframe = crate::vehicles::airframe::builtin("mk2").unwrap();
        assert_eq!(airframe.igniter, Igniter { scatter_scale: 1.0 });
        for (scale, ok) in
            [(0.0, true), (0.5, true), (3.0, true), (-0.1, false), (3.1, false), (f64::NAN, false)]
        {
            airframe.igniter.scatter_scale = scale;
            let checked = airframe.validate();
            assert_eq!(checked.is_ok(), ok, "{scale}");
            assert!(ok || checked.unwrap_err().key == "igniter.scatter_scale");
        }
    }
}
