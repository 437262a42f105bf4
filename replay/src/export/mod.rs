//! Writes the content of a log in the formats of other programs.
//!
//! * [`export_tables`]: CSV or Parquet, one file a table; see [`table`](crate::table).
//! * [`export_tlog`]: the raw MAVLink frames as a `.tlog`, which ground stations play back.
//!
//! A separate program exports to Rerun, because Rerun costs more to compile than all the rest.

mod csv;
mod dictionary;
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
    /// The file is not a flight log, or cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A file cannot be created or written.
    #[error("{}: cannot be written", path.display())]
    Write {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// The Parquet writer failed.
    #[error("{}: cannot be written as Parquet", path.display())]
    Parquet {
        path: PathBuf,
        /// Error from the writer.
        source: ::parquet::errors::ParquetError,
    },
    /// The log has no such content.
    #[error("{name}: has {found}; {wanted}")]
    Nothing {
        /// The log.
        name: String,
        /// What the log has.
        found: String,
        wanted: String,
    },
}
