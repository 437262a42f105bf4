//! Where motors come from: the built-in ones, motor files, folders of them, and the list of the npm package
//! `thrustcurve-db`.

use std::fs;
use std::path::{Path, PathBuf};

use flight::vehicle::thrust_curve::ThrustCurve;

use crate::thrustcurve_db;

/// A motor to choose from.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The file, with the line in a list; `built in` for a built-in motor.
    pub origin: String,
    /// What a mission's `airframe.motor` says: the name of a built-in motor, or the text of its file.
    pub motor: String,
    /// Its data.
    pub curve: ThrustCurve,
    /// Whether its maker still makes it, as far as the source says.
    pub in_production: Option<bool>,
}

impl Candidate {
    /// Maker and name.
    pub fn name(&self) -> String {
        format!("{} {}", self.curve.manufacturer(), self.curve.name()).trim().to_owned()
    }
}

/// A motor that cannot be used, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unusable {
    /// Its name, as far as it is known.
    pub name: String,
    /// The file, with the line in a list.
    pub origin: String,
    /// What is wrong, with the value and what would be accepted.
    pub reason: String,
}

/// A motor of a source.
pub type Found = Result<Candidate, Unusable>;

/// Why a source has no motors to choose from.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// A file or folder cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    /// A folder holds no motor file.
    #[error("{} holds no file that ends in .eng, .rse or .json; folders in it are not looked into", .0.display())]
    Empty(PathBuf),
    /// A list is not one.
    #[error("{}", path.display())]
    List {
        path: PathBuf,
        #[source]
        source: thrustcurve_db::ListError,
    },
}

/// The endings of the files that are read from a folder.
const ENDINGS: [&str; 3] = ["eng", "rse", "json"];

/// The motors that come with the program.
pub fn built_in() -> Vec<Found> {
    let found = vehicles::motors::names().map(|name| match vehicles::motors::builtin(name) {
        Ok(curve) => Ok(Candidate {
            origin: "built in".to_owned(),
            motor: name.to_owned(),
            curve,
            in_production: None,
        }),
        Err(error) => {
            Err(Unusable { name: name.to_owned(), origin: "built in".to_owned(), reason: error.to_string() })
        }
    });
    found.collect()
}

/// The motors of a motor file (`.eng`, `.rse`), a list (`.json`, of the npm package `thrustcurve-db`), or a folder of
/// these in the order of their names. A broken file in it is a motor that cannot be used.
///
/// # Errors
/// The path cannot be read, or a folder holds no such file, or a list is not one.
pub fn read(path: &Path) -> Result<Vec<Found>, SourceError> {
    if !path.is_dir() {
        return read_file(path);
    }
    let unreadable = |source| SourceError::Read { path: path.to_owned(), source };
    let mut files = fs::read_dir(path)
        .and_then(|entries| {
            entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>()
        })
        .map_err(unreadable)?;
    files.retain(|file| ENDINGS.iter().any(|ending| has_ending(file, ending)) && file.is_file());
    files.sort();
    if files.is_empty() {
        return Err(SourceError::Empty(path.to_owned()));
    }
    let mut found = Vec::new();
    for file in files {
        found.extend(read_file(&file)?);
    }
    Ok(found)
}

fn has_ending(file: &Path, wanted: &str) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(wanted))
}

fn read_file(path: &Path) -> Result<Vec<Found>, SourceError> {
    let bytes = fs::read(path).map_err(|source| SourceError::Read { path: path.to_owned(), source })?;
    // Old files have makers' names in Latin-1. Only names and comments can be touched by this.
    let text = String::from_utf8_lossy(&bytes);
    if has_ending(path, "json") {
        return thrustcurve_db::parse(&text, &path.display().to_string())
            .map_err(|source| SourceError::List { path: path.to_owned(), source });
    }
    Ok(vec![one(path, &text)])
}

/// The motor of a motor file's text.
fn one(path: &Path, text: &str) -> Found {
    let origin = path.display().to_string();
    let text = text.trim_start_matches('\u{feff}');
    let curve = vehicles::thrust_curve::from_file_text(&origin, text).map_err(|error| Unusable {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        origin: origin.clone(),
        reason: error.to_string(),
    })?;
    // A mission takes a text without a line break for a name.
    let motor = format!("{}\n", text.trim_end());
    Ok(Candidate { origin, motor, curve, in_production: None })
}
