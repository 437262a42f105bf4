//! A row of `onboard-sim/mk3_trials.csv`: mk3 changed, or with a fault, flown many times.

use serde::{Deserialize, Serialize};
use sim::recipe::Recipe;

/// The trials' file.
pub(crate) const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/mk3_trials.csv");

/// A trial and its result.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Trial {
    pub(crate) table: String,
    pub(crate) row: String,
    /// A line of the mission, or lines behind it.
    change: String,
    fault: String,
    start: String,
    dispersion: String,
    seed: u64,
    pub(crate) flights: u64,
    /// Flights that stand undamaged.
    pub(crate) stands: u64,
    /// Those of them that touched down inside the design envelope of the legs.
    pub(crate) envelope: u64,
    /// Vertical speed at the contact of flight 0, m/s.
    pub(crate) first_m_s: String,
}

/// The trials of a file.
pub(crate) fn read(text: &str) -> Result<Vec<Trial>, csv::Error> {
    csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes()).into_deserialize().collect()
}

impl Trial {
    /// What flies.
    pub(crate) fn recipe(&self) -> anyhow::Result<Recipe> {
        let recipe = Recipe::built_in("mk3", &self.dispersion)?.starting_at(self.start.parse()?)?;
        let key = self.change.split('=').next().unwrap_or_default();
        let line = recipe.mission_toml.lines().find(|line| !key.is_empty() && line.starts_with(key));
        let mission_toml = match line {
            Some(line) => recipe.mission_toml.replace(line, &self.change),
            None => format!("{}\n{}", recipe.mission_toml, self.change),
        };
        let faults = self.fault.split_whitespace().map(str::parse).collect::<Result<Vec<_>, _>>()?;
        Ok(Recipe { faults, seed: self.seed, ..recipe.with_mission(mission_toml)? })
    }
}
