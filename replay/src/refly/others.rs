//! What a change does to other flights than the recorded one.

use onboard_sim::progress::Progress;
use onboard_sim::run::in_parallel;
use serde::Serialize;
use sim::recipe::Recipe;
use sim::sortie::{SetUpError, Sortie};

use super::rerun::Rerun;
use super::{FaultChanges, ReflyOptions};
use crate::compare::flips_in_words;
use crate::controller::AgainError;
use crate::log::Recording;
use crate::settings::{mission_toml_with, mission_with};

/// Other flights of the recorded mission and dispersions, each flown as recorded and with the
/// changes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OtherFlights {
    pub flights: usize,
    pub dispersion: String,
    /// Those that stand undamaged as recorded, and with the changes.
    pub stood: usize,
    pub stand: usize,
    /// Those that stand with the changes alone, and as recorded alone.
    pub saved: usize,
    pub lost: usize,
}

/// What settings without a time and faults do to as many other flights of the recorded seed. A
/// flight may be a lucky one.
///
/// # Errors
/// See [`AgainError`]; a change of the plant alone or in flight belongs to the
/// recorded flight.
pub fn other_flights(
    recording: &Recording,
    options: &ReflyOptions,
    flights: u64,
) -> Result<OtherFlights, AgainError> {
    let timed = options.settings.iter().any(|setting| setting.at_s.is_some());
    if timed || !options.plant_settings.is_empty() {
        let reason =
            "takes --set without a time, --fault and --without-fault; the rest belongs to one flight";
        return Err(AgainError::Refused { of: "--flights".to_owned(), reason: reason.to_owned() });
    }
    let Rerun { recipe, number, .. } = Rerun::of(recording, &FaultChanges::default())?;
    let mission_toml = mission_toml_with(&recipe.mission_toml, &options.settings)?;
    let mission = mission_with(&recipe.mission_toml, &options.settings)?;
    let faults = Rerun::of(recording, &options.faults)?.recipe.faults;
    let changed = Recipe { mission, mission_toml, faults, ..recipe.clone() };
    let numbers: Vec<u64> = (0..=flights).filter(|other| *other != number).take(flights as usize).collect();
    let both = |number: &u64| -> Result<[bool; 2], SetUpError> {
        let stands = |recipe| Sortie::new(recipe, *number).map(|mut flight| flight.run().landing.stands);
        Ok([stands(&recipe)?, stands(&changed)?])
    };
    let progress = Progress::start();
    let flown = in_parallel(&numbers, both, &|done| progress.show(done, numbers.len(), "flights"));
    let flown = flown.into_iter().collect::<Result<Vec<_>, _>>()?;
    let count = |wanted: &[[bool; 2]]| flown.iter().filter(|found| wanted.contains(found)).count();
    Ok(OtherFlights {
        flights: flown.len(),
        dispersion: recipe.dispersion_name,
        stood: count(&[[true, true], [true, false]]),
        stand: count(&[[true, true], [false, true]]),
        saved: count(&[[false, true]]),
        lost: count(&[[true, false]]),
    })
}

impl OtherFlights {
    /// The answer for people: a change may lose more than it saves.
    pub(super) fn words(&self) -> String {
        let Self { flights, dispersion, stood, stand, saved, lost } = self;
        format!(
            "{flights} other flights of {dispersion}: {stood} stand undamaged as recorded, {stand} with the change, which {}",
            flips_in_words(*saved, *lost)
        )
    }
}
