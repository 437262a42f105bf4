//! Reads a log: everything before the first damage, and a description of the damage.
//!
//! The reader goes from front to back with bounded memory. It needs no summary and no footer, so it
//! reads the log of a recorder that was killed. It returns the content of a chunk only if the
//! chunk's checksum is right. A record too large for memory is skipped by its length, and reading
//! continues behind it.

use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

use mcap::records::{Record as McapRecord, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// A record or chunk larger than this is passed over.
pub const RECORD_LIMIT_BYTES: usize = 64 * 1024 * 1024;

/// Metadata larger than this are passed over: their entries take far more memory than their bytes.
pub const METADATA_LIMIT_BYTES: usize = 1024 * 1024;

/// Position of a chunk's checksum in its body.
const CHUNK_CHECKSUM_AT: usize = 24;

/// A record begins with its type and its length.
const HEAD_BYTES: usize = 9;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogChannel {
    pub topic: String,
    /// How messages are encoded: `protobuf` or `mavlink2`.
    pub message_encoding: String,
    /// Name of the schema; empty if there is none.
    pub schema_name: String,
    /// The schema itself; for a `protobuf` channel it is a serialised
    /// `google.protobuf.FileDescriptorSet`.
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
    #[error(
        "ends after {bytes} bytes without an end mark: the recorder still writes or was stopped, or the file was cut"
    )]
    Truncated { bytes: u64 },
    /// A record cannot be parsed.
    #[error("unreadable near byte {near_byte}: {reason}")]
    Corrupt {
        /// How many bytes had been read when it was noticed.
        near_byte: u64,
        /// The parser's message.
        reason: String,
    },
    /// A record that was passed over.
    #[error("a record of {bytes} bytes before byte {near_byte} was passed over: more than is held in memory")]
    TooLarge { near_byte: u64, bytes: u64 },
    /// The log can be read to its end, and its summary counts other messages or chunks.
    #[error("its summary counts {counted}, and {read} are there: a part was cut out or is there twice")]
    Miscounted { counted: String, read: String },
    /// The log was recovered, and the damaged one lacked something.
    #[error("it was made of a damaged log: {0}")]
    Recovered(String),
}

/// Why a record or a chunk cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    #[error(transparent)]
    Mcap(#[from] mcap::McapError),
    /// A chunk would unpack to more than is held in memory.
    #[error(
        "a chunk or metadata of {0} bytes, more than the {RECORD_LIMIT_BYTES} or {METADATA_LIMIT_BYTES} that are read"
    )]
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
    /// Of everything before the end mark of the data.
    checksum: crc32fast::Hasher,
    saw_data_end: bool,
    /// Every message so far is in a chunk with a checksum, or a checksum over all data follows.
    is_checksummed: bool,
    /// Its messages are in chunks.
    is_chunked: bool,
    /// Messages so far.
    messages: u64,
    /// The summary contains the number of messages.
    is_counted: bool,
    damage: Option<Damage>,
    ended: bool,
}

impl<R: Read> LogReader<R> {
    /// Starts reading at the beginning of `input`.
    pub fn new(input: R) -> Self {
        Self {
            input,
            parser: LinearReader::new_with_options(options().with_validate_summary_section_crc(true)),
            bytes_read: 0,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            checksum: crc32fast::Hasher::new(),
            saw_data_end: false,
            is_checksummed: true,
            is_chunked: false,
            messages: 0,
            is_counted: false,
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

    /// Returns the first thing that is wrong with the log; `None` for an undamaged log that was
    /// read to its end.
    pub fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// Returns whether a summary at the end contains the number of messages. Without one, missing
    /// records at the end are not detected.
    pub fn is_counted(&self) -> bool {
        self.is_counted
    }

    /// Returns whether a checksum covers every message: that of its chunk, or that of all data.
    pub fn is_checksummed(&self) -> bool {
        self.is_checksummed
    }

    /// Returns the next item; `None` at the end or at the first damage that cannot be passed over.
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
                    self.finish(Some(self.describe(&error)));
                    break;
                }
                Some(Ok(LinearReadEvent::ReadRequest(_))) => {
                    self.feed()?;
                    continue;
                }
                // A hole in a file is read as an endless row of such records.
                Some(Ok(LinearReadEvent::Record { opcode: 0, .. })) => {
                    self.finish(Some(self.corrupt("a record of type 0, which does not exist")));
                    break;
                }
                // One between the chunks was passed over already.
                Some(Ok(LinearReadEvent::Record { data, opcode: op::METADATA }))
                    if data.len() > METADATA_LIMIT_BYTES =>
                {
                    let bytes = data.len() as u64;
                    self.note(Damage::TooLarge { near_byte: self.bytes_read, bytes });
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => parse_record(opcode, data),
            };
            match parsed.map(McapRecord::into_owned) {
                Ok(McapRecord::Footer(_)) => self.take_end()?,
                Ok(record) => {
                    if let Some(item) = self.take(record) {
                        return Ok(Some(item));
                    }
                }
                Err(error) => self.finish(Some(self.describe(&error))),
            }
        }
        Ok(None)
    }

    /// Gives the parser the next record of the file, or passes over one that is too large.
    fn feed(&mut self) -> std::io::Result<()> {
        if self.bytes_read == 0 {
            let mut magic = [0; mcap::MAGIC.len()];
            self.bytes_read = fill(&mut self.input, &mut magic)? as u64;
            if magic != mcap::MAGIC {
                self.finish(Some(Damage::NotMcap));
                return Ok(());
            }
            self.checksum.update(&magic);
        }
        let mut head = [0; HEAD_BYTES];
        let count = fill(&mut self.input, &mut head)?;
        self.bytes_read += count as u64;
        let [opcode, length @ ..] = head;
        let bytes = u64::from_le_bytes(length);
        if count < HEAD_BYTES {
            self.finish(Some(self.cut()));
            return Ok(());
        }
        let most = if opcode == op::METADATA { METADATA_LIMIT_BYTES } else { RECORD_LIMIT_BYTES };
        let length = match usize::try_from(bytes) {
            Ok(length) if length <= most => length,
            _ => return self.pass_over(&head, bytes),
        };
        let buffer = self.parser.insert(HEAD_BYTES + length);
        buffer[..HEAD_BYTES].copy_from_slice(&head);
        let count = fill(&mut self.input, &mut buffer[HEAD_BYTES..])?;
        let (record, body) = (&buffer[..HEAD_BYTES + count], &buffer[HEAD_BYTES..HEAD_BYTES + count]);
        self.bytes_read += count as u64;
        let unpacked = if opcode == op::CHUNK { unpacked_bytes(body) } else { 0 };
        let mut damage = None;
        self.is_checksummed &= match opcode {
            op::CHUNK => body.get(CHUNK_CHECKSUM_AT..).is_some_and(|rest| !rest.starts_with(&[0; 4])),
            _ => opcode != op::MESSAGE,
        };
        if opcode == op::DATA_END && !self.saw_data_end {
            // A record between two chunks, or a complete chunk, may be damaged beyond recognition;
            // only this checksum shows that.
            let stored = body.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
            self.is_checksummed |= stored != 0;
            if stored != 0 && stored != self.checksum.clone().finalize() {
                damage = Some("the checksum over all data does not fit");
            }
        } else {
            self.checksum.update(record);
        }
        self.is_chunked |= opcode == op::CHUNK;
        if count == length && !fields_fit(opcode, body) {
            self.finish(Some(self.corrupt(TOO_SHORT)));
            return Ok(());
        }
        if unpacked > RECORD_LIMIT_BYTES as u64 {
            self.note(Damage::TooLarge { near_byte: self.bytes_read, bytes: unpacked });
        } else if opcode == op::MESSAGE && self.is_chunked {
            // One flipped bit makes a message of a chunk's index.
            self.note(self.corrupt("a message beside the chunks, which no checksum protects"));
        } else {
            self.parser.notify_read(HEAD_BYTES + count);
        }
        if count < length {
            self.finish(Some(self.cut()));
        } else if let Some(reason) = damage {
            self.note(self.corrupt(reason));
        }
        Ok(())
    }

    /// Reads to the end of a record without keeping it. Attachments of other programs may have any
    /// size: only without the others is the log damaged.
    fn pass_over(&mut self, head: &[u8], bytes: u64) -> std::io::Result<()> {
        self.checksum.update(head);
        let checksum = &mut self.checksum;
        let mut piece = vec![0; 1 << 16];
        let mut left = bytes;
        while left > 0 {
            let most = usize::try_from(left).unwrap_or(piece.len()).min(piece.len());
            let count = fill(&mut self.input, &mut piece[..most])?;
            checksum.update(&piece[..count]);
            self.bytes_read += count as u64;
            left -= count as u64;
            if count < most {
                break;
            }
        }
        if left > 0 {
            // A recorder does not know the length of a chunk before it ends.
            let is_open = bytes == u64::MAX;
            let longer = "a record that is longer than the rest of the file";
            self.finish(Some(if is_open { self.cut() } else { self.corrupt(longer) }));
        } else if head.first() != Some(&op::ATTACHMENT) {
            self.note(Damage::TooLarge { near_byte: self.bytes_read, bytes });
        }
        Ok(())
    }

    /// The end of the file follows the footer.
    fn take_end(&mut self) -> std::io::Result<()> {
        let mut rest = [0; mcap::MAGIC.len() + 1];
        let count = fill(&mut self.input, &mut rest)?;
        self.bytes_read += count as u64;
        let ends = rest.get(..count) == Some(mcap::MAGIC);
        let damage = (!ends).then(|| self.corrupt("the file does not end behind its footer"));
        self.finish(damage);
        Ok(())
    }

    /// Keeps the first damage.
    fn note(&mut self, damage: Damage) {
        self.damage.get_or_insert(damage);
    }

    fn finish(&mut self, damage: Option<Damage>) {
        self.ended = true;
        let missing = (!self.saw_data_end).then(|| self.cut());
        if let Some(damage) = damage.or(missing) {
            self.note(damage);
        }
    }

    /// The input ended too early. If it is shorter than the magic, it was not a log in the first
    /// place.
    fn cut(&self) -> Damage {
        let shorter_than_magic = self.bytes_read < mcap::MAGIC.len() as u64;
        if shorter_than_magic { Damage::NotMcap } else { Damage::Truncated { bytes: self.bytes_read } }
    }

    fn corrupt(&self, reason: &str) -> Damage {
        Damage::Corrupt { near_byte: self.bytes_read, reason: reason.to_owned() }
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
                // Chunks may repeat a schema; the first one is retained.
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
            McapRecord::Message { header, .. } if !self.channels.contains_key(&header.channel_id) => {
                self.note(self.corrupt("a message of a channel that is not in the log"));
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
            McapRecord::Statistics(stored) if self.saw_data_end => {
                self.is_counted = true;
                if stored.message_count != self.messages {
                    let messages = |count: u64| format!("{count} messages");
                    let (counted, read) = (messages(stored.message_count), messages(self.messages));
                    self.note(Damage::Miscounted { counted, read });
                }
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

/// Options of a parser that receives the records one by one.
fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(RECORD_LIMIT_BYTES)
}

/// Reads until the buffer is full or the input ends; returns how many bytes there were.
fn fill(input: &mut impl Read, mut buffer: &mut [u8]) -> std::io::Result<usize> {
    std::io::copy(&mut input.take(buffer.len() as u64), &mut buffer).map(|count| count as usize)
}

/// Unpacked size stated in the body of a chunk.
fn unpacked_bytes(body: &[u8]) -> u64 {
    const UNPACKED_AT: usize = 16;
    let unpacked = body.get(UNPACKED_AT..).and_then(|rest| rest.first_chunk());
    unpacked.map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

/// Joins an error and its causes: the parser's text often contains only the position.
fn with_causes(error: &mcap::McapError) -> String {
    let mut words = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(error) = cause {
        words = format!("{words}: {error}");
        cause = error.source();
    }
    words
}

/// Parses one record of an MCAP file from its type and its body; it never panics, whatever the body
/// is.
///
/// # Errors
/// The body does not fit the type.
pub fn parse_record(opcode: u8, data: &[u8]) -> mcap::McapResult<McapRecord<'_>> {
    // The parser of the crate `mcap` panics if an attachment is too short for its fields, and takes
    // the memory for a text before it reads it: up to 4 GB.
    if !fields_fit(opcode, data) {
        let error = std::io::Error::new(std::io::ErrorKind::InvalidData, TOO_SHORT);
        return Err(mcap::McapError::Io(error));
    }
    mcap::parse_record(opcode, data)
}

/// Calls `keep` for every record of a chunk, from its body, if its checksum is right. It holds one
/// record and the unpacked chunk, at most [`RECORD_LIMIT_BYTES`].
///
/// # Errors
/// The chunk cannot be read, or `keep` failed. Without a checksum in the chunk some records may
/// have been passed to it by then.
pub fn records_of_chunk(
    body: &[u8],
    mut keep: impl FnMut(McapRecord<'_>) -> mcap::McapResult<()>,
) -> Result<(), RecordError> {
    let unpacked = unpacked_bytes(body);
    if unpacked > RECORD_LIMIT_BYTES as u64 {
        return Err(RecordError::TooLarge(unpacked));
    }
    let mut reader = LinearReader::new_with_options(options());
    let head: Vec<u8> = std::iter::once(op::CHUNK).chain((body.len() as u64).to_le_bytes()).collect();
    let mut input = head.as_slice().chain(body);
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                let read = input.read(reader.insert(need)).unwrap_or(0);
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode: 0, .. } => return Err(RecordError::TypeZero),
            LinearReadEvent::Record { data, opcode: op::METADATA } if data.len() > METADATA_LIMIT_BYTES => {
                return Err(RecordError::TooLarge(data.len() as u64));
            }
            LinearReadEvent::Record { data, opcode } => keep(parse_record(opcode, data)?)?,
        }
    }
    Ok(())
}

/// Why a record cannot be parsed.
const TOO_SHORT: &str = "a record that is too short for its fields";

/// Whether a record of the data has room for its texts: behind fields of a fixed size so many,
/// each with its length, then perhaps a map of texts, then the rest (MCAP specification, Records).
fn fields_fit(opcode: u8, data: &[u8]) -> bool {
    fn behind_text(rest: &[u8]) -> Option<&[u8]> {
        let length = u32::from_le_bytes(*rest.first_chunk()?);
        rest.get(usize::try_from(length).ok()?.checked_add(4)?..)
    }
    let (fixed, texts, has_map, rest) = match opcode {
        op::HEADER => (0, 2, false, 0),
        op::SCHEMA => (2, 2, false, 4),
        op::CHANNEL => (4, 2, true, 0),
        op::CHUNK => (28, 1, false, 8),
        // Size of the data, and checksum.
        op::ATTACHMENT => (16, 2, false, 12),
        op::ATTACHMENT_INDEX => (40, 2, false, 0),
        op::METADATA => (0, 1, true, 0),
        op::METADATA_INDEX => (16, 1, false, 0),
        _ => return true,
    };
    let mut left = data.get(fixed..);
    for _ in 0..texts {
        left = left.and_then(behind_text);
    }
    let Some(left) = left.filter(|left| left.len() >= rest) else { return false };
    let Some(mut map) = has_map.then(|| behind_text(left).map(|behind| &left[4..left.len() - behind.len()]))
    else {
        return true;
    };
    while let Some(pairs) = map.filter(|pairs| !pairs.is_empty()) {
        map = behind_text(pairs).and_then(behind_text);
    }
    map.is_some()
}
