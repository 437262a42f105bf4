//! The vehicle as data: masses, shape, fins, gimbal, legs and parachute.
//!
//! Stations are heights above the nozzle exit when upright, towards the nose positive, so the arm of the thrust is the
//! station of the centre of gravity. The same data make the controller's model and the simulated truth.

mod builtin;
mod mass;
mod sections;
mod validate;

pub use mass::{MassModel, MassProperties};
pub use sections::{Body, FinData, Gimbal, Legs, Mass, Parachute, Servo};

use serde::Deserialize;

use crate::fins::FinModel;

/// A vehicle.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Airframe {
    /// Name of a built-in landing motor, or the text of its `.eng` or `.rse` file.
    pub motor: String,
    /// Masses and where they are.
    pub mass: Mass,
    /// The fuselage.
    pub body: Body,
    /// The four fins.
    pub fins: FinData,
    /// The thrust-vectoring actuator.
    pub gimbal: Gimbal,
    /// The four legs.
    pub legs: Legs,
    /// The recovery parachute.
    pub parachute: Parachute,
}

/// An airframe that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AirframeError {
    /// The text is not an airframe.
    #[error("{0}")]
    Toml(String),
    /// A value is outside its range.
    #[error("{key} is {found}; {required} is accepted")]
    BadValue {
        /// The key.
        key: &'static str,
        /// The value found.
        found: f64,
        /// What would be accepted.
        required: &'static str,
    },
    /// No built-in airframe has this name.
    #[error("no airframe is named '{name}'; these are built in: {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
}

impl Airframe {
    /// Reads an airframe from TOML and checks it.
    ///
    /// # Errors
    ///
    /// [`AirframeError`] names the key and what would be accepted.
    pub fn from_toml(text: &str) -> Result<Self, AirframeError> {
        let airframe: Self = toml::from_str(text).map_err(|error| AirframeError::Toml(error.to_string()))?;
        airframe.validate()?;
        Ok(airframe)
    }

    /// The built-in airframe of a name.
    ///
    /// # Errors
    ///
    /// [`AirframeError::Unknown`] lists the names there are.
    pub fn builtin(name: &str) -> Result<Self, AirframeError> {
        let Some((_, text)) = builtin::BUILTIN.iter().find(|(known, _)| *known == name) else {
            let known = Self::builtin_names().collect::<Vec<_>>().join(", ");
            return Err(AirframeError::Unknown { name: name.to_owned(), known });
        };
        Self::from_toml(text)
    }

    /// The TOML text of the built-in airframe of a name.
    pub fn builtin_toml(name: &str) -> Option<&'static str> {
        builtin::BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    }

    /// The names of the built-in airframes.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        builtin::BUILTIN.iter().map(|(name, _)| *name)
    }

    /// Whether every value is inside its range.
    ///
    /// # Errors
    ///
    /// [`AirframeError::BadValue`] names the first key that is not.
    pub fn validate(&self) -> Result<(), AirframeError> {
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

    /// Height of a station above the feet when upright, m.
    pub fn above_feet_m(&self, station_m: f64) -> f64 {
        station_m - self.legs.foot_station_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motors;

    #[test]
    fn every_builtin_airframe_is_sound_and_has_its_motor() {
        for name in Airframe::builtin_names() {
            let airframe = Airframe::builtin(name).unwrap();
            let motor = motors::builtin(&airframe.motor).unwrap();
            let propellant_kg = motor.propellant_mass_kg();
            let model = MassModel::new(&airframe.mass, propellant_kg);
            let (full, empty) = (model.at(0.0), model.at(propellant_kg));
            assert!(empty.pitch_inertia_kg_m2 > 0.0 && empty.pitch_inertia_kg_m2 < full.pitch_inertia_kg_m2);
            assert!(empty.cg_station_m > full.cg_station_m && empty.cg_station_m < airframe.fins.station_m);
            // The propellant leaves from the middle of the motor.
            assert!((airframe.mass.propellant_station_m - motor.length_m() / 2.0).abs() < 1e-3, "{name}");
        }
    }

    /// The terminal speed with open fins is the landing paper's 39.4 m/s at 3 kg and sea level.
    #[test]
    fn val_landing_paper_terminal_speed_with_open_fins() {
        let airframe = Airframe::builtin("mk2-h53").unwrap();
        let area_m2 = airframe.drag_area_m2(core::f64::consts::FRAC_PI_2);
        let speed_m_s = (2.0 * airframe.mass.loaded_kg * 9.806_65 / (1.225 * area_m2)).sqrt();
        assert!((speed_m_s - 39.4).abs() < 0.05, "{speed_m_s}");
    }

    #[test]
    fn a_bad_value_is_named() {
        let mut airframe = Airframe::builtin("mk2").unwrap();
        airframe.gimbal.limit_deg = -3.0;
        let error = airframe.validate().unwrap_err().to_string();
        assert_eq!(error, "gimbal.limit_deg is -3; above 0 and below 90 is accepted");
        let error = Airframe::from_toml("motor = 'x'\nwings = 2").unwrap_err().to_string();
        assert!(error.contains("unknown field `wings`"), "{error}");
        let error = Airframe::builtin("mk3").unwrap_err().to_string();
        assert_eq!(error, "no airframe is named 'mk3'; these are built in: mk2, mk2-h53, mini-f10");
    }
}
