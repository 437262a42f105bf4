//! The frames of a `.tlog`, in order.
//!
//! A `.tlog` is a row of Unix times in microseconds (8 bytes, big-endian), each followed by one whole frame.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};

use protocol::frame::{Frame, Framer};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::writer::{LogHeader, LogWriteError, LogWriter};
use serde::Serialize;

use super::fold::Fold;

const TIME_BYTES: usize = 8;
/// Start markers of MAVLink 2 and of its predecessor.
const MAGIC_2: u8 = 0xfd;
const MAGIC_1: u8 = 0xfe;
const SIGNED: u8 = 0x01;
/// Longest frame there is: 10 + 255 + 2 + 13.
const FRAME_MAX_BYTES: usize = 280;
/// A ground station's system number, by convention.
const GROUND_SYSTEM: u8 = 255;
/// Times outside the years 2000 to 2100 are no times.
const PLAUSIBLE_US: std::ops::Range<u64> = 946_684_800_000_000..4_102_444_800_000_000;

/// Why a `.tlog` could not be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// It cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// No frame in it.
    #[error("{}: is no .tlog: nowhere in it does a MAVLink 2 frame follow a time of 8 bytes", path.display())]
    NoFrames {
        /// The file.
        path: PathBuf,
    },
    /// The log cannot be made.
    #[error("{}: cannot be created", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The log cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the writer said.
        source: LogWriteError,
    },
}

/// What was imported.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ImportedTlog {
    /// Frames kept.
    pub frames: u64,
    /// Of these, frames of other dialects, or with a wrong checksum: kept, not understood.
    pub not_understood: u64,
    /// Frames of MAVLink 1, which are left out.
    pub mavlink1: u64,
    /// Bytes that belong to no frame.
    pub garbage_bytes: u64,
    /// Telemetry records decoded from the frames.
    pub telemetry: u64,
}

/// Imports a `.tlog` into a new flight log. An existing file is not overwritten.
///
/// # Errors
/// See [`ImportError`].
pub fn import_tlog(input: &Path, output: &Path) -> Result<ImportedTlog, ImportError> {
    let read = |source| ImportError::Read { path: input.to_owned(), source };
    let mut frames = Frames::new(File::open(input).map_err(read)?);
    let Some(first) = frames.next_frame().map_err(read)? else {
        return Err(ImportError::NoFrames { path: input.to_owned() });
    };
    let start_us = first.time_us;
    let create = |source| ImportError::Create { path: output.to_owned(), source };
    let file = File::options().write(true).create_new(true).open(output).map_err(create)?;
    let header = LogHeader {
        writer: "replay".to_owned(),
        start_unix_ns: start_us.saturating_mul(1000),
        run: BTreeMap::from([("imported_from".to_owned(), input.display().to_string())]),
        ..LogHeader::default()
    };
    let write = |source| ImportError::Write { path: output.to_owned(), source };
    let mut writer = LogWriter::new(BufWriter::new(file), &header).map_err(write)?;
    let link = format!("file:{}", input.file_name().unwrap_or_default().to_string_lossy());
    let mut imported = ImportedTlog::default();
    let mut fold = Fold::default();
    let mut next = Some(first);
    while let Some(TimedFrame { time_us, bytes }) = next {
        let since_us = time_us.saturating_sub(start_us);
        let time_ns = since_us.saturating_mul(1000);
        let understood = understood(&bytes);
        imported.frames += 1;
        imported.not_understood += u64::from(understood.is_none());
        let source = bytes.get(5).copied();
        let direction = if source == Some(GROUND_SYSTEM) { Direction::Tx } else { Direction::Rx };
        let raw = RawFrame { direction, endpoint: "ground", link: link.clone(), bytes };
        writer.write(&Record::RawFrame(raw), time_ns).map_err(write)?;
        if let Some(frame) = understood.filter(|_| direction == Direction::Rx) {
            for record in fold.take(&frame, since_us as f64 / 1e6) {
                imported.telemetry += u64::from(matches!(record, Record::Telemetry(_)));
                writer.write(&record, time_ns).map_err(write)?;
            }
        }
        next = frames.next_frame().map_err(read)?;
    }
    imported.mavlink1 = frames.mavlink1;
    imported.garbage_bytes = frames.garbage_bytes;
    let mut file = writer.finish().map_err(write)?;
    file.flush().map_err(|error| write(mcap::McapError::from(error).into()))?;
    Ok(imported)
}

/// The frame, if its checksum is right and the dialect has its message.
fn understood(bytes: &[u8]) -> Option<Frame> {
    let mut framer = Framer::new();
    framer.push_datagram(bytes);
    framer.next_frame()
}

struct TimedFrame {
    time_us: u64,
    bytes: Vec<u8>,
}

/// Frames and their times, with what lies between them counted; holds one frame at a time.
struct Frames<R> {
    input: BufReader<R>,
    buffer: Vec<u8>,
    mavlink1: u64,
    garbage_bytes: u64,
}

impl<R: Read> Frames<R> {
    fn new(input: R) -> Self {
        Self { input: BufReader::new(input), buffer: Vec::new(), mavlink1: 0, garbage_bytes: 0 }
    }

    fn next_frame(&mut self) -> std::io::Result<Option<TimedFrame>> {
        loop {
            self.fill()?;
            if self.buffer.len() <= TIME_BYTES {
                self.garbage_bytes += self.buffer.len() as u64;
                self.buffer.clear();
                return Ok(None);
            }
            let time_us = self.buffer.first_chunk().map_or(0, |bytes| u64::from_be_bytes(*bytes));
            let frame = self.buffer.get(TIME_BYTES..).unwrap_or_default();
            let length = frame_length(frame).filter(|_| PLAUSIBLE_US.contains(&time_us));
            match length {
                Some(length) if frame.len() >= length => {
                    let is_2 = frame.first() == Some(&MAGIC_2);
                    let bytes = frame.get(..length).unwrap_or_default().to_vec();
                    self.buffer.drain(..TIME_BYTES + length);
                    if is_2 {
                        return Ok(Some(TimedFrame { time_us, bytes }));
                    }
                    self.mavlink1 += 1;
                }
                _ => {
                    self.buffer.drain(..1);
                    self.garbage_bytes += 1;
                }
            }
        }
    }

    /// Reads until the buffer has room for the longest frame, or to the end.
    fn fill(&mut self) -> std::io::Result<()> {
        let missing = (TIME_BYTES + FRAME_MAX_BYTES).saturating_sub(self.buffer.len());
        self.input.by_ref().take(missing as u64).read_to_end(&mut self.buffer).map(|_| ())
    }
}

/// The length that a frame's own head says.
fn frame_length(frame: &[u8]) -> Option<usize> {
    let payload = usize::from(*frame.get(1)?);
    match *frame.first()? {
        MAGIC_2 if frame.get(2)? & SIGNED != 0 => Some(payload + 25),
        MAGIC_2 => Some(payload + 12),
        MAGIC_1 => Some(payload + 8),
        _ => None,
    }
}
