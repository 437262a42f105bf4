//! Writes the raw MAVLink frames as a telemetry log.
//!
//! A `.tlog` is a sequence of Unix times in microseconds (8 bytes, big-endian), each followed by one whole frame.
//! Mission Planner, QGroundControl and MAVProxy write and play back such files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::dialect::MavMessage;
use protocol::frame::Frame;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record, TOPIC_RAW_RX};
use protocol::log::tlog::{TlogFrame, TlogReader};
use protocol::log::v1;
use protocol::log::writer::LogHeader;
use protocol::text::Reassembler;
use serde::Serialize;

use super::ExportError;
use crate::log::{Entry, FlightLog, Heard, NewLog, frame_of};
use crate::output::{Destination, NewFile, WriteError};

/// Summary of a written `.tlog`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExportedTlog {
    /// The endpoint that recorded the frames: `vehicle` or `ground`.
    pub endpoint: String,
    /// Frames that the endpoint had received.
    pub received: u64,
    /// Frames that the endpoint had sent.
    pub sent: u64,
    /// Frames recorded by other endpoints, left out: they are the same frames at the other end of the link.
    pub left_out: u64,
    /// Why the log could not be read to its end.
    pub damage: Option<String>,
}

/// Writes the frames of one endpoint as a `.tlog`. Without `endpoint`, it takes the ground's frames if the log has
/// them, else the vehicle's.
///
/// # Errors
/// The log cannot be read or has no frames of that endpoint, or the file cannot be written.
pub fn export_tlog<'a>(
    open: &dyn Fn() -> Result<FlightLog<std::io::BufReader<File>>, crate::log::LogError>,
    endpoint: Option<&str>,
    output: impl Into<Destination<'a>>,
) -> Result<ExportedTlog, ExportError> {
    let mut log = open()?;
    while log.next_entry()?.is_some() {}
    let mut endpoints: Vec<String> = log
        .channels()
        .filter(|(_, channel)| channel.message_encoding == protocol::log::record::ENCODING_MAVLINK)
        .filter_map(|(_, channel)| channel.metadata.get("endpoint").cloned())
        .collect();
    endpoints.sort();
    endpoints.dedup();
    let wanted = endpoint.unwrap_or(if endpoints.iter().any(|known| known == "ground") {
        "ground"
    } else {
        "vehicle"
    });
    if !endpoints.iter().any(|known| known == wanted) {
        let found = if endpoints.is_empty() {
            "no raw MAVLink frames".to_owned()
        } else {
            format!("frames recorded by {}", endpoints.join(" and "))
        };
        let wanted = format!("a .tlog needs frames of {wanted}");
        return Err(ExportError::Nothing { name: log.name().to_owned(), found, wanted });
    }
    write_frames(&mut open()?, wanted, output.into())
}

fn write_frames<R: Read>(
    log: &mut FlightLog<R>,
    endpoint: &str,
    destination: Destination,
) -> Result<ExportedTlog, ExportError> {
    let failed = WriteError::at(destination.path);
    let file = NewFile::create(destination, Path::new(log.name()))?;
    let mut output = BufWriter::new(file);
    let mut written =
        ExportedTlog { endpoint: endpoint.to_owned(), received: 0, sent: 0, left_out: 0, damage: None };
    while let Some(stamped) = log.next_entry()? {
        if stamped.entry != Entry::RawFrame {
            continue;
        }
        let Some(channel) = log.channel(stamped.channel_id) else {
            continue;
        };
        if channel.metadata.get("endpoint").map(String::as_str) != Some(endpoint) {
            written.left_out += 1;
            continue;
        }
        if channel.topic == TOPIC_RAW_RX {
            written.received += 1;
        } else {
            written.sent += 1;
        }
        output.write_all(&(stamped.log_time_ns / 1000).to_be_bytes()).map_err(&failed)?;
        output.write_all(&stamped.data).map_err(&failed)?;
    }
    output.into_inner().map_err(|error| failed(error.into_error()))?.commit()?;
    written.damage = log.damage().map(ToString::to_string);
    Ok(written)
}

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
    /// The log cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
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
    let mut log = NewLog::create(output.into(), input, &header)?;
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
        log.write(&Record::RawFrame(raw), time_ns)?;
        if let Some(frame) = understood.filter(|_| direction == Direction::Rx) {
            for record in fold.take(&frame, since_us as f64 / 1e6) {
                imported.telemetry += u64::from(matches!(record, Record::Telemetry(_)));
                log.write(&record, time_ns)?;
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
    log.finish()?;
    Ok(imported)
}

/// Shortest interval between telemetry records, s.
const PERIOD_S: f64 = 0.1;

#[derive(Default)]
struct Fold {
    known: v1::Telemetry,
    changed: bool,
    written_at_s: Option<f64>,
    heard: Heard,
    judged: bool,
    texts: Reassembler,
}

impl Fold {
    /// Takes a frame that the vehicle sent `time_s` after the first; returns a record when one is due.
    pub(super) fn take(&mut self, frame: &Frame, time_s: f64) -> Vec<Record> {
        let Ok(message) = frame.decode() else {
            return Vec::new();
        };
        let mut records = Vec::new();
        self.heard.take(&message);
        match &message {
            MavMessage::STATUSTEXT(chunk) => {
                let now = Duration::from_secs_f64(time_s.max(0.0));
                records.extend(self.texts.push(frame.source(), chunk, now).into_iter().map(|text| {
                    let level = match text.severity {
                        0..=2 => EventLevel::Fatal,
                        3 => EventLevel::Error,
                        4 => EventLevel::Warning,
                        _ => EventLevel::Info,
                    };
                    Record::Event(Event { level, name: "vehicle".to_owned(), message: text.text })
                }));
            }
            MavMessage::TD_LANDING_VERDICT(_) if !self.judged => {
                self.judged = true;
                records.extend(self.heard.verdict().map(|verdict| Record::LandingVerdict(Box::new(verdict))));
            }
            message => self.changed |= self.note(message),
        }
        let due = self.written_at_s.is_none_or(|at_s| time_s - at_s >= PERIOD_S);
        if self.changed && due {
            self.changed = false;
            self.written_at_s = Some(time_s);
            self.known.time_s = time_s;
            records.push(Record::Telemetry(Box::new(self.known.clone())));
        }
        records
    }

    /// Whether the message changed anything.
    fn note(&mut self, message: &MavMessage) -> bool {
        let known = &mut self.known;
        let centidegrees = |angle: &i16| (f64::from(*angle) / 100.0).to_radians();
        match message {
            MavMessage::TD_FLIGHT_STATUS(data) => {
                known.phase = Some(data.phase as u32);
                known.interlocks = Some(u32::from(data.interlocks.bits()));
                known.countdown_ms = (data.countdown_ms != i32::MAX).then_some(data.countdown_ms);
            }
            MavMessage::LOCAL_POSITION_NED(data) => {
                known.x_m = Some(f64::from(data.x));
                known.altitude_m = Some(-f64::from(data.z));
                if let Some(pitch_rad) = known.pitch_rad {
                    let (sin, cos) = libm::sincos(pitch_rad);
                    let (forward, up) = (f64::from(data.vx), -f64::from(data.vz));
                    known.u_m_s = Some(forward * cos + up * sin);
                    known.w_m_s = Some(forward * sin - up * cos);
                }
            }
            MavMessage::ATTITUDE_QUATERNION(data) => {
                // A rotation about the east axis: the quaternion holds half of the pitch angle.
                known.pitch_rad = Some(2.0 * libm::atan2(f64::from(data.q3), f64::from(data.q1)));
                known.q_rad_s = Some(f64::from(data.pitchspeed));
            }
            MavMessage::TD_FINS(data) => {
                known.fin_commanded_rad = data.commanded.iter().map(centidegrees).collect();
                known.fin_measured_rad = data.measured.iter().map(centidegrees).collect();
            }
            MavMessage::TD_GIMBAL(data) => {
                known.gimbal_commanded_rad = Some(centidegrees(&data.pitch_commanded));
                known.gimbal_measured_rad = Some(centidegrees(&data.pitch_measured));
            }
            MavMessage::TD_CONTROLLER(data) => {
                known.control_level = Some(data.level as u32);
                known.solver_status = Some(data.solver_status as u32);
                known.iterations = Some(u32::from(data.iterations));
                known.solve_time_s = Some(f64::from(data.solve_time_us) / 1e6);
            }
            _ => return false,
        }
        true
    }
}
