//! Writes the frames of a `.tlog` into a flight log.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::tlog::{TlogFrame, TlogReader};
use protocol::log::writer::{LogHeader, LogWriteError};
use serde::Serialize;

use super::fold::Fold;
use crate::log::{NewLog, NewLogError, frame_of};
use crate::output::Destination;

/// System id of a ground station, by convention.
const GROUND_SYSTEM: u8 = 255;
/// Interval between progress reports, bytes.
const PROGRESS_BYTES: u64 = 4 * 1024 * 1024;

/// Why a `.tlog` could not be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The `.tlog` cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// The `.tlog` has no frame.
    #[error("{}: is not a .tlog: it has no MAVLink 2 frame that follows a time of 8 bytes", path.display())]
    NoFrames { path: PathBuf },
    /// The log cannot be created.
    #[error("{}: cannot be created", path.display())]
    Create {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// The log cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        path: PathBuf,
        /// Error from the writer.
        source: LogWriteError,
    },
}

/// Summary of an import.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ImportedTlog {
    /// Frames kept.
    pub frames: u64,
    /// Of these, frames of other dialects or with a wrong checksum: kept, but not decoded.
    pub not_understood: u64,
    /// Frames of MAVLink 1, which are left out.
    pub mavlink1: u64,
    /// Bytes that belong to no frame.
    pub garbage_bytes: u64,
    /// Telemetry records decoded from the frames.
    pub telemetry: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImportProgress {
    /// Bytes read.
    pub read: u64,
    /// Size of the `.tlog`.
    pub total: u64,
}

/// Imports a `.tlog` into a new flight log. Memory does not grow with its size.
///
/// # Errors
/// See [`ImportError`].
pub fn import_tlog<'a>(
    input: &Path,
    output: impl Into<Destination<'a>>,
    progress: &mut dyn FnMut(ImportProgress),
) -> Result<ImportedTlog, ImportError> {
    let destination = output.into();
    let output = destination.path;
    let read = |source| ImportError::Read { path: input.to_owned(), source };
    let file = File::open(input).map_err(read)?;
    let total = file.metadata().map_err(read)?.len();
    let mut frames = TlogReader::new(file);
    let Some(first) = frames.next_frame().map_err(read)? else {
        return Err(ImportError::NoFrames { path: input.to_owned() });
    };
    let start_us = first.time_us;
    let header = LogHeader {
        writer: "replay".to_owned(),
        start_unix_ns: start_us.saturating_mul(1000),
        run: BTreeMap::from([("imported_from".to_owned(), input.display().to_string())]),
        ..LogHeader::default()
    };
    let failed = |error| match error {
        NewLogError::Create(source) => ImportError::Create { path: output.to_owned(), source },
        NewLogError::Write(source) => ImportError::Write { path: output.to_owned(), source },
    };
    let mut log = NewLog::create(destination, input, &header).map_err(failed)?;
    let link = format!("file:{}", input.file_name().unwrap_or_default().to_string_lossy());
    let mut imported = ImportedTlog::default();
    let mut fold = Fold::default();
    let mut next = Some(first);
    let mut told = 0;
    while let Some(TlogFrame { time_us, bytes }) = next {
        let since_us = time_us.saturating_sub(start_us);
        let time_ns = since_us.saturating_mul(1000);
        let understood = frame_of(&bytes);
        imported.frames += 1;
        imported.not_understood += u64::from(understood.is_none());
        let source = bytes.get(5).copied();
        let direction = if source == Some(GROUND_SYSTEM) { Direction::Tx } else { Direction::Rx };
        let raw = RawFrame { direction, endpoint: "ground", link: link.clone(), bytes };
        log.write(&Record::RawFrame(raw), time_ns).map_err(failed)?;
        if let Some(frame) = understood.filter(|_| direction == Direction::Rx) {
            for record in fold.take(&frame, since_us as f64 / 1e6) {
                imported.telemetry += u64::from(matches!(record, Record::Telemetry(_)));
                log.write(&record, time_ns).map_err(failed)?;
            }
        }
        next = frames.next_frame().map_err(read)?;
        if frames.bytes_read() >= told + PROGRESS_BYTES {
            told = frames.bytes_read();
            progress(ImportProgress { read: told, total });
        }
    }
    imported.mavlink1 = frames.mavlink1();
    imported.garbage_bytes = frames.garbage_bytes();
    log.finish().map_err(failed)?;
    Ok(imported)
}
