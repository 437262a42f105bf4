//! Loads a mission, by name or from a file, makes a flight of it, and starts it where there is no
//! crew.

use std::path::Path;

use crate::dispersion::Dispersion;
use crate::recipe::Recipe;
use flight::computer::crew::{Answer, CrewCommand, Request};
use flight::rules::arming;
use flight::rules::phase::Phase;
use flight::text::Text;
use flight::vehicle::mission::StartPoint;
use protocol::log::writer::LogHeader;

use super::FlyError;
use crate::wire::field::with_field;
use crate::wire::vehicle::{RocketFlight, Vehicle};

/// The default dispersions of a mission: a normal day at the field.
const DISPERSION: &str = "field";

impl RocketFlight {
    /// The same flight from another start; `None` leaves a mission with a launch on its pad, and
    /// anything else as it is.
    ///
    /// # Errors
    /// It has no such start.
    pub fn starting_at(self, start: Option<StartPoint>) -> Result<Self, FlyError> {
        let launched = self.recipe.mission.launch.as_ref().map(|_| StartPoint::Pad);
        let start = start.or(launched).unwrap_or(self.recipe.mission.start.at);
        Ok(Self { recipe: self.recipe.starting_at(start)?, ..self })
    }

    /// The vehicle, powered up.
    ///
    /// # Errors
    /// It cannot be simulated.
    pub fn vehicle(&self) -> Result<Vehicle, FlyError> {
        let Recipe { mission, mission_toml, .. } = &self.recipe;
        Ok(Vehicle::on_the_pad(self)?.of_mission(&mission.name, mission_toml))
    }

    /// The header of its log.
    pub fn log_header(&self, writer: &str, start_unix_ns: u64) -> LogHeader {
        crate::wire::record::header(writer, &self.recipe, self.number, start_unix_ns)
    }
}

pub(super) fn builtin_names() -> String {
    flight::vehicles::mission::BUILTIN.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// Reads a mission by built-in name or path: flight 0 of seed 1 with the default dispersions.
///
/// # Errors
/// No mission of that name, or an invalid one: the message names the key.
pub fn load_flight(name_or_path: &str) -> Result<RocketFlight, FlyError> {
    let builtin = flight::vehicles::mission::BUILTIN.iter().find(|(name, _)| *name == name_or_path);
    let toml = match builtin {
        Some((_, text)) => (*text).to_owned(),
        None if !Path::new(name_or_path).exists() => {
            return Err(FlyError::NoMission { given: name_or_path.to_owned() });
        }
        None => std::fs::read_to_string(name_or_path)
            .map_err(|source| FlyError::ReadMission { path: name_or_path.to_owned(), source })?,
    };
    let dispersion =
        (DISPERSION, Dispersion::builtin_toml(DISPERSION).map_err(crate::recipe::RecipeError::from)?);
    let recipe = with_field(Recipe::from_texts((name_or_path, &toml), dispersion)?, name_or_path)?;
    Ok(RocketFlight { recipe, number: 0 })
}

// Arms and starts a flight without a crew.

/// The arming checks pass within this time, s, if they ever do: the rehearsal of a long flight
/// takes some seconds.
const READY_WITHIN_S: f64 = 10.0;

/// Arms and starts once the checks pass.
pub(super) struct AutoStart {
    pub(super) wanted: bool,
    pub(super) refused: Option<String>,
    /// Arming and start were requested.
    pub(super) requested: bool,
    /// Why the countdown was held.
    pub(super) held: Option<Text>,
}

impl AutoStart {
    /// The request for this frame.
    pub(super) fn requests(&mut self, vehicle: &Vehicle) -> Vec<Request> {
        let mode = vehicle.mode();
        if self.requested && mode.phase.on_pad() && !mode.interlocks.armed && !vehicle.aborted() {
            // A reset has disarmed it. Only a person arms it again.
            let why = self.held.as_ref().map(|held| format!(": {held}")).unwrap_or_default();
            self.refused.get_or_insert_with(|| format!("disarmed on the pad after it was started{why}"));
        }
        if self.held.is_none() && mode.hold.is_some() {
            self.held = arming::first_refusal(&vehicle.arming_checks());
        }
        let waits = matches!(vehicle.phase(), Phase::Safe | Phase::PadIdle);
        if !self.wanted || self.refused.is_some() || !waits {
            return Vec::new();
        }
        match arming::first_refusal(&vehicle.arming_checks()) {
            Some(reason) if vehicle.time_s() > READY_WITHIN_S => self.refused = Some(reason.to_string()),
            Some(_) => {}
            None => {
                (self.wanted, self.requested) = (false, true);
                return [CrewCommand::Arm, CrewCommand::Start].map(Request::of_the_programme).to_vec();
            }
        }
        Vec::new()
    }

    /// Takes the answer to the request.
    pub(super) fn on_answers(&mut self, answers: &[Answer]) {
        self.refused = self
            .refused
            .take()
            .or_else(|| answers.iter().find_map(|answer| Some(answer.reason?.to_string())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_mission_loads_with_field_dispersions() {
        for (name, text) in flight::vehicles::mission::BUILTIN {
            let RocketFlight { recipe, number } = load_flight(name).unwrap();
            assert_eq!(
                (recipe.mission.name.as_str(), recipe.mission_toml.as_str(), number),
                (*name, *text, 0)
            );
            assert_eq!(recipe.dispersion, Dispersion::builtin(DISPERSION).unwrap());
            assert!(!recipe.dispersion_toml.is_empty());
        }
    }

    /// A station that is prepared for a mission arms it wherever the flight begins.
    #[test]
    fn the_vehicle_reports_the_same_mission_from_every_start() {
        use protocol::mission::MissionHash;
        for (name, text) in flight::vehicles::mission::BUILTIN {
            for start in [StartPoint::Apogee, StartPoint::Pad, StartPoint::Drone] {
                let Ok(flight) = load_flight(name).unwrap().starting_at(Some(start)) else { continue };
                let hash = flight.vehicle().unwrap().mission().hash;
                assert_eq!(hash, MissionHash::of(text), "{name} from {}", start.name());
            }
        }
    }

    #[test]
    fn what_is_no_mission_is_refused_with_the_names_there_are() {
        let words = load_flight("mk9").err().unwrap().to_string();
        assert!(words.contains("mk9") && words.contains("mk2") && words.contains("vlr"), "{words}");
    }
}
