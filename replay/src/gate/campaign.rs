//! Flies a flight of a campaign's directory again and holds it against its row.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use tick_log::sortie;

use super::state::name_of;
use super::{Checked, Flown, GateError, Outcome};
use crate::info::VerdictFacts;
use crate::refly::margin;

/// The file that makes a directory a campaign's.
pub(super) const MANIFEST: &str = "manifest.json";
const ROWS: &str = "flights.csv";

/// The facts of a campaign that its flights are made from.
#[derive(Deserialize)]
struct Manifest {
    dispersion: String,
    seed: u64,
    controller: String,
    steered: bool,
    faults: Vec<String>,
}

/// What a row says about how its flight ended.
#[derive(Deserialize)]
struct Row {
    number: u64,
    legs: bool,
    strict: bool,
    failure: String,
    touchdown_time_s: Option<f64>,
    touchdown_vertical_m_s: Option<f64>,
}

/// The numbers of the flights in a campaign's directory.
pub(super) fn flights_of(directory: &Path) -> Result<Vec<u64>, GateError> {
    Ok(rows(directory)?.into_iter().map(|row| row.number).collect())
}

/// Flies one flight of a campaign.
pub(super) fn fly(directory: &Path, number: u64) -> Result<Outcome, GateError> {
    let recipe = recipe(directory)?;
    let row = rows(directory)?.into_iter().find(|row| row.number == number).ok_or_else(|| {
        GateError::Campaign { path: directory.join(ROWS), reason: format!("has no flight {number}") }
    })?;
    let mut flight = Sortie::new(&recipe, number)
        .map_err(|error| GateError::Campaign { path: directory.to_owned(), reason: error.to_string() })?;
    let outcome = flight.run();
    let bits = |value: Option<f64>| value.map(f64::to_bits);
    let touchdown = outcome.touchdown.as_ref();
    let same = row.legs == outcome.legs
        && row.strict == outcome.strict
        && row.failure == outcome.failure.map_or("", |failure| failure.name())
        && bits(row.touchdown_time_s) == bits(touchdown.map(|touchdown| touchdown.time_s))
        && bits(row.touchdown_vertical_m_s) == bits(touchdown.map(|touchdown| touchdown.vertical_m_s));
    let verdict = sortie::verdict(&flight).as_ref().map(VerdictFacts::of);
    let (seed, number) = (recipe.seed.to_le_bytes(), number.to_le_bytes());
    let parts = [recipe.mission_toml.as_bytes(), recipe.dispersion_toml.as_bytes(), &seed, &number];
    Ok(Outcome {
        flight: Some(name_of(parts)),
        checked: if same { Checked::Identical } else { Checked::Diverged },
        flown: verdict.map(|verdict| Flown {
            landed: verdict.landed,
            margin: Some(format!("{:?}", margin(&verdict))),
            ending: verdict.ending,
        }),
        problem: None,
    })
}

fn recipe(directory: &Path) -> Result<Recipe, GateError> {
    let wrong = |name: &str, reason: String| GateError::Campaign { path: directory.join(name), reason };
    let manifest: Manifest = serde_json::from_str(&text(directory.join(MANIFEST))?)
        .map_err(|error| wrong(MANIFEST, error.to_string()))?;
    let mission_toml = text(directory.join("mission.toml"))?;
    let dispersion_toml = text(directory.join("dispersion.toml"))?;
    let mut mission = vehicles::mission::from_toml(&mission_toml, "mission.toml")
        .map_err(|error| wrong("mission.toml", error.to_string()))?;
    mission.steered = manifest.steered;
    let faults = manifest.faults.iter().map(|fault| fault.parse().map_err(|error| format!("{error}")));
    Ok(Recipe {
        mission,
        mission_toml,
        dispersion: Dispersion::from_toml(&dispersion_toml, "dispersion.toml")
            .map_err(|error| wrong("dispersion.toml", error.to_string()))?,
        dispersion_name: manifest.dispersion,
        dispersion_toml,
        seed: manifest.seed,
        controller: manifest
            .controller
            .parse()
            .map_err(|error| wrong(MANIFEST, format!("controller: {error}")))?,
        faults: faults.collect::<Result<_, _>>().map_err(|reason| wrong(MANIFEST, reason))?,
    })
}

fn rows(directory: &Path) -> Result<Vec<Row>, GateError> {
    let path = directory.join(ROWS);
    let csv = text(path.clone())?;
    let rows: Result<Vec<Row>, csv::Error> = csv::Reader::from_reader(csv.as_bytes()).deserialize().collect();
    rows.map_err(|error| GateError::Campaign { path, reason: error.to_string() })
}

fn text(path: PathBuf) -> Result<String, GateError> {
    std::fs::read_to_string(&path).map_err(|source| GateError::Read { path, source })
}
