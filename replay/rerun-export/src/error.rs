//! Why a log could not be exported.

use std::path::PathBuf;

use replay::log::LogError;
use rerun::RecordingStreamError;

/// Why a log could not be exported. Damage inside a log is not a reason.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The log cannot be used.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The recording's file already exists.
    #[error("{}: already exists; --force overwrites it", path.display())]
    Exists { path: PathBuf },
    /// The recording would overwrite the log.
    #[error("{}: is the log itself; name another file for the recording", path.display())]
    IsTheLog { path: PathBuf },
    /// The recording's file cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// Rerun cannot encode the recording or write it to its file.
    #[error("the recording cannot be encoded or written: {reason}")]
    Encode {
        /// Error from Rerun.
        reason: String,
    },
    /// No viewer takes the recording.
    #[error("{address}: no Rerun viewer takes the recording ({reason}); start one with `rerun`")]
    NoViewer {
        address: String,
        /// Error from Rerun.
        reason: String,
    },
    /// Rerun refuses a record.
    #[error("Rerun refused a record")]
    Record(#[from] RecordingStreamError),
}
