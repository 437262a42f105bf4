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
    /// Lines of the mission or of the dispersions, with a semicolon between two changes.
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
    /// Those inside the landing paper's Table 2; `None` in rows that were flown before it counted.
    pub(crate) table_2: Option<u64>,
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
        let (mut mission, mut dispersion) = (recipe.mission_toml.clone(), recipe.dispersion_toml.clone());
        for change in self.change.split(';').map(str::trim).filter(|change| !change.is_empty()) {
            let changed = [&mut mission, &mut dispersion].into_iter().find_map(|toml| {
                let with = replaced(toml, change)?;
                *toml = with;
                Some(())
            });
            if changed.is_none() {
                mission = format!("{mission}\n{change}");
            }
        }
        let faults = self.fault.split_whitespace().map(str::parse).collect::<Result<Vec<_>, _>>()?;
        let texts = (recipe.mission.name.as_str(), mission.as_str());
        let recipe = Recipe::from_texts(texts, (&self.dispersion, &dispersion))?;
        Ok(Recipe { faults, seed: self.seed, ..recipe })
    }
}

/// A text whose line with the key of a change is the change; `None` if it has no such line.
fn replaced(toml: &str, change: &str) -> Option<String> {
    let key = change.split(['=', '\n']).next()?;
    toml.lines().find(|line| line.starts_with(key)).map(|line| toml.replacen(line, change, 1))
}
