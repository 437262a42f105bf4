//! Reads the frames of a log as events, one at a time in file order, with bounded memory.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek as _};
use std::path::Path;

use protocol::dialect::{MavCmd, MavMessage};
use protocol::frame::{Frame, Framer};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{TOPIC_RAW_RX, TOPIC_RAW_TX};
use protocol::log::tlog::frame_length;

use crate::model::command::CommandKind;

/// The size of the read buffer: some thousand frames.
const BUFFER_BYTES: usize = 256 * 1024;
/// Bytes of a time stamp in a `.tlog`, and of the start of a frame that contains its length.
const TLOG_TIME_BYTES: usize = 8;
const LENGTH_BYTES: usize = 3;

/// An event of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordedEvent {
    /// A frame arrived from the vehicle.
    Heard(Frame),
    /// The crew gave a command.
    Commanded(CommandKind),
    /// The ground sent something else, of this many bytes.
    Sent(usize),
}

/// Who recorded a frame; the log of a demonstration contains both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Ground,
    Vehicle,
}

/// An event with its time stamp.
pub(super) struct Stamped {
    pub(super) side: Side,
    pub(super) stamp_ns: u64,
    pub(super) event: RecordedEvent,
}

/// A log that is being read from its beginning.
pub(super) struct LogEvents {
    format: Format,
    sides: Sides,
    bytes_read: u64,
}

/// The addresses of vehicle and ground: the first that are heard, unless given.
#[derive(Debug, Clone, Copy, Default)]
struct Sides {
    vehicle: Option<Address>,
    ground: Option<Address>,
}

impl Sides {
    fn hear(&mut self, source: Address) {
        if source.component_id == VEHICLE.component_id {
            self.vehicle.get_or_insert(source);
        } else if source.component_id == GROUND.component_id {
            self.ground.get_or_insert(source);
        }
    }
}

enum Format {
    Mcap { reader: Box<LogReader<BufReader<File>>>, waiting: VecDeque<Stamped> },
    Tlog { file: BufReader<File>, damage: Option<String> },
}

impl LogEvents {
    /// Starts at the beginning of an open file, for this vehicle or the first that is heard. A name that ends in
    /// `.tlog` is read as such, everything else as MCAP.
    pub(super) fn begin(file: &File, path: &Path, vehicle: Option<Address>) -> io::Result<Self> {
        let mut file = file.try_clone()?;
        file.rewind()?;
        let file = BufReader::with_capacity(BUFFER_BYTES, file);
        let is_tlog = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tlog"));
        let format = if is_tlog {
            Format::Tlog { file, damage: None }
        } else {
            Format::Mcap { reader: Box::new(LogReader::new(file)), waiting: VecDeque::new() }
        };
        Ok(Self { format, sides: Sides { vehicle, ground: None }, bytes_read: 0 })
    }

    /// Bytes of records read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// The vehicle that is shown, once it is known.
    pub(super) fn vehicle(&self) -> Option<Address> {
        self.sides.vehicle
    }

    /// Why reading ended early, if it did.
    pub(super) fn damage(&self) -> Option<String> {
        match &self.format {
            Format::Mcap { reader, .. } => reader.damage().map(ToString::to_string),
            Format::Tlog { damage, .. } => damage.clone(),
        }
    }

    pub(super) fn next_event(&mut self) -> io::Result<Option<Stamped>> {
        let sides = &mut self.sides;
        match &mut self.format {
            Format::Mcap { reader, waiting } => loop {
                if let Some(event) = waiting.pop_front() {
                    return Ok(Some(event));
                }
                let Some(item) = reader.next_item()? else { return Ok(None) };
                let LogItem::Message { channel_id, log_time_ns, data, .. } = item else { continue };
                self.bytes_read = reader.bytes_read();
                let Some(channel) = reader.channel(channel_id) else { continue };
                let side = match channel.metadata.get("endpoint").map(String::as_str) {
                    Some("ground") => Side::Ground,
                    Some("vehicle") => Side::Vehicle,
                    _ => continue,
                };
                if [TOPIC_RAW_RX, TOPIC_RAW_TX].contains(&channel.topic.as_str()) {
                    let events = frames(&data).into_iter().filter_map(|frame| event(frame, sides));
                    waiting.extend(events.map(|event| Stamped { side, stamp_ns: log_time_ns, event }));
                }
            },
            Format::Tlog { file, damage } => loop {
                match next_of_tlog(file, &mut self.bytes_read)? {
                    TlogPiece::End => return Ok(None),
                    TlogPiece::Unreadable { bytes } => {
                        *damage = Some(format!("unreadable {bytes} bytes before the end"));
                        return Ok(None);
                    }
                    TlogPiece::Frame { stamp_us, bytes } => {
                        // MAVLink 1 frames and frames with a wrong checksum are skipped.
                        if let Some(event) = frames(&bytes).pop().and_then(|frame| event(frame, sides)) {
                            let stamp_ns = stamp_us.saturating_mul(1_000);
                            return Ok(Some(Stamped { side: Side::Ground, stamp_ns, event }));
                        }
                    }
                }
            },
        }
    }
}

enum TlogPiece {
    End,
    Frame { stamp_us: u64, bytes: Vec<u8> },
    Unreadable { bytes: u64 },
}

/// Reads one entry of a `.tlog`: microseconds since the Unix epoch, big-endian, then a frame.
fn next_of_tlog(file: &mut impl Read, bytes_read: &mut u64) -> io::Result<TlogPiece> {
    let mut head = Vec::with_capacity(TLOG_TIME_BYTES + LENGTH_BYTES);
    file.by_ref().take((TLOG_TIME_BYTES + LENGTH_BYTES) as u64).read_to_end(&mut head)?;
    if head.is_empty() {
        return Ok(TlogPiece::End);
    }
    let stamp_us = head.first_chunk().map(|stamp| u64::from_be_bytes(*stamp));
    let mut bytes = head.get(TLOG_TIME_BYTES..).unwrap_or_default().to_vec();
    let length = frame_length(&bytes).filter(|_| bytes.len() == LENGTH_BYTES);
    if let Some(length) = length {
        file.by_ref().take(length.saturating_sub(LENGTH_BYTES) as u64).read_to_end(&mut bytes)?;
    }
    if let (Some(stamp_us), true) = (stamp_us, length == Some(bytes.len())) {
        *bytes_read += (TLOG_TIME_BYTES + bytes.len()) as u64;
        return Ok(TlogPiece::Frame { stamp_us, bytes });
    }
    let read = head.len().min(TLOG_TIME_BYTES) + bytes.len();
    let rest = io::copy(file, &mut io::sink())?;
    Ok(TlogPiece::Unreadable { bytes: read as u64 + rest })
}

fn frames(bytes: &[u8]) -> Vec<Frame> {
    let mut framer = Framer::new();
    framer.push_datagram(bytes);
    std::iter::from_fn(|| framer.next_frame()).collect()
}

/// The event of a frame: a frame of the vehicle, the first sending of a command, or another frame of the ground.
fn event(frame: Frame, sides: &mut Sides) -> Option<RecordedEvent> {
    sides.hear(frame.source());
    if Some(frame.source()) == sides.vehicle {
        return Some(RecordedEvent::Heard(frame));
    }
    if Some(frame.source()) != sides.ground {
        return None;
    }
    let sent = Some(RecordedEvent::Sent(frame.as_bytes().len()));
    let Ok(MavMessage::COMMAND_LONG(command)) = frame.decode() else { return sent };
    let kind = match command.command {
        _ if command.confirmation > 0 => return sent,
        // With the number of an ask it confirms that ask.
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if command.param1 > 0.5 && command.param3 >= 1.0 => {
            CommandKind::ConfirmArm
        }
        MavCmd::MAV_CMD_MISSION_START if command.param3 >= 1.0 => CommandKind::ConfirmStart,
        MavCmd::MAV_CMD_DO_PAUSE_CONTINUE => CommandKind::Hold,
        MavCmd::MAV_CMD_TD_TAKE_COMMAND => CommandKind::TakeCommand,
        MavCmd::MAV_CMD_TD_PAD_CHECK if command.param1 > 1.5 => CommandKind::CheckStill,
        MavCmd::MAV_CMD_TD_PAD_CHECK if command.param1 > 0.5 => CommandKind::Check,
        MavCmd::MAV_CMD_TD_PAD_CHECK => CommandKind::EndCheck,
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if command.param1 > 0.5 => CommandKind::Arm,
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => CommandKind::Disarm,
        MavCmd::MAV_CMD_MISSION_START => CommandKind::Start,
        MavCmd::MAV_CMD_DO_FLIGHTTERMINATION => CommandKind::Abort,
        _ => return sent,
    };
    Some(RecordedEvent::Commanded(kind))
}
