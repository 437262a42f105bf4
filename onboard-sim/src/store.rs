//! A campaign's directory: the inputs of its results, and a row for each flown flight.
//!
//! Rows are appended as the flights end, and sorted when all are flown. A stopped campaign
//! continues with the flights that have no complete line. A directory belongs to one campaign;
//! another one is refused.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use sha2::Digest as _;
use sim::recipe::Recipe;

use crate::files::{WriteError, write_folder};
use crate::row::{COLUMNS, Row};
use crate::summary::{Summary, to_markdown};

const MANIFEST: &str = "manifest.json";
const MISSION: &str = "mission.toml";
const DISPERSION: &str = "dispersion.toml";
const FLIGHTS: &str = "flights.csv";
/// Number of rows after which they are synced to the disk.
const SYNCED_ROWS: usize = 10;

/// Everything that the results in a directory depend on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Name of the mission.
    pub mission: String,
    /// Digest of its text.
    pub mission_sha256: String,
    /// Name of the dispersions.
    pub dispersion: String,
    /// Digest of their text.
    pub dispersion_sha256: String,
    pub seed: u64,
    /// Flights of the complete campaign; they are numbered from 0.
    pub flights: u64,
    /// Faults, as written on a command line.
    pub faults: Vec<String>,
    /// The program.
    pub build: String,
}

impl Manifest {
    /// For this many flights of a recipe; `build` names the program.
    pub fn of(recipe: &Recipe, flights: u64, build: &str) -> Self {
        Self {
            mission: recipe.mission.name.clone(),
            mission_sha256: sha256(&recipe.mission_toml),
            dispersion: recipe.dispersion_name.clone(),
            dispersion_sha256: sha256(&recipe.dispersion_toml),
            seed: recipe.seed,
            flights,
            faults: recipe.faults.iter().map(ToString::to_string).collect(),
            build: build.to_owned(),
        }
    }

    fn read(directory: &Path) -> Result<Self, StoreError> {
        let path = directory.join(MANIFEST);
        let text = fs::read(&path).map_err(unreadable(&path))?;
        serde_json::from_slice(&text).map_err(|error| StoreError::content(&path, &error))
    }

    /// Refuses a directory with another manifest, and names the first difference.
    fn refuse_other(&self, directory: &Path, other: &Self) -> Result<(), StoreError> {
        if self == other {
            return Ok(());
        }
        let [here, there] = [self, other].map(|manifest| serde_json::to_value(manifest).unwrap_or_default());
        let differs = here.as_object().into_iter().flatten().find(|(key, here)| there[*key] != **here);
        let words = |(key, here): (&String, _)| format!("its {key} is {}, this run's is {here}", there[key]);
        let difference = differs.map_or_else(|| format!("another {MANIFEST}"), words);
        Err(StoreError::OtherCampaign { path: directory.to_owned(), difference })
    }
}

/// SHA-256 as lower-case hexadecimal digits.
pub fn sha256(bytes: impl AsRef<[u8]>) -> String {
    sha2::Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat()
}

/// Why a directory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("{}", path.display())]
    Read {
        path: PathBuf,
        #[source]
        source: io::Error,
    },
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file has the wrong content.
    #[error("{}: {message}", path.display())]
    Content { path: PathBuf, message: String },
    #[error("{} holds other results: {difference}; give another directory", path.display())]
    OtherCampaign { path: PathBuf, difference: String },
    /// A new campaign would overwrite an existing file.
    #[error("{} already exists and belongs to no campaign; give another directory", .0.display())]
    Foreign(PathBuf),
    #[error("{} is in use by another process", .0.display())]
    InUse(PathBuf),
}

impl StoreError {
    fn content(path: &Path, error: &dyn ToString) -> Self {
        Self::Content { path: path.to_owned(), message: error.to_string() }
    }
}

fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::Read { path, source }
}

/// A directory in use by this process.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    manifest: Manifest,
    /// The rows so far, by their flights' numbers, and the file that has them.
    rows: Mutex<(BTreeMap<u64, Row>, File)>,
    /// Locked as long as the directory is in use.
    _lock: File,
}

impl Store {
    /// Creates a directory for a campaign, or opens one that was created for the same campaign.
    ///
    /// # Errors
    /// The directory was created for another campaign, is in use, or cannot be read or written.
    pub fn open(path: &Path, recipe: &Recipe, manifest: Manifest) -> Result<Self, StoreError> {
        fs::create_dir_all(path).map_err(unreadable(path))?;
        let lock =
            File::options().create(true).append(true).open(path.join("lock")).map_err(unreadable(path))?;
        lock.try_lock().map_err(|_held| StoreError::InUse(path.to_owned()))?;
        if path.join(MANIFEST).exists() {
            manifest.refuse_other(path, &Manifest::read(path)?)?;
        } else {
            refuse_foreign(path)?;
            let text =
                serde_json::to_vec_pretty(&manifest).map_err(|error| StoreError::content(path, &error))?;
            write_folder(path, &[(MANIFEST, text)])?;
        }
        let rows = read_rows(path, &manifest)?;
        let texts = [(MISSION, &recipe.mission_toml), (DISPERSION, &recipe.dispersion_toml)];
        let mut files = texts.map(|(name, text)| (name, text.clone().into_bytes())).to_vec();
        files.push((FLIGHTS, to_csv(rows.values(), true)?));
        write_folder(path, &files)?;
        let file = path.join(FLIGHTS);
        let file = File::options().append(true).open(&file).map_err(unreadable(&file))?;
        Ok(Self { path: path.to_owned(), manifest, rows: Mutex::new((rows, file)), _lock: lock })
    }

    /// The numbers of the flights that are not flown yet.
    pub fn missing(&self) -> Vec<u64> {
        let (rows, _) = &*self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        (0..self.manifest.flights).filter(|number| !rows.contains_key(number)).collect()
    }

    /// Writes the row of a flight, complete or not at all.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn add(&self, row: Row) -> Result<(), StoreError> {
        let (rows, file) = &mut *self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let path = self.path.join(FLIGHTS);
        let line = to_csv([&row], rows.is_empty())?;
        let before = file.metadata().map_err(unreadable(&path))?.len();
        let synced =
            |file: &File| if (rows.len() + 1) % SYNCED_ROWS == 0 { file.sync_data() } else { Ok(()) };
        file.write_all(&line).and_then(|()| synced(file)).map_err(|error| {
            // If it fails, the incomplete line is removed when the campaign continues: it has no
            // line end.
            let _ = file.set_len(before);
            StoreError::content(&path, &error)
        })?;
        rows.insert(row.number, row);
        Ok(())
    }

    /// Writes the rows in the order of their numbers, and the summary.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn publish(self) -> Result<Summary, StoreError> {
        let (rows, _) = self.rows.into_inner().unwrap_or_else(PoisonError::into_inner);
        let table = to_csv(rows.values(), true)?;
        let rows: Vec<Row> = rows.into_values().collect();
        let summary = Summary::new(&self.manifest, &rows);
        let json = serde_json::to_vec_pretty(&summary);
        let json = json.map_err(|error| StoreError::content(&self.path.join("summary.json"), &error))?;
        let markdown = to_markdown(&summary).into_bytes();
        write_folder(&self.path, &[(FLIGHTS, table), ("summary.json", json), ("summary.md", markdown)])?;
        Ok(summary)
    }
}

/// Refuses a directory with files of these names but without a manifest, because no campaign wrote
/// them.
fn refuse_foreign(directory: &Path) -> Result<(), StoreError> {
    let names = [MISSION, DISPERSION, FLIGHTS, "summary.json", "summary.md", "cost.json"];
    let found =
        names.map(|name| directory.join(name)).into_iter().find(|path| path.symlink_metadata().is_ok());
    found.map_or(Ok(()), |path| Err(StoreError::Foreign(path)))
}

/// The rows in a directory, but for a last line that was cut. They have this program's columns and
/// the manifest's flights.
fn read_rows(directory: &Path, manifest: &Manifest) -> Result<BTreeMap<u64, Row>, StoreError> {
    let path = directory.join(FLIGHTS);
    let bytes = match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read.map_err(unreadable(&path))?,
    };
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let mut reader = csv::Reader::from_reader(&bytes[..whole]);
    let header = reader.headers().map_err(|error| StoreError::content(&path, &error))?;
    if whole > 0 && !header.iter().eq(COLUMNS.iter().map(|column| column.name)) {
        return Err(StoreError::content(&path, &"has the columns of another version of this program"));
    }
    let rows = reader.into_deserialize().map(|row: csv::Result<Row>| {
        let row = row.map_err(|error| StoreError::content(&path, &error))?;
        if row.number >= manifest.flights {
            return Err(StoreError::content(
                &path,
                &format!("has flight {}, which is not of it", row.number),
            ));
        }
        Ok((row.number, row))
    });
    rows.collect()
}

/// With a header if requested and if there is a row.
fn to_csv<'a>(rows: impl IntoIterator<Item = &'a Row>, has_header: bool) -> Result<Vec<u8>, StoreError> {
    let mut writer = csv::WriterBuilder::new().has_headers(has_header).from_writer(Vec::new());
    let written = rows.into_iter().try_for_each(|row| writer.serialize(row));
    written.map_err(|error| StoreError::content(Path::new(FLIGHTS), &error))?;
    writer.into_inner().map_err(|error| StoreError::content(Path::new(FLIGHTS), &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_fips_180_4_abc() {
        assert_eq!(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
