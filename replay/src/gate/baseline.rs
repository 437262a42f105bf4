//! The baseline: the outcomes that an earlier run accepted.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use protocol::log::build::build_info;
use serde::{Deserialize, Serialize};

use super::{Checked, Outcome};
use crate::output::{Destination, NewFile, Overwrite};

const FORMAT: u32 = 1;

/// Why a baseline cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BaselineError {
    /// It cannot be read.
    #[error("{}: cannot be read; --accept writes a first baseline", path.display())]
    Read {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// It cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// It is no baseline.
    #[error("{}: is no baseline of `replay gate`: {reason}", path.display())]
    Content { path: PathBuf, reason: String },
}

/// The accepted outcomes, by flight.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    format: u32,
    /// The build whose outcomes they are.
    build: BTreeMap<String, String>,
    pub flights: BTreeMap<String, Outcome>,
}

impl Baseline {
    /// The outcomes of this build, without the files that hold no flight.
    pub fn of(mut flights: BTreeMap<String, Outcome>) -> Self {
        flights.retain(|_, outcome| outcome.checked != Checked::NoFlight);
        Self { format: FORMAT, build: build_info(), flights }
    }

    /// Reads a baseline.
    ///
    /// # Errors
    /// See [`BaselineError`].
    pub fn read(path: &Path) -> Result<Self, BaselineError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| BaselineError::Read { path: path.to_owned(), source })?;
        let wrong = |reason: String| BaselineError::Content { path: path.to_owned(), reason };
        let baseline: Self = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        if baseline.format != FORMAT {
            return Err(wrong(format!("format {}; this build reads {FORMAT}", baseline.format)));
        }
        Ok(baseline)
    }

    /// Writes the baseline, complete or not at all; replaces an earlier one.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), BaselineError> {
        let failed = |source| BaselineError::Write { path: path.to_owned(), source };
        let text = serde_json::to_string_pretty(self).map_err(|error| failed(error.into()))?;
        let destination = Destination { path, overwrite: Overwrite::Always };
        let mut file = NewFile::create(destination, Path::new("")).map_err(failed)?;
        writeln!(file, "{text}").map_err(failed)?;
        file.commit().map_err(failed)
    }
}
