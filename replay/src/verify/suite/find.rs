//! Finds the flights of a directory: its logs and its campaigns, in subdirectories, too.
//!
//! Each regular file counts once, however many links lead to it. What is no file (a pipe, a link to nothing) is never
//! opened, and is told.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::fly::{MANIFEST, flights_of};

/// Why there is nothing to hold against a baseline.
#[derive(Debug, thiserror::Error)]
pub enum SuiteError {
    /// A directory or a file of a campaign cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// A file of a campaign has the wrong content.
    #[error("{}: {reason}", path.display())]
    Campaign { path: PathBuf, reason: String },
    /// There is no flight.
    #[error("{}: holds no log (*.mcap) and no campaign ({MANIFEST})", path.display())]
    Nothing { path: PathBuf },
    /// There are logs, and none holds a flight.
    #[error("{}: none of its logs holds a flight; {name}: {why}", path.display())]
    NoFlights {
        path: PathBuf,
        /// The first log.
        name: String,
        /// Why it holds no flight.
        why: String,
    },
}

/// A flight that was found.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Found {
    /// Its name: the path below the directory; a campaign's flight adds `#NUMBER`.
    pub name: String,
    /// The log, or the campaign's directory.
    pub path: PathBuf,
    /// The number of a campaign's flight.
    pub number: Option<u64>,
}

/// What has the name of a log or a directory and was left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// The path below the directory.
    pub name: String,
    pub reason: &'static str,
}

/// Finds every flight of a directory, by name, and what was left out.
///
/// # Errors
/// See [`SuiteError`].
pub fn find(directory: &Path) -> Result<(Vec<Found>, Vec<Skipped>), SuiteError> {
    let mut search =
        Search { root: directory, seen: BTreeSet::new(), found: Vec::new(), skipped: Vec::new() };
    search.walk(directory)?;
    let Search { mut found, mut skipped, .. } = search;
    if found.is_empty() {
        return Err(SuiteError::Nothing { path: directory.to_owned() });
    }
    found.sort_by(|a, b| (&a.path, a.number).cmp(&(&b.path, b.number)));
    skipped.sort_by(|a, b| a.name.cmp(&b.name));
    Ok((found, skipped))
}

struct Search<'a> {
    root: &'a Path,
    /// Files and directories without links in their paths.
    seen: BTreeSet<PathBuf>,
    found: Vec<Found>,
    skipped: Vec<Skipped>,
}

impl Search<'_> {
    fn walk(&mut self, directory: &Path) -> Result<(), SuiteError> {
        let failed = |source| SuiteError::Read { path: directory.to_owned(), source };
        self.seen.insert(directory.canonicalize().map_err(failed)?);
        if directory.join(MANIFEST).is_file() {
            for number in flights_of(directory)? {
                let below = self.name(directory);
                let name = if below.is_empty() { format!("#{number}") } else { format!("{below}#{number}") };
                self.found.push(Found { name, path: directory.to_owned(), number: Some(number) });
            }
        }
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(directory).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let is_link = entry.file_type().map_err(failed)?.is_symlink();
            paths.push((is_link, entry.path()));
        }
        // What is itself here comes before what only leads here, so that it keeps its name.
        paths.sort();
        for (_, path) in paths {
            self.take(path)?;
        }
        Ok(())
    }

    fn take(&mut self, path: PathBuf) -> Result<(), SuiteError> {
        let is_log = path.extension().is_some_and(|ending| ending == "mcap");
        let Ok((real, kind)) = path.canonicalize().and_then(|real| Ok((real, path.metadata()?))) else {
            if is_log {
                self.skip(&path, "a link to nothing");
            }
            return Ok(());
        };
        if kind.is_dir() {
            if self.seen.contains(&real) {
                self.skip(&path, "a directory that is here already");
                return Ok(());
            }
            return self.walk(&path);
        }
        if !is_log {
            return Ok(());
        }
        if !kind.is_file() {
            self.skip(&path, "not a regular file");
        } else if self.seen.insert(real) {
            self.found.push(Found { name: self.name(&path), path, number: None });
        } else {
            self.skip(&path, "a log that is here already");
        }
        Ok(())
    }

    fn skip(&mut self, path: &Path, reason: &'static str) {
        self.skipped.push(Skipped { name: self.name(path), reason });
    }

    /// The path below the directory.
    fn name(&self, path: &Path) -> String {
        path.strip_prefix(self.root).unwrap_or(path).display().to_string()
    }
}
