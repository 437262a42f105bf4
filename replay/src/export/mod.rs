//! A log's content in other programs' formats.
//!
//! * [`export_tables`]: CSV or Parquet, one file a table; see [`table`](crate::table).
//! * [`export_tlog`]: the raw MAVLink frames as a `.tlog`, which ground stations play back.
//!
//! The export to Rerun is a program of its own, because Rerun costs more to compile than all the rest.

mod csv;
mod parquet;
mod tables;
mod tlog;

pub use tables::{ExportedFile, TableFormat, export_tables};
pub use tlog::{ExportedTlog, export_tlog};

use std::path::PathBuf;

use crate::log::LogError;

/// Why a log could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// Not a flight log, or not readable.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A file cannot be made or written.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The Parquet writer refused.
    #[error("{}: cannot be written as Parquet", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// What the writer said.
        source: ::parquet::errors::ParquetError,
    },
    /// Nothing of the kind in the log.
    #[error("{name}: has {found}; {wanted}")]
    Nothing {
        /// The log.
        name: String,
        /// What there is.
        found: String,
        /// What would be accepted.
        wanted: String,
    },
}
