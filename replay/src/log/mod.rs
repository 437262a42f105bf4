//! Opens a flight log and reads its head, then its records in file order.
//!
//! Records are streamed, so memory does not grow with the log. Damage ends the stream and can then be queried
//! ([`FlightLog::damage`]); every record before the damage has been returned.

mod clocks;
mod entry;
mod error;
mod flights;
mod frame_order;
mod head;
mod heard;
mod new_log;
mod recording;
mod schema;
mod summary;
mod tick_ranges;

pub use clocks::{Clock, ClockTime, ClockTimeError, Clocks};
pub use entry::{Entry, StampedEntry};
pub use error::LogError;
pub use flights::{Cut, Flights, LoggedFlight};
pub use frame_order::FrameOrder;
pub use head::{AttachmentFacts, BuildComparison, BuildDifference, Head};
pub(crate) use heard::{Found, Heard, Verdicts, frame_of, heard_message};
pub(crate) use new_log::{NewLog, NewLogError};
pub use recording::{Recording, RecordingError};
pub(crate) use schema::{computer_descriptor, pilot_descriptor};
pub use summary::{SummaryFacts, summary_of};
pub use tick_ranges::{Gap, TickRanges};

use std::fs::File;
use std::io::{BufReader, Chain, Cursor, Read};
use std::path::Path;

use protocol::log::reader::{Damage, LogChannel, LogItem, LogReader};

/// First bytes of every MCAP file.
const MCAP_MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

const BUFFER_BYTES: usize = 1 << 20;

/// A log being read.
pub struct FlightLog<R: Read> {
    name: String,
    reader: LogReader<Chain<Cursor<Vec<u8>>, R>>,
    head: Head,
    /// Whether a record was found that only flight logs have.
    recognised: bool,
    last_log_time_ns: Option<u64>,
}

impl FlightLog<BufReader<File>> {
    /// Opens a log file.
    ///
    /// # Errors
    /// The file cannot be read, or is not an MCAP file.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let name = path.display().to_string();
        match File::open(path) {
            Ok(file) => Self::read(name, BufReader::with_capacity(BUFFER_BYTES, file)),
            Err(source) => Err(LogError::Read { name, source }),
        }
    }
}

impl<R: Read> FlightLog<R> {
    /// Reads a log from anywhere; `name` is used in messages only.
    ///
    /// # Errors
    /// The input cannot be read, or is not an MCAP file.
    pub fn read(name: String, mut input: R) -> Result<Self, LogError> {
        let mut start = Vec::with_capacity(MCAP_MAGIC.len());
        let read = input.by_ref().take(MCAP_MAGIC.len() as u64).read_to_end(&mut start);
        if let Err(source) = read {
            return Err(LogError::Read { name, source });
        }
        if start.is_empty() {
            return Err(LogError::Empty { name });
        }
        if start != MCAP_MAGIC {
            return Err(LogError::NotMcap { name, found: start });
        }
        Ok(Self {
            name,
            reader: LogReader::new(Cursor::new(start).chain(input)),
            head: Head::default(),
            recognised: false,
            last_log_time_ns: None,
        })
    }

    /// The file's name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The head as read so far: complete once the entries are exhausted, and in our own logs already at the first
    /// entry.
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

    /// Why the log could not be read to its end, or that it was recovered from one that lacked something; `None` for a whole
    /// log, once the entries are exhausted.
    pub fn damage(&self) -> Option<&Damage> {
        self.reader.damage().or(self.head.recovered.as_ref())
    }

    /// The latest time of any entry so far, ns since the Unix epoch.
    pub fn last_log_time_ns(&self) -> Option<u64> {
        self.last_log_time_ns
    }

    /// The next entry.
    ///
    /// # Errors
    /// The input cannot be read; or, at the end, nothing in the file belonged to a flight log, or it is damaged before its
    /// first message.
    pub fn next_entry(&mut self) -> Result<Option<StampedEntry>, LogError> {
        loop {
            let item = self.reader.next_item();
            let item = item.map_err(|source| LogError::Read { name: self.name.clone(), source })?;
            match item {
                None => return self.end().map(|()| None),
                Some(LogItem::Message { channel_id, log_time_ns, sequence, data }) => {
                    let entry = Entry::decode(self.reader.channel(channel_id), &data);
                    self.recognised |= entry.is_ours();
                    self.last_log_time_ns = self.last_log_time_ns.max(Some(log_time_ns));
                    return Ok(Some(StampedEntry { channel_id, log_time_ns, sequence, data, entry }));
                }
                Some(item) => self.head.take(item),
            }
        }
    }

    fn end(&self) -> Result<(), LogError> {
        // Without a message, what is missing (ticks, the schema's version) says nothing about the log.
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
