//! A recorded flight in an MCAP log or a `.tlog`: its length and its phases. Its events are read from the file while
//! it is played, so that memory does not grow with the log.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::io::{BufReader, Seek as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::dialect::{MavCmd, MavMessage, TdPhase};
use protocol::frame::{Frame, Framer};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{TOPIC_RAW_RX, TOPIC_RAW_TX};
use protocol::log::tlog::{TlogFrame, TlogReader, is_tlog};

use crate::model::{CommandKind, telemetry::phase_of as phase_of_heartbeat};

/// How often the reading progress is reported, bytes.
const PROGRESS_BYTES: u64 = 4 * 1024 * 1024;
/// A larger step back in time means that the clock was set back, not that frames of two links are out of order.
const CLOCK_SET_BACK_NS: i128 = 1_000_000_000;
/// A longer gap is skipped: the log was continued on another day, or a time stamp is wrong.
const LEFT_OUT_NS: i128 = 3_600 * 1_000_000_000;
/// The most phase changes that are kept; a flight has about ten.
const PHASES_MAX: usize = 10_000;

/// Why a log cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Read { path: PathBuf, source: io::Error },
    /// There is nothing to show.
    #[error("{}: contains no frames of a vehicle; is it a log of `ground` or `onboard-sim`?", path.display())]
    Empty { path: PathBuf },
}

/// The reading progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    pub read: u64,
    pub total: u64,
}

/// A recorded flight.
#[derive(Debug)]
pub struct Recording {
    /// Kept open, because the file may be renamed while it is played.
    file: File,
    side: Side,
    /// The number of events to play; a log that is still being written grows behind them.
    events: u64,
    length: Duration,
    /// When each phase began.
    pub phases: Vec<(TdPhase, Duration)>,
    /// Why reading ended early, if it did.
    pub damage: Option<String>,
    /// The vehicle that is shown: the chosen one, otherwise the first that was heard.
    pub vehicle: Option<Address>,
}

impl Recording {
    /// Reads a log once for the flight of this vehicle (`None`: the first that was heard). What has the
    /// content of a `.tlog` is read as such, everything else as MCAP.
    ///
    /// # Errors
    /// The file cannot be read, or holds nothing to show.
    pub fn load(
        path: &Path,
        vehicle: Option<Address>,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, RecordingError> {
        let read = |source| RecordingError::Read { path: path.to_owned(), source };
        let file = File::open(path).map_err(read)?;
        let total = file.metadata().map_err(read)?.len();
        let mut events = LogEvents::begin(&file, vehicle).map_err(read)?;
        // What the ground received; if that is missing, what the vehicle sent.
        let (mut ground, mut vehicle) = (Survey::default(), Survey::default());
        let mut told = 0;
        while let Some(stamped) = events.next_event().map_err(read)? {
            let survey = match stamped.side {
                Side::Ground => &mut ground,
                Side::Vehicle => &mut vehicle,
            };
            survey.note(stamped.stamp_ns, &stamped.event);
            if events.bytes_read() >= told + PROGRESS_BYTES {
                told = events.bytes_read();
                progress(Progress { read: told, total });
            }
        }
        let found = [(Side::Ground, ground), (Side::Vehicle, vehicle)];
        let Some((side, survey)) = found.into_iter().find(|(_, survey)| survey.has_vehicle) else {
            return Err(RecordingError::Empty { path: path.to_owned() });
        };
        Ok(Self {
            damage: events.damage(),
            vehicle: events.vehicle(),
            file,
            side,
            events: survey.events,
            length: survey.length,
            phases: survey.phases,
        })
    }

    /// The time of the last event.
    pub fn length(&self) -> Duration {
        self.length
    }

    /// When a phase first began.
    pub fn begin_of(&self, phase: TdPhase) -> Option<Duration> {
        self.phases.iter().find(|(known, _)| *known == phase).map(|(_, at)| *at)
    }

    /// A reader at the first event.
    ///
    /// # Errors
    /// The file can no longer be read.
    pub fn reader(&self) -> io::Result<Reader> {
        let events = LogEvents::begin(&self.file, self.vehicle)?;
        Ok(Reader { events, side: self.side, clock: RecordingClock::default(), left: self.events })
    }
}

/// What the first pass finds for one side of the log.
#[derive(Default)]
struct Survey {
    clock: RecordingClock,
    events: u64,
    has_vehicle: bool,
    length: Duration,
    phases: Vec<(TdPhase, Duration)>,
}

impl Survey {
    fn note(&mut self, stamp_ns: u64, event: &RecordedEvent) {
        self.length = self.clock.at(stamp_ns);
        self.events += 1;
        if let RecordedEvent::Heard(frame) = event {
            self.has_vehicle = true;
            if let Some(phase) = phase_of(frame)
                && self.phases.last().is_none_or(|(last, _)| *last != phase)
                && self.phases.len() < PHASES_MAX
            {
                self.phases.push((phase, self.length));
            }
        }
    }
}

/// Reads the events of a recording in order.
pub struct Reader {
    events: LogEvents,
    side: Side,
    clock: RecordingClock,
    left: u64,
}

impl Reader {
    /// The next event and its time.
    ///
    /// # Errors
    /// The file can no longer be read.
    pub fn next_event(&mut self) -> io::Result<Option<(Duration, RecordedEvent)>> {
        while self.left > 0 {
            let Some(stamped) = self.events.next_event()? else { break };
            if stamped.side == self.side {
                self.left -= 1;
                return Ok(Some((self.clock.at(stamped.stamp_ns), stamped.event)));
            }
        }
        Ok(None)
    }
}

/// Converts the time stamps of a file to times from zero that never decrease, and skips long gaps.
#[derive(Debug, Clone, Copy, Default)]
struct RecordingClock {
    last_ns: u64,
    /// The time stamp that corresponds to time zero; `None` before the first.
    zero_ns: Option<i128>,
}

impl RecordingClock {
    fn at(&mut self, stamp_ns: u64) -> Duration {
        let stamp_ns = i128::from(stamp_ns);
        let zero_ns = *self.zero_ns.get_or_insert(stamp_ns);
        let (at_ns, last_ns) = (stamp_ns - zero_ns, i128::from(self.last_ns));
        if (last_ns - CLOCK_SET_BACK_NS..=last_ns + LEFT_OUT_NS).contains(&at_ns) {
            self.last_ns = self.last_ns.max(u64::try_from(at_ns).unwrap_or(0));
        } else {
            self.zero_ns = Some(stamp_ns - last_ns);
        }
        Duration::from_nanos(self.last_ns)
    }
}

fn phase_of(frame: &Frame) -> Option<TdPhase> {
    match frame.decode().ok()? {
        MavMessage::HEARTBEAT(data) => phase_of_heartbeat(&data),
        MavMessage::TD_FLIGHT_STATUS(data) => Some(data.phase),
        _ => None,
    }
}

// Reads the frames of a log as events, one at a time in file order, with bounded memory.

/// The size of the read buffer: some thousand frames.
const BUFFER_BYTES: usize = 256 * 1024;
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
    Tlog(TlogReader<File>),
}

impl LogEvents {
    /// Starts at the beginning of an open file, for this vehicle or the first that is heard. What has the content of a
    /// `.tlog` is read as such, everything else as MCAP.
    pub(super) fn begin(file: &File, vehicle: Option<Address>) -> io::Result<Self> {
        let mut file = file.try_clone()?;
        file.rewind()?;
        let is_tlog = is_tlog(&file)?;
        file.rewind()?;
        let format = if is_tlog {
            Format::Tlog(TlogReader::new(file))
        } else {
            let file = BufReader::with_capacity(BUFFER_BYTES, file);
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
            Format::Tlog(reader) => {
                let bytes = reader.garbage_bytes();
                (bytes > 0).then(|| format!("{bytes} bytes belong to no frame"))
            }
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
            Format::Tlog(reader) => loop {
                let Some(TlogFrame { time_us, bytes }) = reader.next_frame()? else { return Ok(None) };
                self.bytes_read = reader.bytes_read();
                // Frames with a wrong checksum are skipped.
                if let Some(event) = frames(&bytes).pop().and_then(|frame| event(frame, sides)) {
                    let stamp_ns = time_us.saturating_mul(1_000);
                    return Ok(Some(Stamped { side: Side::Ground, stamp_ns, event }));
                }
            },
        }
    }
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
        MavCmd::MAV_CMD_TD_PAD_CHECK if command.param1 > 2.5 => CommandKind::Seen,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_never_decreases_and_continues_when_the_clock_is_set() {
        let seconds = |stamps: &[u64]| -> Vec<u64> {
            let mut clock = RecordingClock::default();
            stamps.iter().map(|second| clock.at(second * 1_000_000_000).as_secs()).collect()
        };
        assert_eq!(seconds(&[100, 101, 104, 103, 50, 51, 52]), [0, 1, 4, 4, 4, 5, 6]);
        assert_eq!(seconds(&[100, 101, 90_000, 90_002]), [0, 1, 1, 3]);
        let mut clock = RecordingClock::default();
        assert_eq!([u64::MAX, 0, u64::MAX].map(|stamp_ns| clock.at(stamp_ns)), [Duration::ZERO; 3]);
    }
}
