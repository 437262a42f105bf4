//! Loads the profile (starts at ignition) or the mission (starts where it says), by name or from a file.

use std::collections::BTreeMap;
use std::path::Path;

use flight::vehicle::profile::{Profile, StartPoint};
use protocol::log::writer::LogHeader;
use sim::dispersion::Dispersion;
use sim::recipe::{Recipe, RecipeError};

use super::FlyError;
use crate::vehicle::{RocketFlight, Vehicle};
use sim::plane::draw::draw;
use sim::plane::{DeadlinePolicy, PlanarFlight};

/// The default dispersions of a mission: a normal day at the field.
const DISPERSION: &str = "field";

/// A profile and its text. The log's header and the flight use the same reading of the file.
#[derive(Debug, Clone)]
pub struct LoadedProfile {
    pub profile: Profile,
    /// Its text, for the log.
    pub toml: String,
}

/// A profile or a mission, ready to fly.
#[derive(Debug, Clone)]
pub enum LoadedFlight {
    /// In the plane, from ignition.
    AtIgnition(Box<LoadedProfile>),
    /// In space. The recipe's seed is the run's.
    InSpace(Box<RocketFlight>),
}

impl LoadedFlight {
    pub fn name(&self) -> &str {
        match self {
            Self::AtIgnition(loaded) => &loaded.profile.name,
            Self::InSpace(flight) => &flight.recipe.mission.name,
        }
    }

    /// The description in one line.
    pub fn summary(&self) -> &str {
        match self {
            Self::AtIgnition(loaded) => &loaded.profile.summary,
            Self::InSpace(flight) => &flight.recipe.mission.summary,
        }
    }

    /// The TOML text.
    pub fn toml(&self) -> &str {
        match self {
            Self::AtIgnition(loaded) => &loaded.toml,
            Self::InSpace(flight) => &flight.recipe.mission_toml,
        }
    }

    /// The same flight from another start; `None` leaves a mission with a launch on its pad, and anything else as it is.
    ///
    /// # Errors
    /// It has no such start.
    pub fn starting_at(self, start: Option<StartPoint>) -> Result<Self, FlyError> {
        match self {
            Self::InSpace(flight) => {
                let RocketFlight { recipe, number } = *flight;
                let launched = recipe.mission.launch.as_ref().map(|_| StartPoint::Pad);
                let start = start.or(launched).unwrap_or(recipe.mission.start.at);
                Ok(Self::InSpace(Box::new(RocketFlight { recipe: recipe.starting_at(start)?, number })))
            }
            Self::AtIgnition(_) if start.is_some_and(|start| start != StartPoint::Ignition) => {
                Err(FlyError::NoSuchStart { name: self.name().to_owned() })
            }
            Self::AtIgnition(_) => Ok(self),
        }
    }

    /// The vehicle, powered up.
    ///
    /// # Errors
    /// It cannot be simulated, or the late-output policy does not apply to it.
    pub fn vehicle(&self, seed: u64, policy: DeadlinePolicy) -> Result<Vehicle, FlyError> {
        let vehicle = match self {
            Self::AtIgnition(loaded) => {
                let drawn = draw(&loaded.profile, seed);
                Vehicle::in_plane(PlanarFlight::new(&loaded.profile, drawn, policy)?)
            }
            Self::InSpace(_) if policy == DeadlinePolicy::Enforce => {
                return Err(FlyError::DeadlinePolicy { name: self.name().to_owned() });
            }
            Self::InSpace(flight) => Vehicle::in_space(&seeded(flight, seed))?,
        };
        Ok(vehicle.of_mission(self.name(), self.toml()))
    }
}

fn seeded(flight: &RocketFlight, seed: u64) -> RocketFlight {
    RocketFlight { recipe: Recipe { seed, ..flight.recipe.clone() }, number: flight.number }
}

/// Every built-in name with its text.
pub fn builtins() -> impl Iterator<Item = (&'static str, &'static str)> {
    vehicles::profile::BUILTIN.iter().chain(vehicles::mission::BUILTIN).copied()
}

pub(super) fn builtin_names() -> String {
    names(builtins())
}

pub(super) fn planar_names() -> String {
    names(vehicles::profile::BUILTIN.iter().copied())
}

fn names(of: impl Iterator<Item = (&'static str, &'static str)>) -> String {
    of.map(|(name, _)| name).collect::<Vec<_>>().join(", ")
}

/// Reads a profile or a mission by built-in name or path.
///
/// # Errors
/// No profile of that name, or an invalid one: the message names the key.
pub fn load_flight(name_or_path: &str) -> Result<LoadedFlight, FlyError> {
    let builtin = builtins().find(|(name, _)| *name == name_or_path).map(|(_, text)| text);
    let toml = match builtin {
        Some(text) => text.to_owned(),
        None if !Path::new(name_or_path).exists() => {
            return Err(FlyError::NoProfile { given: name_or_path.to_owned() });
        }
        None => std::fs::read_to_string(name_or_path)
            .map_err(|source| FlyError::ReadProfile { path: name_or_path.to_owned(), source })?,
    };
    if vehicles::mission::is_meant(&toml) {
        return Ok(LoadedFlight::InSpace(Box::new(mission_flight(&toml, name_or_path)?)));
    }
    let profile = vehicles::profile::from_toml(&toml, name_or_path)?;
    Ok(LoadedFlight::AtIgnition(Box::new(LoadedProfile { profile, toml })))
}

/// Reads a profile that starts at ignition.
///
/// # Errors
/// As [`load_flight`], and for a mission.
pub fn load_planar(name_or_path: &str) -> Result<LoadedProfile, FlyError> {
    match load_flight(name_or_path)? {
        LoadedFlight::AtIgnition(loaded) => Ok(*loaded),
        flight @ LoadedFlight::InSpace(_) => Err(FlyError::InSpace { name: flight.name().to_owned() }),
    }
}

/// Flight 0 of a mission with the default dispersions.
fn mission_flight(mission_toml: &str, origin: &str) -> Result<RocketFlight, RecipeError> {
    let dispersion_toml = Dispersion::builtin_toml(DISPERSION)?;
    Ok(RocketFlight {
        recipe: Recipe::from_texts((origin, mission_toml), (DISPERSION, dispersion_toml))?,
        number: 0,
    })
}

/// The header of a flight's log.
pub fn log_header(writer: &str, loaded: &LoadedFlight, seed: u64, start_unix_ns: u64) -> LogHeader {
    match loaded {
        LoadedFlight::AtIgnition(loaded) => {
            let run = BTreeMap::from([
                ("profile".to_owned(), loaded.profile.name.clone()),
                ("seed".to_owned(), seed.to_string()),
                ("start_unix_ns".to_owned(), start_unix_ns.to_string()),
            ]);
            LogHeader {
                writer: writer.to_owned(),
                start_unix_ns,
                run,
                profile_toml: Some(loaded.toml.clone()),
                scenario_toml: None,
            }
        }
        LoadedFlight::InSpace(flight) => {
            tick_log::sortie::header(writer, &seeded(flight, seed).recipe, flight.number, start_unix_ns)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_name_loads_as_what_it_is() {
        for (name, text) in builtins() {
            let loaded = load_flight(name).unwrap();
            assert_eq!((loaded.name(), loaded.toml()), (name, text));
            assert!(!loaded.summary().is_empty());
            let from_apogee = vehicles::mission::BUILTIN.iter().any(|(known, _)| *known == name);
            assert_eq!(matches!(loaded, LoadedFlight::InSpace(_)), from_apogee, "{name}");
            assert_eq!(load_planar(name).is_err(), from_apogee, "{name}");
        }
    }

    #[test]
    fn a_mission_has_field_dispersions_by_default() {
        let LoadedFlight::InSpace(flight) = load_flight("mk2").unwrap() else { panic!("not from apogee") };
        assert_eq!(flight.recipe.dispersion, Dispersion::builtin(DISPERSION).unwrap());
        assert!(!flight.recipe.dispersion_toml.is_empty());
    }

    #[test]
    fn a_file_that_is_neither_profile_nor_mission_is_refused() {
        let words = load_flight("mk9").err().unwrap().to_string();
        assert!(
            words.contains("mk9") && words.contains("mk2") && words.contains("paper-calibrated"),
            "{words}"
        );
        let words = load_planar("mk2").err().unwrap().to_string();
        assert!(words.contains("mk2 flies in space"), "{words}");
        let flight = load_flight("mk2").unwrap();
        let words = flight.vehicle(1, DeadlinePolicy::Enforce).err().unwrap().to_string();
        assert!(words.contains("mk2: deadlines"), "{words}");
    }
}
