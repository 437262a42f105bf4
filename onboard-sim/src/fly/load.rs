//! What is to fly, by name or from a file: a profile that starts at ignition, or a mission from apogee.

use std::collections::BTreeMap;
use std::path::Path;

use campaign::baseline::Controller;
use campaign::dispersion::{self, Dispersion};
use campaign::order::Order;
use flight::mission::{self, Mission, MissionError};
use flight::profile::{self, Profile};
use protocol::log::writer::LogHeader;

use super::FlyError;
use crate::craft::Craft;
use crate::pilot_log;
use crate::rocket::{Rocket, RocketFlight};
use crate::scatter::draw;
use crate::vehicle::{DeadlinePolicy, Vehicle};

/// The dispersions a mission is flown with where nothing else is asked for: a day at the field, as the crew will have it.
const DISPERSION: &str = "field";

/// A profile and the text it was read from. The log's header and the flight both come from one reading.
#[derive(Debug, Clone)]
pub struct LoadedProfile {
    /// The profile.
    pub profile: Profile,
    /// Its text, for the log.
    pub toml: String,
}

/// What is to fly.
#[derive(Debug, Clone)]
pub enum LoadedFlight {
    /// In the plane, from ignition.
    AtIgnition(Box<LoadedProfile>),
    /// In space, from apogee. The order's seed is the run's.
    FromApogee(Box<RocketFlight>),
}

impl LoadedFlight {
    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::AtIgnition(loaded) => &loaded.profile.name,
            Self::FromApogee(flight) => &flight.order.mission.name,
        }
    }

    /// One line for a person choosing.
    pub fn summary(&self) -> &str {
        match self {
            Self::AtIgnition(loaded) => &loaded.profile.summary,
            Self::FromApogee(flight) => &flight.order.mission.summary,
        }
    }

    /// Its text.
    pub fn toml(&self) -> &str {
        match self {
            Self::AtIgnition(loaded) => &loaded.toml,
            Self::FromApogee(flight) => &flight.order.mission_toml,
        }
    }

    /// The craft, powered up.
    ///
    /// # Errors
    /// It cannot be simulated, or the policy is not for it.
    pub fn craft(&self, seed: u64, policy: DeadlinePolicy) -> Result<Box<dyn Craft + Send>, FlyError> {
        Ok(match self {
            Self::AtIgnition(loaded) => {
                Box::new(Vehicle::new(&loaded.profile, draw(&loaded.profile, seed), policy)?)
            }
            Self::FromApogee(_) if policy == DeadlinePolicy::Enforce => {
                return Err(FlyError::DeadlinePolicy { name: self.name().to_owned() });
            }
            Self::FromApogee(flight) => Box::new(Rocket::new(&seeded(flight, seed))?),
        })
    }
}

fn seeded(flight: &RocketFlight, seed: u64) -> RocketFlight {
    RocketFlight { order: Order { seed, ..flight.order.clone() }, number: flight.number }
}

/// Every built-in name with its text.
pub fn builtins() -> impl Iterator<Item = (&'static str, &'static str)> {
    profile::BUILTIN.iter().chain(mission::BUILTIN).copied()
}

pub(super) fn builtin_names() -> String {
    names(builtins())
}

pub(super) fn planar_names() -> String {
    names(profile::BUILTIN.iter().copied())
}

fn names(of: impl Iterator<Item = (&'static str, &'static str)>) -> String {
    of.map(|(name, _)| name).collect::<Vec<_>>().join(", ")
}

/// Reads a profile or a mission by built-in name or path.
///
/// # Errors
/// There is none of that name, or it is wrong: the message names the key.
pub fn load_profile(name_or_path: &str) -> Result<LoadedFlight, FlyError> {
    let builtin = builtins().find(|(name, _)| *name == name_or_path).map(|(_, text)| text);
    let toml = match builtin {
        Some(text) => text.to_owned(),
        None if !Path::new(name_or_path).exists() => {
            return Err(FlyError::NoProfile { given: name_or_path.to_owned() });
        }
        None => std::fs::read_to_string(name_or_path)
            .map_err(|source| FlyError::ReadProfile { path: name_or_path.to_owned(), source })?,
    };
    if Mission::is_meant(&toml) {
        return Ok(LoadedFlight::FromApogee(Box::new(mission_flight(toml, name_or_path)?)));
    }
    let profile = Profile::from_toml(&toml, name_or_path)?;
    Ok(LoadedFlight::AtIgnition(Box::new(LoadedProfile { profile, toml })))
}

/// The same where only a profile that starts at ignition will do.
///
/// # Errors
/// As [`load_profile`], and for a mission from apogee.
pub fn load_planar(name_or_path: &str) -> Result<LoadedProfile, FlyError> {
    match load_profile(name_or_path)? {
        LoadedFlight::AtIgnition(loaded) => Ok(*loaded),
        flight @ LoadedFlight::FromApogee(_) => Err(FlyError::FromApogee { name: flight.name().to_owned() }),
    }
}

fn mission_flight(mission_toml: String, origin: &str) -> Result<RocketFlight, MissionError> {
    let mission = Mission::from_toml(&mission_toml, origin)?;
    // Both are built in under that name; a test holds that.
    let dispersion = Dispersion::builtin(DISPERSION).unwrap_or_default();
    let dispersion_toml = dispersion::BUILTIN
        .iter()
        .find(|(name, _)| *name == DISPERSION)
        .map_or_else(String::new, |(_, text)| (*text).to_owned());
    let order = Order {
        mission,
        mission_toml,
        dispersion,
        dispersion_name: DISPERSION.to_owned(),
        dispersion_toml,
        seed: 1,
        flights: 1,
        controller: Controller::Nmpc,
        faults: Vec::new(),
    };
    Ok(RocketFlight { order, number: 0 })
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
        LoadedFlight::FromApogee(flight) => {
            pilot_log::header(writer, &seeded(flight, seed).order, flight.number, start_unix_ns)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_name_loads_as_what_it_is() {
        for (name, text) in builtins() {
            let loaded = load_profile(name).unwrap();
            assert_eq!((loaded.name(), loaded.toml()), (name, text));
            assert!(!loaded.summary().is_empty());
            let from_apogee = mission::BUILTIN.iter().any(|(known, _)| *known == name);
            assert_eq!(matches!(loaded, LoadedFlight::FromApogee(_)), from_apogee, "{name}");
            assert_eq!(load_planar(name).is_err(), from_apogee, "{name}");
        }
    }

    #[test]
    fn a_mission_is_flown_on_a_day_at_the_field_unless_told_otherwise() {
        let LoadedFlight::FromApogee(flight) = load_profile("mk2").unwrap() else {
            panic!("not from apogee")
        };
        assert_eq!(flight.order.dispersion, Dispersion::builtin(DISPERSION).unwrap());
        assert!(!flight.order.dispersion_toml.is_empty());
    }

    #[test]
    fn what_is_neither_is_refused_by_what_it_gave() {
        let words = load_profile("mk3").err().unwrap().to_string();
        assert!(
            words.contains("mk3") && words.contains("mk2") && words.contains("paper-calibrated"),
            "{words}"
        );
        let words = load_planar("mk2").err().unwrap().to_string();
        assert!(words.contains("mk2 flies from apogee"), "{words}");
        let flight = load_profile("mk2").unwrap();
        let words = flight.craft(1, DeadlinePolicy::Enforce).err().unwrap().to_string();
        assert!(words.contains("mk2: deadlines"), "{words}");
    }
}
