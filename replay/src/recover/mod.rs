//! Recovers a whole log from a damaged one.
//!
//! A recorder that was killed leaves a log without its end; a bad disk may damage the middle. Every chunk with a
//! correct checksum is kept, also after a broken one. The report lists what is lost, with its time span if the file
//! still has it. Nothing is invented: a message is kept unchanged or not at all.

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
    /// The file is not an MCAP file, or cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The file cannot be created.
    #[error("{}: cannot be created", path.display())]
    Create {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// Writing failed.
    #[error("{}: cannot be written", path.display())]
    Write {
        path: PathBuf,
        /// Error from the writer.
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
    pub reason: String,
}

/// Report of a recovery.
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
    /// Whether the log has its end mark, so nothing is missing at the end.
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
