//! A campaign's order, which is everything that its results depend on, and its directory: manifest, finished chunks of
//! flights, results.
//!
//! A chunk is written under a temporary name and renamed when it is complete, so a stopped campaign can continue with
//! the finished chunks. A directory belongs to one order; another order is refused.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::Digest as _;
use sim::recipe::Recipe;

use crate::row::{self, Row};
use crate::summary::PICTURES;

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
    /// Faults, as written on a command line.
    pub faults: Vec<String>,
    /// The program.
    pub build: String,
    /// Which part of the campaign.
    pub shard: Shard,
}

impl Manifest {
    /// The order whose results these are, from the texts in the directory.
    fn order(&self, mission_toml: &str, dispersion_toml: &str) -> Result<Order, Box<dyn core::error::Error>> {
        let texts = (("mission.toml", mission_toml), (self.dispersion.as_str(), dispersion_toml));
        let mut recipe = Recipe::from_texts(texts.0, texts.1)?;
        recipe.seed = self.seed;
        recipe.faults = self.faults.iter().map(|fault| fault.parse()).collect::<Result<_, _>>()?;
        Ok(Order { recipe, flights: self.flights })
    }

    /// What it holds, in words.
    fn words(&self) -> [(&'static str, String); 10] {
        [
            ("format", self.format.to_string()),
            ("mission", self.mission.clone()),
            ("text of the mission, SHA-256", self.mission_sha256.clone()),
            ("dispersion", self.dispersion.clone()),
            ("text of the dispersion, SHA-256", self.dispersion_sha256.clone()),
            ("seed", self.seed.to_string()),
            ("number of flights", self.flights.to_string()),
            ("faults", self.faults.join(" ")),
            ("program", self.build.clone()),
            ("shard", self.shard.to_string()),
        ]
    }

    /// The first difference from another manifest, in words; `None` if the manifests are equal.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let ((what, one), (_, two)) =
            self.words().into_iter().zip(other.words()).find(|(one, two)| one != two)?;
        Some(format!("its {what} is `{one}`, this run's is `{two}`"))
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

pub const CHUNK_FLIGHTS: u64 = 10;

/// Result files, except the pictures.
const RESULTS: [&str; 5] = ["flights.csv", "flights.parquet", "summary.json", "summary.md", "cost.json"];

/// Why a directory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file cannot be read or written.
    #[error("{path}")]
    File {
        path: PathBuf,
        #[source]
        source: io::Error,
    },
    /// A file has the wrong content.
    #[error("{path}: {message}")]
    Content {
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The directory holds the results of another order.
    #[error("{path} holds other results: {difference}; give another directory")]
    OtherOrder {
        /// The directory.
        path: PathBuf,
        difference: String,
    },
    /// A part of a campaign has the columns of another version of this program.
    #[error(
        "{path} has format {found}, this program merges format {FORMAT}; merge it with the program that flew it"
    )]
    OtherFormat {
        /// The directory.
        path: PathBuf,
        found: u32,
    },
    /// A new campaign would overwrite an existing file.
    #[error("{path} already exists and belongs to no campaign; give another directory")]
    Foreign { path: PathBuf },
    /// Another process uses the directory.
    #[error("{path} is in use by another process")]
    InUse {
        /// The directory.
        path: PathBuf,
    },
    /// Some flights are missing.
    #[error("flights {from} to {to} are in none of the directories; fly the missing ones first")]
    Missing {
        from: u64,
        /// The last missing flight; `from` is the first.
        to: u64,
    },
    /// Two directories have different results for the same flights.
    #[error("{one} and {two} have different results for the flights from {from} on")]
    Contradiction {
        /// The first flight of the chunk.
        from: u64,
        /// The first directory.
        one: PathBuf,
        /// The second directory.
        two: PathBuf,
    },
}

fn file_error(path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::File { path, source }
}

/// A directory in use by this process.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    manifest: Manifest,
    /// Locked as long as the directory is in use.
    _lock: File,
}

impl Store {
    /// Creates a directory for an order, or opens one that was created for the same order.
    ///
    /// # Errors
    /// The directory was created for another order, is in use, or cannot be written.
    pub fn open(path: &Path, order: &Order, manifest: &Manifest) -> Result<Self, StoreError> {
        let chunks = path.join("chunks");
        fs::create_dir_all(&chunks).map_err(file_error(&chunks))?;
        let lock_path = path.join("lock");
        let lock = File::create(&lock_path).map_err(file_error(&lock_path))?;
        lock.try_lock().map_err(|_held| StoreError::InUse { path: path.to_owned() })?;
        if path.join("manifest.json").exists() {
            if let Some(difference) = read_manifest(path)?.difference(manifest) {
                return Err(StoreError::OtherOrder { path: path.to_owned(), difference });
            }
        } else {
            refuse_loss(path, order)?;
            write_whole(&path.join("mission.toml"), order.recipe.mission_toml.as_bytes())?;
            write_whole(&path.join("dispersion.toml"), order.recipe.dispersion_toml.as_bytes())?;
            let text = serde_json::to_string_pretty(manifest).map_err(|error| StoreError::Content {
                path: path.join("manifest.json"),
                message: error.to_string(),
            })?;
            write_whole(&path.join("manifest.json"), text.as_bytes())?;
        }
        Ok(Self { path: path.to_owned(), manifest: manifest.clone(), _lock: lock })
    }

    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The numbers of the chunks that belong to this directory.
    pub fn chunks(&self) -> impl Iterator<Item = u64> + use<> {
        let shard = self.manifest.shard;
        (0..self.manifest.flights.div_ceil(CHUNK_FLIGHTS)).filter(move |chunk| shard.has(*chunk))
    }

    /// The flights of a chunk.
    pub fn flights_of(&self, chunk: u64) -> core::ops::Range<u64> {
        let from = chunk * CHUNK_FLIGHTS;
        from..(from + CHUNK_FLIGHTS).min(self.manifest.flights)
    }

    /// Whether a chunk is finished.
    pub fn has(&self, chunk: u64) -> bool {
        chunk_path(&self.path, chunk).exists()
    }

    /// Writes a chunk.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, chunk: u64, rows: &[Row]) -> Result<(), StoreError> {
        let path = chunk_path(&self.path, chunk);
        let content = |message: String| StoreError::Content { path: path.clone(), message };
        let text = row::to_csv(rows).map_err(|error| content(error.to_string()))?;
        write_whole(&path, &text)
    }

    /// Every flight that belongs to this directory, in order.
    ///
    /// # Errors
    /// A chunk is missing or damaged.
    pub fn rows(&self) -> Result<Vec<Row>, StoreError> {
        let mut rows = Vec::new();
        for chunk in self.chunks() {
            let path = chunk_path(&self.path, chunk);
            let bytes = fs::read(&path).map_err(file_error(&path))?;
            let content = |message: String| StoreError::Content { path: path.clone(), message };
            let found = row::from_csv(&bytes).map_err(|error| content(error.to_string()))?;
            if !found.iter().map(|row| row.number).eq(self.flights_of(chunk)) {
                return Err(content(format!("does not hold the flights {:?}", self.flights_of(chunk))));
            }
            rows.extend(found);
        }
        Ok(rows)
    }

    /// Writes a result file; `name` is its name in the directory.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn publish(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        write_whole(&self.path.join(name), bytes)
    }
}

/// Refuses a directory with result files but without a manifest, because no campaign wrote those files. The only files
/// accepted are the texts of a campaign that was stopped before it wrote its manifest.
fn refuse_loss(directory: &Path, order: &Order) -> Result<(), StoreError> {
    let texts =
        [("mission.toml", &order.recipe.mission_toml), ("dispersion.toml", &order.recipe.dispersion_toml)];
    let is_own = |name: &str, path: &Path| {
        let text = texts.iter().find(|(known, _)| *known == name).map(|(_, text)| text.as_bytes());
        text.is_some() && fs::read(path).ok().as_deref() == text
    };
    let pictures = PICTURES.iter().map(|(name, _)| *name);
    for name in texts.iter().map(|(name, _)| *name).chain(RESULTS).chain(pictures) {
        let path = directory.join(name);
        if path.symlink_metadata().is_ok() && !is_own(name, &path) {
            return Err(StoreError::Foreign { path });
        }
    }
    Ok(())
}

fn chunk_path(directory: &Path, chunk: u64) -> PathBuf {
    directory.join("chunks").join(format!("{chunk:06}.csv"))
}

/// Writes under a temporary name first, so that a file of this name is always complete.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let unfinished = path.with_extension("unfinished");
    let written = File::create(&unfinished).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    written.and_then(|()| fs::rename(&unfinished, path)).map_err(file_error(path))
}

/// The manifest of a directory.
fn read_manifest(directory: &Path) -> Result<Manifest, StoreError> {
    let path = directory.join("manifest.json");
    let text = fs::read_to_string(&path).map_err(file_error(&path))?;
    serde_json::from_str(&text).map_err(|error| StoreError::Content { path, message: error.to_string() })
}

/// The order whose results a directory holds, from the texts in it.
///
/// # Errors
/// A text is missing, or this program does not know what it orders.
pub fn order_of(directory: &Path) -> Result<Order, StoreError> {
    let text = |name: &str| {
        let path = directory.join(name);
        fs::read_to_string(&path).map_err(file_error(&path))
    };
    let manifest = read_manifest(directory)?;
    manifest
        .order(&text("mission.toml")?, &text("dispersion.toml")?)
        .map_err(|error| StoreError::Content { path: directory.to_owned(), message: error.to_string() })
}

/// Merges the parts of a campaign into one directory. The order is rebuilt from the texts in the parts.
///
/// # Errors
/// The parts belong to different campaigns, contradict each other, or some flights are missing.
pub fn merge(parts: &[PathBuf], out: &Path) -> Result<(Store, Order), StoreError> {
    let nothing = || StoreError::Missing { from: 0, to: 0 };
    let first = parts.first().ok_or_else(nothing)?;
    let whole = |directory: &Path| -> Result<Manifest, StoreError> {
        Ok(Manifest { shard: Shard::WHOLE, ..read_manifest(directory)? })
    };
    let manifest = whole(first)?;
    if manifest.format != FORMAT {
        return Err(StoreError::OtherFormat { path: first.clone(), found: manifest.format });
    }
    for part in parts {
        if let Some(difference) = whole(part)?.difference(&manifest) {
            return Err(StoreError::OtherOrder { path: part.clone(), difference });
        }
    }
    let order = order_of(first)?;
    let store = Store::open(out, &order, &manifest)?;
    for chunk in store.chunks() {
        let mut found: Option<(Vec<u8>, &PathBuf)> = None;
        for part in parts.iter().filter(|part| chunk_path(part, chunk).exists()) {
            let path = chunk_path(part, chunk);
            let bytes = fs::read(&path).map_err(file_error(&path))?;
            match &found {
                Some((known, one)) if *known != bytes => {
                    let (one, two) = ((*one).clone(), part.clone());
                    return Err(StoreError::Contradiction { from: chunk * CHUNK_FLIGHTS, one, two });
                }
                Some(_) => {}
                None => found = Some((bytes, part)),
            }
        }
        let flights = store.flights_of(chunk);
        let missing = StoreError::Missing { from: flights.start, to: flights.end.saturating_sub(1) };
        let (bytes, _) = found.ok_or(missing)?;
        write_whole(&chunk_path(out, chunk), &bytes)?;
    }
    Ok((store, order))
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
