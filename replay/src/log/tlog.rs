//! A `.tlog` as a flight log: its frames, and what they tell as a ground station records it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Read as _, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::dialect::{MavAutopilot, MavMessage};
use protocol::frame::Frame;
use protocol::identity::Address;
use protocol::log::record::{
    Direction, Event, EventLevel, METADATA_RECOVERY, METADATA_RUN, RECOVERY_FAULT_ENTRY, RawFrame, Record,
};
use protocol::log::tlog::{self, TlogFrame, TlogReader};
use protocol::log::writer::{LogHeader, LogWriteError, LogWriter};
use protocol::text::{Reassembler, Text};
use protocol::told::Told;
use serde::Serialize;

use super::open_regular;
use super::verdict::frame_of;
use crate::output::{NewFile, WriteError};

/// A frame of a `.tlog` follows a time of this length.
const TIME_BYTES: usize = 8;
/// The message ids of our dialect.
const OUR_MESSAGES: std::ops::RangeInclusive<u32> = 54_000..=54_999;
/// System id of a ground station, by convention.
const GROUND_SYSTEM: u8 = 255;

/// Why a `.tlog` could not be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The `.tlog` cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        path: PathBuf,
        /// Error from the operating system.
        source: io::Error,
    },
    /// The `.tlog` has no frame.
    #[error("{}: is not a .tlog: it has no MAVLink 2 frame that follows a time of 8 bytes", path.display())]
    NoFrames { path: PathBuf },
    /// The log cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Summary of an import.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ImportedTlog {
    /// The log that was written.
    pub output: PathBuf,
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

/// Opens a flight log; of a `.tlog`, a temporary one with what it holds, and `true`. Memory does not grow with its size.
pub(crate) fn open_log(path: &Path) -> io::Result<(File, bool)> {
    let file = open_regular(path)?;
    if !is_tlog(path)? {
        return Ok((file, false));
    }
    match convert(file, path, BufWriter::new(tempfile::tempfile()?)) {
        Ok((log, _)) => {
            let mut log = log.into_inner().map_err(io::IntoInnerError::into_error)?;
            log.rewind()?;
            Ok((log, true))
        }
        Err(Stopped::NoFrames) => {
            Err(io::Error::new(io::ErrorKind::InvalidData, "it has only frames of MAVLink 1"))
        }
        Err(Stopped::Read(error)) => Err(error),
        Err(Stopped::Write(error)) => Err(io::Error::other(error)),
    }
}

/// Whether a file has the content of a `.tlog`, whatever its name is.
///
/// # Errors
/// The file cannot be read, or it holds frames without times.
pub(crate) fn is_tlog(path: &Path) -> io::Result<bool> {
    let mut start = Vec::new();
    open_regular(path)?.take(RAW_WITHIN_BYTES).read_to_end(&mut start)?;
    if is_raw(&start) {
        let words = "it is a raw stream of MAVLink frames: a .tlog has a time of 8 bytes before each frame, and without times nothing says what happened when";
        return Err(io::Error::new(io::ErrorKind::InvalidData, words));
    }
    tlog::is_tlog(open_regular(path)?)
}

/// Enough to tell frames with times from frames without.
const RAW_WITHIN_BYTES: u64 = 1 << 16;

/// Whether more frames follow at once upon the one before than after the 8 bytes of a time.
fn is_raw(bytes: &[u8]) -> bool {
    let begins = |at: usize| matches!(bytes.get(at), Some(0xfd | 0xfe));
    let end_of = |at: usize| {
        let payload = at + usize::from(*bytes.get(at + 1)?);
        let signed = bytes.get(at + 2)? & 1 != 0;
        Some(if bytes[at] == 0xfe { payload + 8 } else { payload + 12 + 13 * usize::from(signed) })
    };
    let (mut at_once, mut after_time, mut at) = (0, 0, 0);
    while at < bytes.len() {
        match end_of(at).filter(|_| begins(at)) {
            Some(end) if begins(end) => (at_once, at) = (at_once + 1, end),
            Some(end) if begins(end + TIME_BYTES) => (after_time, at) = (after_time + 1, end + TIME_BYTES),
            _ => at += 1,
        }
    }
    at_once > after_time && !bytes.starts_with(mcap::MAGIC)
}

/// Imports a `.tlog` into a new flight log. Memory does not grow with its size.
///
/// # Errors
/// See [`ImportError`].
pub fn import_tlog(input: &Path, output: &Path) -> Result<ImportedTlog, ImportError> {
    let read = |source| ImportError::Read { path: input.to_owned(), source };
    is_tlog(input).map_err(read)?;
    let file = open_regular(input).map_err(read)?;
    let new = NewFile::create(output)?;
    let failed = WriteError::at(output);
    let (log, imported) = convert(file, input, BufWriter::new(new)).map_err(|stopped| match stopped {
        Stopped::Read(source) => read(source),
        Stopped::NoFrames => ImportError::NoFrames { path: input.to_owned() },
        Stopped::Write(error) => failed(io::Error::other(error)).into(),
    })?;
    let output = log.into_inner().map_err(|error| failed(error.into_error()))?.commit()?;
    Ok(ImportedTlog { output, ..imported })
}

enum Stopped {
    Read(io::Error),
    NoFrames,
    Write(LogWriteError),
}

impl From<LogWriteError> for Stopped {
    fn from(error: LogWriteError) -> Self {
        Self::Write(error)
    }
}

fn convert<W: Write + Seek>(input: File, path: &Path, output: W) -> Result<(W, ImportedTlog), Stopped> {
    let mut frames = TlogReader::new(input);
    let mut next_frame = || frames.next_frame().map_err(Stopped::Read);
    let Some(first) = next_frame()? else {
        return Err(Stopped::NoFrames);
    };
    let start_us = first.time_us;
    let header = LogHeader {
        writer: "replay".to_owned(),
        start_unix_ns: start_us.saturating_mul(1000),
        run: BTreeMap::from([("imported_from".to_owned(), path.display().to_string())]),
        ..LogHeader::default()
    };
    let mut log = LogWriter::new(output, &header)?;
    let link = format!("file:{}", path.file_name().unwrap_or_default().to_string_lossy());
    let mut imported = ImportedTlog::default();
    let mut station = Station::default();
    let mut next = Some(first);
    let (mut since_us, mut clock_us) = (0_u64, start_us);
    while let Some(TlogFrame { time_us, bytes }) = next {
        // A step that no silence explains is that of a clock which was set: no time passed in it.
        let step_us = time_us.abs_diff(clock_us);
        let is_set = step_us > if time_us < clock_us { CLOCK_BACK_US } else { CLOCK_AHEAD_US };
        since_us += if is_set { 0 } else { time_us.saturating_sub(clock_us) };
        clock_us = if is_set { time_us } else { clock_us.max(time_us) };
        let time_ns = since_us.saturating_mul(1000);
        let understood = frame_of(&bytes);
        imported.frames += 1;
        imported.not_understood += u64::from(understood.is_none());
        let source = bytes.get(5).copied();
        let direction = if source == Some(GROUND_SYSTEM) { Direction::Tx } else { Direction::Rx };
        let raw = RawFrame { direction, endpoint: "ground", link: link.clone(), bytes };
        log.write(&Record::RawFrame(raw), time_ns)?;
        if let Some(frame) = understood.filter(|_| direction == Direction::Rx) {
            for record in station.take(&frame, since_us as f64 / 1e6) {
                imported.telemetry += u64::from(matches!(record, Record::Telemetry(_)));
                log.write(&record, time_ns)?;
            }
        }
        next = next_frame()?;
    }
    imported.mavlink1 = frames.mavlink1();
    imported.garbage_bytes = frames.garbage_bytes();
    if imported.mavlink1 > 0 {
        log.write_metadata(METADATA_RUN, "left_out", format!("{} frames of MAVLink 1", imported.mavlink1))?;
    }
    if imported.garbage_bytes > 0 {
        let fault = format!("{} bytes of the .tlog belong to no frame", imported.garbage_bytes);
        log.write_metadata(METADATA_RECOVERY, RECOVERY_FAULT_ENTRY, fault)?;
    }
    Ok((log.finish()?, imported))
}

/// A clock that goes back or ahead by more than this, us, was set. Frames of several threads are late by less than a second, and nobody
/// records a day without hearing a frame.
const CLOCK_BACK_US: u64 = 1_000_000;
const CLOCK_AHEAD_US: u64 = 86_400_000_000;

/// Shortest interval between telemetry records, s: a station's.
const PERIOD_S: f64 = 0.1;

/// What a station would have recorded beside the frames.
#[derive(Default)]
struct Station {
    /// The vehicle that speaks our dialect, or else the one that was heard first; a station shows one.
    vehicle: Option<Address>,
    is_ours: bool,
    told: Told,
    changed: bool,
    written_at_s: Option<f64>,
    texts: Reassembler,
}

impl Station {
    /// Takes a frame received `time_s` after the first; returns what is recorded of it.
    fn take(&mut self, frame: &Frame, time_s: f64) -> Vec<Record> {
        let Ok(message) = frame.decode() else {
            return Vec::new();
        };
        if !self.is_ours && OUR_MESSAGES.contains(&frame.message_id()) {
            *self = Self { vehicle: Some(frame.source()), is_ours: true, ..Self::default() };
        }
        if let MavMessage::HEARTBEAT(beat) = &message
            && beat.autopilot != MavAutopilot::MAV_AUTOPILOT_INVALID
        {
            self.vehicle.get_or_insert(frame.source());
        }
        if self.vehicle.is_some_and(|vehicle| vehicle != frame.source()) {
            return Vec::new();
        }
        if let MavMessage::STATUSTEXT(chunk) = &message {
            let now = Duration::from_secs_f64(time_s.max(0.0));
            let text = self.texts.push(frame.source(), chunk, now);
            let event = |text: Text| Event {
                level: EventLevel::of_severity(text.severity),
                name: "vehicle".to_owned(),
                message: text.text,
            };
            return text.into_iter().map(|text| Record::Event(event(text))).collect();
        }
        self.changed |= self.told.hear(&message);
        let due = self.written_at_s.is_none_or(|at_s| time_s - at_s >= PERIOD_S);
        if !(self.changed && due) {
            return Vec::new();
        }
        self.changed = false;
        self.written_at_s = Some(time_s);
        vec![Record::Telemetry(Box::new(self.told.record(time_s)))]
    }
}
