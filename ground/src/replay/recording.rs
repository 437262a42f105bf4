//! A recorded flight in an MCAP log or a `.tlog`: its length and its phases. Its events are read
//! from the file while it is played, so that memory does not grow with the log.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::io::{BufReader, Read as _, Seek as _};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use mavlink::MessageData as _;
use protocol::dialect::{GLOBAL_POSITION_INT_DATA, MavMessage, TD_FLIGHT_STATUS_DATA, TdPhase};
use protocol::field::Field;
use protocol::frame::{Frame, Framer};
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{METADATA_RUN, TOPIC_RAW_RX, TOPIC_RAW_TX};
use protocol::log::tlog::{TlogFrame, TlogReader, is_tlog};
use protocol::motion::Degrees;
use sim::wire::field::RUN_FACT;

use crate::model::{CommandKind, ReportedEvents, telemetry::phase_of as phase_of_heartbeat};
use crate::update::Msg;

/// A larger step back in time means that the clock was set back, not that frames of two links are
/// out of order. An MCAP log has none.
const CLOCK_SET_BACK_NS: i128 = 1_000_000_000;
/// A longer gap is skipped: the log was continued on another day, or a time stamp is wrong.
const LEFT_OUT_NS: i128 = 3_600 * 1_000_000_000;
/// The most phase changes that are kept; a flight has about ten.
const PHASES_MAX: usize = 10_000;

/// A recorded flight.
#[derive(Debug)]
pub struct Recording {
    /// Kept open, because the file may be renamed while it is played.
    file: File,
    side: Side,
    /// The number of events to play; a log that is still being written grows behind them.
    events: u64,
    /// The time of the last event.
    pub length: Duration,
    /// T+0: the release, or if it is not reported the first phase in flight.
    pub began: Duration,
    /// When each phase began.
    pub phases: Arc<[(TdPhase, Duration)]>,
    /// Why reading ended early, if it did.
    pub damage: Option<String>,
    /// The shown vehicle: the chosen one, otherwise the first received one.
    pub vehicle: Option<Address>,
    /// The field around the pad, if the log has one.
    pub field: Option<Field>,
}

impl Recording {
    /// Reads a log once for the flight of this vehicle (`None`: the first received one). What has
    /// the content of a `.tlog` is read as such, everything else as MCAP.
    ///
    /// # Errors
    /// The file cannot be read, or holds nothing to show.
    pub fn load(path: &Path, vehicle: Option<Address>) -> anyhow::Result<Self> {
        let shown = path.display();
        let reading = || format!("cannot read {shown}");
        let file = File::open(path).with_context(reading)?;
        let mut events = LogEvents::begin(&file, vehicle).with_context(reading)?;
        let given = vehicle;
        let (mut ground, mut vehicle) = (Survey::default(), Survey::default());
        while let Some((side, at, event)) = events.next_event().with_context(reading)? {
            let survey = if side == Side::Ground { &mut ground } else { &mut vehicle };
            survey.note(at, &event);
        }
        // Another system may have been received before the vehicle.
        if let Some(ours) = events.ours.filter(|ours| given.is_none() && events.vehicle != Some(*ours)) {
            return Self::load(path, Some(ours));
        }
        // What the ground received; if that is missing, what the vehicle sent.
        let found = [(Side::Ground, ground), (Side::Vehicle, vehicle)];
        let Some((side, survey)) = found.into_iter().find(|(_, survey)| survey.has_vehicle) else {
            let (mut start, mut framer) = (Vec::new(), Framer::new());
            (&file).rewind().with_context(reading)?;
            (&file).take(BUFFER_BYTES as u64).read_to_end(&mut start).with_context(reading)?;
            framer.push(&start);
            let is_log = matches!(events.format, Format::Tlog(_)) || start.starts_with(b"\x89MCAP");
            let is_stream = !is_log && framer.next_frame().is_some();
            let none = "contains no frames of a vehicle";
            match events.damage() {
                _ if is_stream => anyhow::bail!(
                    "{shown}: is a MAVLink stream without times; a .tlog has one before each frame"
                ),
                _ if start.is_empty() => anyhow::bail!("{shown}: is empty"),
                Some(damage) => anyhow::bail!("{shown}: {none}: it is damaged: {damage}"),
                None => anyhow::bail!("{shown}: {none}; is it a log of `ground` or `onboard-sim`?"),
            }
        };
        let Survey { events: count, length, mut phases, reported, pad, .. } = survey;
        reported.date(&mut phases);
        let began = reported.flight_began(&phases).unwrap_or_default();
        let (damage, vehicle) = (events.damage(), events.vehicle);
        let field = events.field.zip(pad).and_then(|(text, pad)| Field::parse(&text, pad, RUN_FACT).ok());
        Ok(Self { damage, vehicle, field, file, side, events: count, length, began, phases: phases.into() })
    }

    /// A reader at the first event.
    ///
    /// # Errors
    /// The file can no longer be read.
    pub fn reader(&self) -> io::Result<Reader> {
        let mut events = LogEvents::begin(&self.file, self.vehicle)?;
        let (recorded_by, left) = (self.side, usize::try_from(self.events).unwrap_or(usize::MAX));
        let all = std::iter::from_fn(move || events.next_event().transpose());
        let ours = all.filter_map(move |event| match event {
            Ok((side, at, event)) => (side == recorded_by).then_some(Ok((at, event))),
            Err(error) => Some(Err(error)),
        });
        Ok(Box::new(ours.take(left)))
    }
}

/// What the first pass finds for one side of the log.
#[derive(Default)]
struct Survey {
    events: u64,
    has_vehicle: bool,
    length: Duration,
    phases: Vec<(TdPhase, Duration)>,
    pad: Option<Degrees>,
    reported: ReportedEvents,
}

impl Survey {
    fn note(&mut self, at: Duration, event: &Msg) {
        self.length = at;
        self.events += 1;
        if let Msg::Frame(frame) = event {
            self.has_vehicle = true;
            let Ok(message) = frame.decode() else { return };
            self.reported.note(&message, at);
            if let MavMessage::HOME_POSITION(data) = &message {
                self.pad = Degrees::of_e7(data.latitude, data.longitude).or(self.pad);
            }
            if let Some(phase) = phase_of(&message)
                && self.phases.last().is_none_or(|(last, _)| *last != phase)
                && self.phases.len() < PHASES_MAX
            {
                self.phases.push((phase, self.length));
            }
        }
    }
}

/// The events of a recording with their times, in order, until the file can no longer be read.
pub type Reader = Box<dyn Iterator<Item = io::Result<(Duration, Msg)>> + Send>;

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

fn phase_of(message: &MavMessage) -> Option<TdPhase> {
    match message {
        MavMessage::HEARTBEAT(data) => phase_of_heartbeat(data),
        MavMessage::TD_FLIGHT_STATUS(data) => Some(data.phase),
        _ => None,
    }
}

// Reads the frames of a log as events, one at a time in file order, with bounded memory.

/// The size of the read buffer: some thousand frames.
const BUFFER_BYTES: usize = 256 * 1024;

/// Who recorded a frame; the log of a demonstration contains both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Ground,
    Vehicle,
}

/// A log that is being read from its beginning. The addresses of vehicle and ground are the first
/// received, unless given.
struct LogEvents {
    format: Format,
    vehicle: Option<Address>,
    ground: Option<Address>,
    /// One for each side.
    clocks: [RecordingClock; 2],
    /// The latest time stamp of an MCAP log.
    latest_ns: u64,
    /// What the last record holds.
    waiting: VecDeque<(Side, Duration, Msg)>,
    /// The text of the field in the facts about the run.
    field: Option<String>,
    /// The first sender of a flight status.
    ours: Option<Address>,
}

enum Format {
    Mcap(Box<LogReader<BufReader<File>>>),
    Tlog(TlogReader<File>),
}

impl LogEvents {
    /// Starts at the beginning of an open file, for this vehicle or the first received one. What
    /// has the content of a `.tlog` is read as such, everything else as MCAP.
    fn begin(file: &File, vehicle: Option<Address>) -> io::Result<Self> {
        let mut file = file.try_clone()?;
        file.rewind()?;
        let is_tlog = is_tlog(&file)?;
        file.rewind()?;
        let format = if is_tlog {
            Format::Tlog(TlogReader::new(file))
        } else {
            Format::Mcap(Box::new(LogReader::new(BufReader::with_capacity(BUFFER_BYTES, file))))
        };
        let clocks = <[RecordingClock; 2]>::default();
        Ok(Self {
            format,
            vehicle,
            ground: None,
            clocks,
            latest_ns: 0,
            waiting: VecDeque::new(),
            field: None,
            ours: None,
        })
    }

    /// Why reading ended early, if it did.
    fn damage(&self) -> Option<String> {
        match &self.format {
            Format::Mcap(reader) => reader.damage().map(ToString::to_string),
            Format::Tlog(reader) => {
                let bytes = reader.garbage_bytes();
                (bytes > 0).then(|| format!("{bytes} bytes belong to no frame"))
            }
        }
    }

    fn next_event(&mut self) -> io::Result<Option<(Side, Duration, Msg)>> {
        loop {
            if let Some(event) = self.waiting.pop_front() {
                return Ok(Some(event));
            }
            let (side, stamp_ns, bytes) = match &mut self.format {
                Format::Mcap(reader) => {
                    let Some(item) = reader.next_item()? else { return Ok(None) };
                    let LogItem::Message { channel_id, log_time_ns, data, .. } = item else {
                        if let LogItem::Metadata { name, mut entries } = item
                            && name == METADATA_RUN
                        {
                            self.field = entries.remove(RUN_FACT).or(self.field.take());
                        }
                        continue;
                    };
                    let Some(channel) = reader.channel(channel_id) else { continue };
                    let side = match channel.metadata.get("endpoint").map(String::as_str) {
                        _ if ![TOPIC_RAW_RX, TOPIC_RAW_TX].contains(&channel.topic.as_str()) => continue,
                        Some("ground") => Side::Ground,
                        Some("vehicle") => Side::Vehicle,
                        _ => continue,
                    };
                    self.latest_ns = self.latest_ns.max(log_time_ns);
                    if i128::from(self.latest_ns - log_time_ns) > CLOCK_SET_BACK_NS {
                        let words = "it is not in order of time; `mcap sort` sorts it";
                        return Err(io::Error::other(words));
                    }
                    (side, log_time_ns, data)
                }
                Format::Tlog(reader) => {
                    let Some(TlogFrame { time_us, bytes }) = reader.next_frame()? else { return Ok(None) };
                    (Side::Ground, time_us.saturating_mul(1_000), bytes)
                }
            };
            let mut framer = Framer::new();
            framer.push_datagram(&bytes);
            // Frames with a wrong checksum are skipped.
            while let Some(frame) = framer.next_frame() {
                if let Some(event) = self.event_of(frame) {
                    let at = self.clocks[side as usize].at(stamp_ns);
                    self.waiting.push_back((side, at, event));
                }
            }
        }
    }

    /// The event of a frame: a frame of the vehicle, the first sending of a command, or another
    /// frame of the ground.
    fn event_of(&mut self, frame: Frame) -> Option<Msg> {
        let source = frame.source();
        if frame.message_id() == TD_FLIGHT_STATUS_DATA::ID {
            self.ours.get_or_insert(source);
        }
        if source.component_id == VEHICLE.component_id {
            self.vehicle.get_or_insert(source);
        } else if source.component_id == GROUND.component_id {
            self.ground.get_or_insert(source);
        }
        let is_tracker = frame.message_id() == GLOBAL_POSITION_INT_DATA::ID
            && self.vehicle.is_some_and(|vehicle| vehicle.system_id != source.system_id);
        if Some(source) == self.vehicle || is_tracker {
            return Some(Msg::Frame(frame));
        }
        (Some(source) == self.ground).then(|| {
            let sent = Msg::Sent { bytes: frame.as_bytes().len(), drops: 0 };
            command_in(&frame).map_or(sent, Msg::Commanded)
        })
    }
}

/// The command that a frame sends for the first time.
fn command_in(frame: &Frame) -> Option<CommandKind> {
    let Ok(MavMessage::COMMAND_LONG(sent)) = frame.decode() else { return None };
    let is_sent = |kind: &CommandKind| {
        let (command, param1) = kind.row().mav;
        let fits = command == sent.command && (param1 - sent.param1).abs() < 0.5;
        // With the number of an ask it confirms that ask.
        let confirms = sent.param3 >= 1.0;
        fits && match kind {
            CommandKind::ConfirmArm | CommandKind::ConfirmStart => confirms,
            CommandKind::Arm | CommandKind::Start => !confirms,
            // A tap is for one moment, and is not followed.
            kind => *kind != CommandKind::Tap,
        }
    };
    CommandKind::ALL.iter().copied().find(is_sent).filter(|_| sent.confirmation == 0)
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
