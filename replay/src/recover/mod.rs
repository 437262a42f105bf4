//! A whole log out of a damaged one.
//!
//! A recorder that was killed leaves a log without its end; a disk may break one in its middle. Every chunk whose
//! checksum holds is kept, also behind a broken one; what is lost is said, with its span where the file still tells.
//! Nothing is invented: a message is kept as it is or not at all.

mod walk;
mod write;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::log::LogError;
use crate::output::Destination;
use walk::{Piece, Walk};
use write::Rescue;

/// Why nothing could be recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// Not an MCAP file, or not readable.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The file cannot be made.
    #[error("{}: cannot be created", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Writing failed.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the writer said.
        source: mcap::McapError,
    },
}

/// A stretch of a file that could not be kept.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lost {
    /// Its first byte.
    pub from_byte: u64,
    /// Its length.
    pub bytes: u64,
    /// The times of its messages, s after the first message of the log; `None` if the file does not tell.
    pub span_s: Option<(f64, f64)>,
    /// What is wrong with it.
    pub reason: String,
}

/// What was kept and what is lost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recovery {
    /// The damaged log.
    pub input: String,
    /// The recovered one.
    pub output: PathBuf,
    /// Messages kept.
    pub messages: u64,
    /// Chunks kept.
    pub chunks: u64,
    /// Attachments and metadata records kept.
    pub records_about: u64,
    /// From the first message kept to the last, s.
    pub kept_s: Option<f64>,
    /// What was lost.
    pub lost: Vec<Lost>,
    /// The log has its end mark: nothing came after what is there.
    pub ended: bool,
}

/// Recovers a log into a new file.
///
/// # Errors
/// The input is not an MCAP file or cannot be read; the output exists and may not be replaced, or cannot be written.
pub fn recover<'a>(input: &Path, output: impl Into<Destination<'a>>) -> Result<Recovery, RecoverError> {
    let destination = output.into();
    let output = destination.path;
    let mut walk = Walk::open(input)?;
    let mut rescue = Rescue::create(destination, input)?;
    let mut lost = Vec::new();
    let mut ended = false;
    while let Some(piece) = walk.next_piece()? {
        match piece {
            Piece::Records { records, chunk } => rescue.keep(records, chunk)?,
            Piece::Lost { from_byte, bytes, span_ns, reason } => {
                lost.push((from_byte, bytes, span_ns, reason));
            }
            Piece::End => ended = true,
        }
    }
    let first_ns = rescue.first_ns();
    let since_s = |ns: u64| (ns as f64 - first_ns.unwrap_or(ns) as f64) / 1e9;
    let lost = lost.into_iter().map(|(from_byte, bytes, span_ns, reason)| Lost {
        from_byte,
        bytes,
        span_s: span_ns.map(|(from, until)| (since_s(from), since_s(until))),
        reason,
    });
    let mut recovery = Recovery {
        input: input.display().to_string(),
        output: output.to_owned(),
        messages: 0,
        chunks: 0,
        records_about: 0,
        kept_s: None,
        lost: lost.collect(),
        ended,
    };
    rescue.finish(&mut recovery)?;
    Ok(recovery)
}
