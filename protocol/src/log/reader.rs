//! Reads a log: everything before the first damage, and a description of the damage.
//!
//! The reader goes from front to back with bounded memory. It needs no summary and no footer, so it reads the log of
//! a recorder that was killed. It returns the content of a chunk only if the chunk's checksum is right.

use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

use mcap::records::Record as McapRecord;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// A record or chunk larger than this is treated as damage.
pub const RECORD_LIMIT_BYTES: usize = 64 * 1024 * 1024;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogChannel {
    pub topic: String,
    /// How messages are encoded: `protobuf` or `mavlink2`.
    pub message_encoding: String,
    /// Name of the schema; empty if there is none.
    pub schema_name: String,
    /// The schema itself; for a `protobuf` channel it is a serialised `google.protobuf.FileDescriptorSet`.
    pub schema: Arc<[u8]>,
    /// The channel's metadata; for raw frames `link`, `endpoint` and `dialect`.
    pub metadata: BTreeMap<String, String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogItem {
    /// The file's header, which names the library that wrote it.
    Library(String),
    Metadata {
        name: String,
        entries: BTreeMap<String, String>,
    },
    Attachment {
        name: String,
        data: Vec<u8>,
    },
    Message {
        /// See [`LogReader::channel`].
        channel_id: u16,
        /// Nanoseconds since the Unix epoch.
        log_time_ns: u64,
        /// The number of the message within its channel.
        sequence: u32,
        data: Vec<u8>,
    },
    /// The end mark of the data.
    DataEnd,
}

/// Where a log stops being readable.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// The file is not an MCAP file.
    #[error("not an MCAP file: its first bytes are not the MCAP magic")]
    NotMcap,
    /// The file ends without an end mark: its recorder was killed, or it was cut.
    #[error("ends after {bytes} bytes without an end mark: the recorder was stopped, or the file was cut")]
    Truncated { bytes: u64 },
    /// A record cannot be parsed.
    #[error("unreadable near byte {near_byte}: {reason}")]
    Corrupt {
        /// How many bytes had been read when it was noticed.
        near_byte: u64,
        /// The parser's message.
        reason: String,
    },
    /// The log can be read to its end, and its summary counts other messages or chunks.
    #[error("its summary counts {counted}, and {read} are there: a part was cut out or is there twice")]
    Miscounted { counted: String, read: String },
    /// The log was recovered from one that lacked something.
    #[error("it was recovered from a damaged log: {0}")]
    Recovered(String),
}

/// Why a record or a chunk cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    #[error(transparent)]
    Mcap(#[from] mcap::McapError),
    /// A chunk would unpack to more than is held in memory.
    #[error("a chunk of {0} bytes, more than the {RECORD_LIMIT_BYTES} that are read")]
    TooLarge(u64),
    #[error("a record of type 0, which does not exist")]
    TypeZero,
}

impl RecordError {
    /// As an error of the library.
    pub fn into_mcap(self) -> mcap::McapError {
        match self {
            Self::Mcap(error) => error,
            other => {
                mcap::McapError::Io(std::io::Error::new(std::io::ErrorKind::InvalidData, other.to_string()))
            }
        }
    }
}

/// Reads a log's items in file order.
pub struct LogReader<R: Read> {
    input: R,
    parser: LinearReader,
    bytes_read: u64,
    schemas: BTreeMap<u16, (String, Arc<[u8]>)>,
    channels: BTreeMap<u16, LogChannel>,
    saw_data_end: bool,
    /// Messages so far.
    messages: u64,
    damage: Option<Damage>,
    ended: bool,
}

impl<R: Read> LogReader<R> {
    /// Starts reading at the beginning of `input`.
    pub fn new(input: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            // A record between two chunks, or a whole chunk, may be damaged beyond recognition; only this checksum
            // shows that.
            .with_validate_data_section_crc(true)
            .with_record_length_limit(RECORD_LIMIT_BYTES);
        Self {
            input,
            parser: LinearReader::new_with_options(options),
            bytes_read: 0,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            saw_data_end: false,
            messages: 0,
            damage: None,
            ended: false,
        }
    }

    /// Returns the channel of a message that was returned before.
    pub fn channel(&self, id: u16) -> Option<&LogChannel> {
        self.channels.get(&id)
    }

    /// Returns every channel seen so far.
    pub fn channels(&self) -> impl Iterator<Item = (u16, &LogChannel)> {
        self.channels.iter().map(|(id, channel)| (*id, channel))
    }

    /// Returns how many bytes have been read so far.
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Returns what ended the reading early; `None` for an undamaged log that was read to its end.
    pub fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// Returns the next item; `None` at the end or at the first damage.
    ///
    /// # Errors
    /// Reading the input failed. Damage is not an error: see [`LogReader::damage`].
    pub fn next_item(&mut self) -> std::io::Result<Option<LogItem>> {
        while !self.ended {
            let parsed = match self.parser.next_event() {
                None => {
                    self.finish(None);
                    break;
                }
                Some(Err(error)) => {
                    let damage = self.describe(&error);
                    self.finish(Some(damage));
                    break;
                }
                Some(Ok(LinearReadEvent::ReadRequest(need))) => {
                    let buffer = self.parser.insert(need);
                    let count = self.input.read(buffer)?;
                    self.parser.notify_read(count);
                    self.bytes_read += count as u64;
                    continue;
                }
                // A hole in a file is read as an endless row of such records.
                Some(Ok(LinearReadEvent::Record { opcode: 0, .. })) => {
                    let reason = "a record of type 0, which does not exist".to_owned();
                    self.finish(Some(Damage::Corrupt { near_byte: self.bytes_read, reason }));
                    break;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => parse_record(opcode, data),
            };
            match parsed {
                Ok(record) => {
                    if let Some(item) = self.take(record) {
                        return Ok(Some(item));
                    }
                }
                Err(error) => {
                    let damage = self.describe(&error);
                    self.finish(Some(damage));
                }
            }
        }
        Ok(None)
    }

    fn finish(&mut self, damage: Option<Damage>) {
        self.ended = true;
        // Damage in the summary after the data does not affect what was read.
        if !self.saw_data_end {
            self.damage = Some(damage.unwrap_or_else(|| self.cut()));
        }
    }

    /// The input ended too early. If it is shorter than the magic, it was not a log in the first place.
    fn cut(&self) -> Damage {
        let shorter_than_magic = self.bytes_read < mcap::MAGIC.len() as u64;
        if shorter_than_magic { Damage::NotMcap } else { Damage::Truncated { bytes: self.bytes_read } }
    }

    fn describe(&self, error: &mcap::McapError) -> Damage {
        match error {
            mcap::McapError::BadMagic => Damage::NotMcap,
            mcap::McapError::UnexpectedEof => self.cut(),
            other => Damage::Corrupt { near_byte: self.bytes_read, reason: with_causes(other) },
        }
    }

    fn take(&mut self, record: McapRecord<'static>) -> Option<LogItem> {
        match record {
            McapRecord::Header(header) => Some(LogItem::Library(header.library)),
            McapRecord::Schema { header, data } => {
                // Chunks may repeat a schema; the known one is kept.
                let known = self.schemas.get(&header.id);
                if known.is_none_or(|(name, known)| *name != header.name || **known != *data) {
                    self.schemas.insert(header.id, (header.name, Arc::from(data.as_ref())));
                }
                None
            }
            McapRecord::Channel(channel) => {
                let (schema_name, schema) = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let known = LogChannel {
                    topic: channel.topic,
                    message_encoding: channel.message_encoding,
                    schema_name,
                    schema,
                    metadata: channel.metadata,
                };
                self.channels.insert(channel.id, known);
                None
            }
            McapRecord::Message { header, data } => {
                self.messages += 1;
                Some(LogItem::Message {
                    channel_id: header.channel_id,
                    log_time_ns: header.log_time,
                    sequence: header.sequence,
                    data: data.into_owned(),
                })
            }
            // A tool that cut a part out, or a disk that lost it, has not always changed the count.
            McapRecord::Statistics(told) if self.saw_data_end && told.message_count != self.messages => {
                let messages = |count: u64| format!("{count} messages");
                let (counted, read) = (messages(told.message_count), messages(self.messages));
                self.damage = Some(Damage::Miscounted { counted, read });
                None
            }
            McapRecord::Metadata(metadata) => {
                Some(LogItem::Metadata { name: metadata.name, entries: metadata.metadata })
            }
            McapRecord::Attachment { header, data, .. } => {
                Some(LogItem::Attachment { name: header.name, data: data.into_owned() })
            }
            McapRecord::DataEnd(_) => {
                self.saw_data_end = true;
                Some(LogItem::DataEnd)
            }
            _ => None,
        }
    }
}

/// Joins an error and its causes: the parser's own text often names only the place.
fn with_causes(error: &mcap::McapError) -> String {
    let mut words = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(error) = cause {
        words = format!("{words}: {error}");
        cause = error.source();
    }
    words
}

/// Parses one record of an MCAP file from its type and its body; it never panics, whatever the body is.
///
/// # Errors
/// The body does not fit the type.
pub fn parse_record(opcode: u8, data: &[u8]) -> mcap::McapResult<McapRecord<'static>> {
    // The parser of the crate `mcap` panics if an attachment is too short for its own fields.
    if opcode == mcap::records::op::ATTACHMENT && !attachment_fits(data) {
        return Err(mcap::McapError::BadAttachmentLength { header: 0, available: data.len() as u64 });
    }
    mcap::parse_record(opcode, data).map(McapRecord::into_owned)
}

/// Calls `keep` for every record of a chunk, from its body, if its checksum is right. It holds one record and what the
/// chunk unpacks to, at most [`RECORD_LIMIT_BYTES`].
///
/// # Errors
/// The chunk cannot be read, or `keep` failed. Without a checksum in the chunk some records may have been kept by then.
pub fn records_of_chunk(
    body: &[u8],
    mut keep: impl FnMut(McapRecord<'static>) -> mcap::McapResult<()>,
) -> Result<(), RecordError> {
    const UNPACKED_AT: usize = 16;
    let unpacked = body.get(UNPACKED_AT..).and_then(|rest| rest.first_chunk());
    let unpacked = unpacked.map_or(0, |bytes| u64::from_le_bytes(*bytes));
    if unpacked > RECORD_LIMIT_BYTES as u64 {
        return Err(RecordError::TooLarge(unpacked));
    }
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(RECORD_LIMIT_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let head: Vec<u8> =
        std::iter::once(mcap::records::op::CHUNK).chain((body.len() as u64).to_le_bytes()).collect();
    let mut input = head.as_slice().chain(body);
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                let read = input.read(reader.insert(need)).unwrap_or(0);
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode: 0, .. } => return Err(RecordError::TypeZero),
            LinearReadEvent::Record { data, opcode } => keep(parse_record(opcode, data)?)?,
        }
    }
    Ok(())
}

/// Returns whether an attachment has room for two times, two length-prefixed strings, the length of its data and a
/// checksum.
fn attachment_fits(data: &[u8]) -> bool {
    const TIMES_BYTES: usize = 16;
    const DATA_LENGTH_AND_CHECKSUM_BYTES: usize = 12;
    let behind_string = |rest: &[u8]| -> Option<usize> {
        let length = rest.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))?;
        usize::try_from(length).ok()?.checked_add(4)
    };
    let Some(rest) = data.get(TIMES_BYTES..) else {
        return false;
    };
    let Some(rest) = behind_string(rest).and_then(|length| rest.get(length..)) else {
        return false;
    };
    let Some(rest) = behind_string(rest).and_then(|length| rest.get(length..)) else {
        return false;
    };
    rest.len() >= DATA_LENGTH_AND_CHECKSUM_BYTES
}
