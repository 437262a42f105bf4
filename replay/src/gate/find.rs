//! Finds the flights of a directory: its logs and its campaigns, in subdirectories, too.

use std::path::{Path, PathBuf};

use super::campaign::{MANIFEST, flights_of};

/// Why there is nothing to hold against a baseline.
#[derive(Debug, thiserror::Error)]
pub enum GateError {
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

/// Finds every flight of a directory, by name.
///
/// # Errors
/// See [`GateError`].
pub fn find(directory: &Path) -> Result<Vec<Found>, GateError> {
    let mut found = Vec::new();
    walk(directory, directory, &mut found)?;
    if found.is_empty() {
        return Err(GateError::Nothing { path: directory.to_owned() });
    }
    found.sort_by(|a, b| (&a.path, a.number).cmp(&(&b.path, b.number)));
    Ok(found)
}

fn walk(root: &Path, directory: &Path, found: &mut Vec<Found>) -> Result<(), GateError> {
    let failed = |source| GateError::Read { path: directory.to_owned(), source };
    let name = |path: &Path| path.strip_prefix(root).unwrap_or(path).display().to_string();
    if directory.join(MANIFEST).is_file() {
        for number in flights_of(directory)? {
            let below = name(directory);
            let name = if below.is_empty() { format!("#{number}") } else { format!("{below}#{number}") };
            found.push(Found { name, path: directory.to_owned(), number: Some(number) });
        }
    }
    for entry in std::fs::read_dir(directory).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() {
            walk(root, &path, found)?;
        } else if path.extension().is_some_and(|ending| ending == "mcap") {
            found.push(Found { name: name(&path), path, number: None });
        }
    }
    Ok(())
}
