//! The order of a campaign: everything that its results depend on.

use serde::{Deserialize, Serialize};
use sha2::Digest as _;
use sim::recipe::Recipe;

/// A campaign's order.
#[derive(Debug, Clone)]
pub struct Order {
    /// The recipe of every flight.
    pub recipe: Recipe,
    /// Number of flights; they are numbered from 0.
    pub flights: u64,
}

impl Order {
    /// The manifest that identifies the results; `build` names the program.
    pub fn manifest(&self, build: &str, shard: Shard) -> Manifest {
        let recipe = &self.recipe;
        Manifest {
            format: FORMAT,
            mission: recipe.mission.name.clone(),
            mission_sha256: sha256(&recipe.mission_toml),
            dispersion: recipe.dispersion_name.clone(),
            dispersion_sha256: sha256(&recipe.dispersion_toml),
            seed: recipe.seed,
            flights: self.flights,
            controller: recipe.controller.name().to_owned(),
            steered: recipe.mission.steered,
            faults: recipe.faults.iter().map(ToString::to_string).collect(),
            build: build.to_owned(),
            shard,
        }
    }
}

/// Version of the directory's layout and of the columns. 2: the window of an attainable landing.
pub(crate) const FORMAT: u32 = 2;

/// The inputs from which the results in a directory were made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the layout.
    pub format: u32,
    /// Name of the mission.
    pub mission: String,
    /// Digest of its text.
    pub mission_sha256: String,
    /// Name of the dispersions.
    pub dispersion: String,
    /// Digest of their text.
    pub dispersion_sha256: String,
    pub seed: u64,
    /// Flights of the whole campaign.
    pub flights: u64,
    /// Name of the controller.
    pub controller: String,
    /// Whether the fins steer.
    pub steered: bool,
    /// Faults, as written on a command line.
    pub faults: Vec<String>,
    /// The program.
    pub build: String,
    /// Which part of the campaign.
    pub shard: Shard,
}

impl Manifest {
    /// The first difference from another manifest, in words; `None` if the manifests are equal.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let pairs = [
            ("format", self.format.to_string(), other.format.to_string()),
            ("mission", self.mission.clone(), other.mission.clone()),
            ("text of the mission, SHA-256", self.mission_sha256.clone(), other.mission_sha256.clone()),
            ("dispersion", self.dispersion.clone(), other.dispersion.clone()),
            (
                "text of the dispersion, SHA-256",
                self.dispersion_sha256.clone(),
                other.dispersion_sha256.clone(),
            ),
            ("seed", self.seed.to_string(), other.seed.to_string()),
            ("number of flights", self.flights.to_string(), other.flights.to_string()),
            ("controller", self.controller.clone(), other.controller.clone()),
            ("steering by fins", self.steered.to_string(), other.steered.to_string()),
            ("faults", self.faults.join(" "), other.faults.join(" ")),
            ("program", self.build.clone(), other.build.clone()),
            ("shard", self.shard.to_string(), other.shard.to_string()),
        ];
        pairs
            .into_iter()
            .find(|(_, one, two)| one != two)
            .map(|(what, one, two)| format!("its {what} is `{one}`, this run's is `{two}`"))
    }
}

/// Part `index` of `count`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// The number of the part, from 1.
    pub index: u64,
    /// The number of parts.
    pub count: u64,
}

impl Shard {
    /// The whole campaign as one part.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Whether a chunk belongs to this part.
    pub fn has(self, chunk: u64) -> bool {
        chunk % self.count + 1 == self.index
    }
}

/// Why the text of a shard is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shard `{0}` is not I/N with 1 <= I <= N")]
pub struct ShardError(String);

impl core::str::FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parts =
            text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        parts
            .filter(|(index, count)| (1..=*count).contains(index))
            .map(|(index, count)| Self { index, count })
            .ok_or_else(|| ShardError(text.to_owned()))
    }
}

impl core::fmt::Display for Shard {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

fn sha256(text: &str) -> String {
    hex(&sha2::Sha256::digest(text))
}

/// Bytes as lower-case hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    use core::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut hex, byte| {
        // Writing to a String cannot fail.
        let _ = write!(hex, "{byte:02x}");
        hex
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_fips_180_4_abc() {
        assert_eq!(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn shards_are_parsed_and_divide_all_chunks() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].iter().map(|text| text.parse().unwrap()).collect();
        for chunk in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(chunk)).count(), 1);
        }
        for wrong in ["", "0/2", "3/2", "1", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().unwrap_err().to_string().contains("I/N"));
        }
    }
}
