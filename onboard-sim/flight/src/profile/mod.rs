//! Profiles: a vehicle, its motor, its start, its controller and its limits, read from TOML.
//!
//! A profile is data only. Keys carry their units; angles are in degrees in the file (`limit_deg`) and the
//! accessors return radians (`limit_rad()`). Unknown keys are errors, so a misspelt key cannot pass silently.

mod builtin;
mod sections;
mod validate;

pub use builtin::BUILTIN;
pub use sections::{
    ArmingLimits, Dispersion, Environment, FinalBox, Fins, GateLimits, Gimbal, ModelKind, Motor, Nmpc, Plant,
    SolverLimits, StabiliserGains, Start, StartPoint, StateWeights, TouchdownBox, TrajectoryLimits, Vehicle,
};

use serde::Deserialize;

use crate::site::Site;

/// Everything that distinguishes one simulated or real vehicle and its mission from another.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Short name, as given on a command line.
    pub name: String,
    /// One line for a person choosing a profile.
    pub summary: String,
    /// Mass, inertia and shape.
    pub vehicle: Vehicle,
    /// Gravity and air.
    pub environment: Environment,
    /// The landing motor.
    pub motor: Motor,
    /// The thrust-vectoring actuator.
    pub gimbal: Gimbal,
    /// The four aerodynamic fins.
    pub fins: Fins,
    /// Where the flight begins.
    pub start: Start,
    /// The landing controller.
    pub nmpc: Nmpc,
    /// The upright law of the last degradation level.
    #[serde(default)]
    pub stabiliser: StabiliserGains,
    /// What counts as a landing.
    pub touchdown_limits: TouchdownBox,
    /// Limits of the pad checks before arming.
    #[serde(default)]
    pub arming: ArmingLimits,
    /// Limits of the checks before ignition.
    pub gate: GateLimits,
    /// Where on the Earth the pad is.
    #[serde(default)]
    pub site: Site,
    /// How the true vehicle differs from the controller's model.
    #[serde(default)]
    pub plant: Plant,
    /// One-sigma scatter of a campaign of flights.
    #[serde(default)]
    pub dispersion: Dispersion,
}

/// Why a profile could not be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProfileError {
    /// The text is not TOML of the expected shape: a missing, misspelt or mistyped key.
    #[error("{origin}: {message}")]
    Parse {
        /// Where the text came from (a path or a built-in's name).
        origin: String,
        /// The parser's words, with line, column and key.
        message: String,
    },
    /// A key holds a value outside its range.
    #[error("{origin}: {key} = {found}: must be {required}")]
    Value {
        /// Where the text came from (a path or a built-in's name).
        origin: String,
        /// The key, with its section.
        key: &'static str,
        /// The value found.
        found: String,
        /// The accepted range, in words.
        required: &'static str,
    },
}

impl Profile {
    /// Reads a profile from TOML text. `origin` (a path or a name) is only used in messages.
    ///
    /// # Errors
    /// [`ProfileError::Parse`] if the text has not the shape of a profile; [`ProfileError::Value`] if a value is
    /// out of range.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ProfileError> {
        let profile: Self = toml::from_str(text)
            .map_err(|error| ProfileError::Parse { origin: origin.to_owned(), message: error.to_string() })?;
        validate::validate(&profile).map_err(|bad| ProfileError::Value {
            origin: origin.to_owned(),
            key: bad.key,
            found: bad.found,
            required: bad.required,
        })?;
        Ok(profile)
    }

    /// The built-in profile of that name, or `None` if there is no such built-in.
    ///
    /// Every entry of [`BUILTIN`] parses; a test holds that.
    pub fn builtin(name: &str) -> Option<Self> {
        let (name, text) = BUILTIN.iter().find(|(known, _)| *known == name)?;
        Self::from_toml(text, name).ok()
    }

    /// The TOML text of the built-in profile of that name.
    pub fn builtin_toml(name: &str) -> Option<&'static str> {
        BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    }
}

#[cfg(test)]
mod tests;
