//! Everything that a flight is made from. The same recipe and flight number give the same flight,
//! bit for bit.

use flight::vehicle::mission::{Mission, StartPoint};
use flight::vehicles::file_error::FileError;
use flight::vehicles::mission::MissionError;
use flight::vehicles::thrust_curve::to_rasp;

use crate::dispersion::{Dispersion, DispersionError};
use crate::fault::TimedFault;

/// All inputs of a flight. A log stores the texts that the data were read from.
#[derive(Debug, Clone)]
pub struct Recipe {
    pub mission: Mission,
    pub mission_toml: String,
    pub dispersion: Dispersion,
    pub dispersion_name: String,
    pub dispersion_toml: String,
    /// Text of the lines of the field, for people and logs; no flight depends on it.
    pub field: Option<String>,
    /// Seed of everything random, for all flights of this recipe.
    pub seed: u64,
    /// The faults of every flight.
    pub faults: Vec<TimedFault>,
}

/// Why a recipe cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// The mission is wrong.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The set of dispersions is wrong.
    #[error(transparent)]
    Dispersion(#[from] DispersionError),
    /// No built-in mission has this name.
    #[error("no mission is named '{0}'")]
    UnknownMission(String),
    #[error("mission '{0}' has no section `launch`: it has no ascent motor")]
    NoAscentMotor(String),
}

impl Recipe {
    /// A recipe from texts, each with its name: seed 1, no faults.
    ///
    /// # Errors
    /// A text does not parse; the message names it and the key.
    pub fn from_texts(mission: (&str, &str), dispersion: (&str, &str)) -> Result<Self, RecipeError> {
        let ((mission_name, mission_toml), (dispersion_name, dispersion_toml)) = (mission, dispersion);
        Ok(Self {
            mission: flight::vehicles::mission::from_toml(mission_toml, mission_name)?,
            mission_toml: mission_toml.to_owned(),
            dispersion: Dispersion::from_toml(dispersion_toml, dispersion_name)?,
            dispersion_name: dispersion_name.to_owned(),
            dispersion_toml: dispersion_toml.to_owned(),
            field: None,
            seed: 1,
            faults: Vec::new(),
        })
    }

    /// This recipe with another start of its flights.
    ///
    /// # Errors
    /// The mission lacks the data of that start.
    pub fn starting_at(self, start: StartPoint) -> Result<Self, RecipeError> {
        let mission_toml = toml_starting_at(&self.mission_toml, &self.mission.name, start)?;
        Ok(self.with_mission(mission_toml)?)
    }

    /// This recipe with another text of its mission.
    ///
    /// # Errors
    /// The text is no mission.
    pub fn with_mission(self, mission_toml: String) -> Result<Self, MissionError> {
        let mission = flight::vehicles::mission::from_toml(&mission_toml, &self.mission.name)?;
        Ok(Self { mission, mission_toml, ..self })
    }

    /// This recipe with another countdown, s.
    ///
    /// # Errors
    /// The mission does not allow it.
    pub fn counting_down(self, countdown_s: f64) -> Result<Self, RecipeError> {
        let mut document = document_of(&self.mission_toml, &self.mission.name)?;
        document["start"]["countdown_s"] = toml_edit::value(countdown_s);
        Ok(self.with_mission(document.to_string())?)
    }

    /// This recipe with an ascent motor of the same impulse that burns for another time, s.
    ///
    /// # Errors
    /// The mission has no ascent motor, or does not accept this one.
    pub fn ascending_for(self, burn_time_s: f64) -> Result<Self, RecipeError> {
        let Some(launch) = &self.mission.launch else {
            return Err(RecipeError::NoAscentMotor(self.mission.name));
        };
        let curve = &launch.booster.motor_curve;
        let stretched = curve.scaled(1.0, burn_time_s / curve.burn_time_s());
        let mut document = document_of(&self.mission_toml, &self.mission.name)?;
        document["launch"]["booster"]["motor"] = toml_edit::value(to_rasp(&stretched));
        Ok(self.with_mission(document.to_string())?)
    }

    /// A recipe from a built-in mission and a built-in set of dispersions.
    ///
    /// # Errors
    /// One of them is not built in.
    pub fn built_in(mission: &str, dispersion: &str) -> Result<Self, RecipeError> {
        let known = flight::vehicles::mission::BUILTIN.iter().find(|(known, _)| *known == mission);
        let mission = known.ok_or_else(|| RecipeError::UnknownMission(mission.to_owned()))?;
        Self::from_texts(*mission, (dispersion, Dispersion::builtin_toml(dispersion)?))
    }
}

/// Returns the name most similar to a mistyped one, and their likeness from 0 to 1.
pub fn nearest(given: &str, names: impl IntoIterator<Item: Into<String>>) -> Option<(String, f64)> {
    let scored = names.into_iter().map(Into::into).map(|name| {
        let likeness = strsim::jaro_winkler(given, &name);
        (name, likeness)
    });
    scored.max_by(|a, b| a.1.total_cmp(&b.1).then_with(|| b.0.cmp(&a.0)))
}

fn document_of(mission_toml: &str, origin: &str) -> Result<toml_edit::DocumentMut, MissionError> {
    let parsed = mission_toml.parse();
    parsed.map_err(|error: toml_edit::TomlError| {
        FileError::Parse { origin: origin.to_owned(), message: error.to_string() }.into()
    })
}

/// The text of a mission with another start; comments and order stay. `origin` names it in
/// messages.
///
/// # Errors
/// The text is not TOML.
pub fn toml_starting_at(mission_toml: &str, origin: &str, start: StartPoint) -> Result<String, MissionError> {
    let mut document = document_of(mission_toml, origin)?;
    let before = document.get("start").and_then(|section| section.get("at")).and_then(|at| at.as_str());
    if before.unwrap_or(StartPoint::Apogee.name()) == start.name() {
        return Ok(mission_toml.to_owned());
    }
    document["start"]["at"] = toml_edit::value(start.name());
    Ok(document.to_string())
}
