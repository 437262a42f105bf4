//! Opens a flight log and reads its head, then its records in file order.
//!
//! Records are streamed, so memory does not grow with the log. Damage ends the stream and can then
//! be queried ([`FlightLog::damage`]); every record before the damage has been returned.

mod clocks;
mod flights;
mod head;
mod record;
mod recording;
mod verdict;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Chain, Cursor, Read, Write as _};
use std::path::{Path, PathBuf};

pub use clocks::{Clock, ClockTime, Clocks, Jump, Moment};
use flights::InFlight;
pub(crate) use flights::Sequences;
pub use flights::{Cut, Flights, FrameOrder, Gap, LoggedFlight};
pub(crate) use head::differing;
pub use head::{Attachment, BuildComparison, BuildDifference, Head};
use protocol::log::reader::{Damage, LogChannel, LogItem, LogReader};
use protocol::log::record::{
    Record, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_ESTIMATE, TOPIC_RAW_RX, TOPIC_TELEMETRY,
    TOPIC_VERDICT,
};
use protocol::log::writer::{LogHeader, LogWriter};
use protocol::text::printable;
pub use record::{Entry, LoggedFrame, StampedEntry};
pub(crate) use record::{RECORD_MAX_BYTES, frame_descriptor, misread_frame};
pub(crate) use recording::RecordingReader;
pub use recording::{Recording, RecordingError};
pub use verdict::{Verdict, share, worst_first};
use verdict::{Verdicts, contradiction, received_message};
pub(crate) use verdict::{frame_of, is_received};

use crate::output::{NewFile, WriteError};

/// First bytes of every MCAP file.
const MCAP_MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

const BUFFER_BYTES: usize = 1 << 20;

/// A record may come this long after later ones, ns: writers of several threads do so. Beyond it, a
/// log is not in order.
pub(crate) const IN_ORDER_NS: u64 = 1_000_000_000;

/// Of one time: what the computer starts from at power-up, a frame, what that led to, and the start
/// at the release.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Place {
    PowerUp,
    Frame,
    Other,
    Release,
}

impl Place {
    /// The place of a record; a start is that of a release.
    pub(crate) fn of(topic: &str) -> Self {
        match topic {
            TOPIC_COMPUTER_START => Self::Release,
            TOPIC_COMPUTER_FRAME => Self::Frame,
            _ => Self::Other,
        }
    }
}

/// The order of a flight computer's own records, which one thread writes: none is late.
#[derive(Debug, Default)]
pub(crate) struct ComputerOrder {
    last: Option<(u64, Place)>,
}

impl ComputerOrder {
    /// Whether a record comes behind one that belongs behind it.
    pub(crate) fn is_broken_by(&mut self, topic: &str, log_time_ns: u64) -> bool {
        if ![TOPIC_COMPUTER_START, TOPIC_COMPUTER_FRAME, TOPIC_ESTIMATE].contains(&topic) {
            return false;
        }
        // The start at a release is of the time of its frame; one that comes later powers up
        // another flight.
        let powers_up =
            topic == TOPIC_COMPUTER_START && self.last.is_none_or(|(last_ns, _)| last_ns < log_time_ns);
        let place = if powers_up { Place::PowerUp } else { Place::of(topic) };
        let this = Some((log_time_ns, place));
        let last = self.last;
        self.last = last.max(this);
        this < last
    }
}

/// A log being read.
pub struct FlightLog<R: Read> {
    name: String,
    reader: LogReader<Chain<Cursor<Vec<u8>>, R>>,
    head: Head,
    /// Whether a record was found that only flight logs have.
    recognised: bool,
    first_log_time_ns: Option<u64>,
    /// The latest time of any entry so far, ns since the Unix epoch.
    pub(crate) last_log_time_ns: Option<u64>,
    /// The flights so far.
    pub(crate) flights: Flights,
    /// How its clocks differ, as far as it was read.
    pub(crate) clocks: Clocks,
    verdicts: Verdicts,
    order: ComputerOrder,
    in_flight: InFlight,
    sequences: Sequences,
    /// The channel with the lowest number that has the topic and metadata of each.
    same: BTreeMap<u16, u16>,
    /// The first verdict that contradicts itself.
    contradiction: Option<Damage>,
    /// The topics whose records are decoded; all, if `None`.
    wanted: Option<&'static [&'static str]>,
}

/// Opens a file, and no pipe: that would wait for somebody who writes into it.
pub(crate) fn open_regular(path: &Path) -> std::io::Result<File> {
    if std::fs::metadata(path)?.is_file() {
        File::open(path)
    } else {
        Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "it is not a regular file"))
    }
}

impl FlightLog<BufReader<File>> {
    /// Opens a log file.
    ///
    /// # Errors
    /// The file cannot be read, or is no log.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let name = path.display().to_string();
        match open_regular(path) {
            Ok(file) => Self::read(name, BufReader::with_capacity(BUFFER_BYTES, file)),
            Err(source) => Err(LogError::Read { name, source }),
        }
    }
}

/// Reads the first bytes of an MCAP file.
pub(crate) fn take_magic(name: &str, input: &mut impl Read) -> Result<(), LogError> {
    let mut found = Vec::new();
    let read = input.take(MCAP_MAGIC.len() as u64).read_to_end(&mut found);
    match (read, &found[..]) {
        (Err(source), _) => Err(LogError::Read { name: name.to_owned(), source }),
        (Ok(_), []) => Err(LogError::Empty { name: name.to_owned() }),
        (Ok(_), start) if start == MCAP_MAGIC => Ok(()),
        (Ok(_), _) => Err(LogError::NotMcap { name: name.to_owned(), found }),
    }
}

impl<R: Read> FlightLog<R> {
    /// Reads a log from anywhere; `name` is used in messages only.
    ///
    /// # Errors
    /// The input cannot be read, or is not an MCAP file.
    pub fn read(name: String, mut input: R) -> Result<Self, LogError> {
        take_magic(&name, &mut input)?;
        Ok(Self {
            name,
            reader: LogReader::new(Cursor::new(MCAP_MAGIC.to_vec()).chain(input)),
            head: Head::default(),
            recognised: false,
            first_log_time_ns: None,
            last_log_time_ns: None,
            flights: Flights::default(),
            clocks: Clocks::default(),
            verdicts: Verdicts::default(),
            order: ComputerOrder::default(),
            in_flight: InFlight::default(),
            sequences: Sequences::default(),
            same: BTreeMap::new(),
            contradiction: None,
            wanted: None,
        })
    }

    /// The same log, of which only records of these topics are decoded: the others are
    /// [`Entry::Other`]. Frames that differ from what is computed may have been misread:
    /// [`misread_frame`].
    #[must_use]
    pub fn decoding(self, topics: &'static [&'static str]) -> Self {
        Self { wanted: Some(topics), ..self }
    }

    /// The file's name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The head as read so far: complete once the entries are exhausted, and in our own logs
    /// already at the first entry.
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// Every channel seen so far.
    pub fn channels(&self) -> impl Iterator<Item = (u16, &LogChannel)> {
        self.reader.channels()
    }

    /// The channel of an entry.
    pub fn channel(&self, id: u16) -> Option<&LogChannel> {
        self.reader.channel(id)
    }

    /// What is wrong with the log, or that it was recovered from one that lacked something; `None`
    /// for a whole log, once the entries are exhausted.
    pub fn damage(&self) -> Option<&Damage> {
        self.reader.damage().or(self.contradiction.as_ref()).or(self.head.recovered.as_ref())
    }

    /// Whether the log says how many records it has. Otherwise nothing shows that the last ones are
    /// missing.
    pub fn is_counted(&self) -> bool {
        self.reader.is_counted()
    }

    /// Whether a checksum covers every message, as far as it was read.
    pub fn is_checksummed(&self) -> bool {
        self.reader.is_checksummed()
    }

    /// The number of missing records, by the sequence numbers.
    pub fn messages_lost(&self) -> u64 {
        self.sequences.lost()
    }

    /// The number of missing records of a channel.
    pub(crate) fn lost_of(&self, channel: u16) -> u64 {
        self.sequences.lost_of(channel)
    }

    /// Its landing verdict, recorded or received, as far as it was read.
    pub(crate) fn verdict(&self) -> Option<Verdict> {
        self.verdicts.found()
    }

    /// So long after the first entry, s.
    pub fn since_first_s(&self, log_time_ns: u64) -> f64 {
        log_time_ns.saturating_sub(self.first_log_time_ns.unwrap_or(log_time_ns)) as f64 / 1e9
    }

    /// The next entry.
    ///
    /// # Errors
    /// The input cannot be read; or, at the end, nothing in the file belonged to a flight log, or
    /// it is damaged before its first message.
    pub fn next_entry(&mut self) -> Result<Option<StampedEntry>, LogError> {
        loop {
            let item = self.reader.next_item();
            let item = item.map_err(|source| LogError::Read { name: self.name.clone(), source })?;
            match item {
                None => return self.end().map(|()| None),
                Some(LogItem::Message { channel_id, log_time_ns, sequence, data }) => {
                    let back_ns = self.last_log_time_ns.unwrap_or(0).saturating_sub(log_time_ns);
                    let channel = self.reader.channel(channel_id);
                    let topic = channel.map_or("", |channel| channel.topic.as_str());
                    let is_broken = self.order.is_broken_by(topic, log_time_ns);
                    if is_broken || back_ns > IN_ORDER_NS {
                        return Err(LogError::NotInOrder {
                            name: self.name.clone(),
                            topic: printable(topic.as_bytes()),
                            back_s: back_ns as f64 / 1e9,
                        });
                    }
                    let wanted = |channel: &&LogChannel| {
                        self.wanted.is_none_or(|topics| topics.contains(&channel.topic.as_str()))
                    };
                    let mut entry = Entry::decode(channel.filter(wanted), &data, self.wanted.is_some());
                    self.recognised |= entry.is_ours()
                        || channel.is_some_and(|channel| channel.schema_name.starts_with("touchdown."));
                    if let Entry::Verdict(verdict) = &entry
                        && let Some(contradiction) = contradiction(verdict)
                    {
                        let reason = format!("{TOPIC_VERDICT} contradicts itself: {contradiction}");
                        let damage =
                            Damage::Corrupt { near_byte: self.reader.bytes_read(), reason: reason.clone() };
                        self.contradiction.get_or_insert(damage);
                        entry = Entry::Unreadable { reason };
                    }
                    self.in_flight.place(&mut entry);
                    self.last_log_time_ns = self.last_log_time_ns.max(Some(log_time_ns));
                    self.first_log_time_ns.get_or_insert(log_time_ns);
                    // A program that joined logs has given each part channels of its own.
                    let first = *self.same.entry(channel_id).or_insert_with(|| {
                        let is_same = |(_, other): &(u16, &LogChannel)| {
                            channel.is_some_and(|it| {
                                (&it.topic, &it.metadata) == (&other.topic, &other.metadata)
                            })
                        };
                        self.reader.channels().find(is_same).map_or(channel_id, |(first, _)| first)
                    });
                    let lost_before = self.sequences.note(first, sequence);
                    let stamped =
                        StampedEntry { channel_id, log_time_ns, sequence, lost_before, data, entry };
                    let message = received_message(self.reader.channel(channel_id), &stamped);
                    self.flights.note(&stamped);
                    self.clocks.note(&stamped, message.as_ref(), self.since_first_s(log_time_ns));
                    self.verdicts.note(&stamped, message.as_ref());
                    return Ok(Some(stamped));
                }
                Some(item) => self.head.take(item),
            }
        }
    }

    fn end(&self) -> Result<(), LogError> {
        // Without a message, what is missing (frames, the schema's version) says nothing about the
        // log.
        if let Some(damage) = self.damage()
            && self.last_log_time_ns.is_none()
        {
            return Err(LogError::NothingReadable { name: self.name.clone(), damage: damage.to_string() });
        }
        if self.recognised || self.head.is_ours() {
            return Ok(());
        }
        let topics = self.reader.channels().map(|(_, channel)| channel.topic.clone()).collect();
        Err(LogError::Foreign { name: self.name.clone(), library: self.head.library.clone(), topics })
    }
}

/// Writes records with their times since the start, s, as a log.
///
/// # Errors
/// The file cannot be created or written.
pub(crate) fn write_records(
    output: &Path,
    header: &LogHeader,
    records: &[(f64, Record)],
) -> Result<PathBuf, WriteError> {
    NewFile::create(output)?.fill(|file| {
        let mut log = LogWriter::new(BufWriter::new(file), header).map_err(io::Error::other)?;
        for (time_s, record) in records {
            log.write(record, (time_s * 1e9) as u64).map_err(io::Error::other)?;
        }
        log.finish().map_err(io::Error::other)?.flush()
    })
}

/// Most topics of a foreign file listed in a message.
const TOPICS_SHOWN: usize = 8;

/// Why a file cannot be used as a flight log. Damage inside a log is not a reason.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file cannot be read.
    #[error("{name}: cannot be read")]
    Read { name: String, source: std::io::Error },
    /// The file is empty.
    #[error("{name}: is empty; a flight log is an MCAP file")]
    Empty { name: String },
    /// The file is of another kind.
    #[error(
        "{name}: is not a flight log: {}, and an MCAP file begins with 89 4d 43 41 50 30 0d 0a; `ground --replay` shows a .tlog",
        kind_of(found)
    )]
    NotMcap { name: String, found: Vec<u8> },
    /// The file begins like a log, but no message can be read.
    #[error("{name}: nothing could be read: it is damaged before its first message: {damage}")]
    NothingReadable { name: String, damage: String },
    /// MCAP allows any order; a flight is read from its beginning to its end.
    #[error(
        "{name}: is not in order of time: a record on {topic} comes {back_s:.3} s late, behind one that it belongs before; \
        `replay recover` puts it in order"
    )]
    NotInOrder { name: String, topic: String, back_s: f64 },
    /// An MCAP file of another program.
    #[error(
        "{name}: is an MCAP file written by {:?}, but not a flight log: it has {}, and none of {}, {}, {} or similar topics",
        printable(library.as_bytes()), listed(topics), TOPIC_COMPUTER_FRAME, TOPIC_TELEMETRY, TOPIC_RAW_RX
    )]
    Foreign { name: String, library: String, topics: Vec<String> },
}

/// Other files that people have beside their logs, by their first bytes.
const OTHERS: [(&[u8], &str); 5] = [
    (b"PK\x03\x04", "it is a ZIP archive; unpack it first"),
    (b"\x1f\x8b", "it is compressed by gzip; unpack it first"),
    (b"ULog", "it is a log of PX4 (.ulg)"),
    (b"\xa3\x95", "it is a log of ArduPilot (.bin)"),
    (b"#ROSBAG", "it is a bag of ROS 1"),
];

/// What a file that is no log is, or what it begins with.
fn kind_of(start: &[u8]) -> String {
    let known = OTHERS.iter().find(|(magic, _)| start.starts_with(magic));
    let hex = || start.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    known.map_or_else(|| format!("it begins with {}", hex()), |(_, kind)| (*kind).to_owned())
}

fn listed(topics: &[String]) -> String {
    if topics.is_empty() {
        return "no topics".to_owned();
    }
    let mut shown: Vec<String> =
        topics.iter().take(TOPICS_SHOWN).map(|topic| printable(topic.as_bytes())).collect();
    if topics.len() > TOPICS_SHOWN {
        shown.push(format!("{} more", topics.len() - TOPICS_SHOWN));
    }
    format!("the topics {}", shown.join(", "))
}
