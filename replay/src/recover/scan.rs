//! Reads a damaged file from front to back: which records and chunks are good, and what lies between them.
//!
//! Where no record begins, it looks for the next chunk: a byte that says so, lengths that fit each other and the file, and
//! then the chunk's own checksum.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use mcap::records::{Channel, Record, SchemaHeader, Statistics, op};
use protocol::log::reader::{
    METADATA_LIMIT_BYTES, RECORD_LIMIT_BYTES, RecordError, parse_record, records_of_chunk,
};
use protocol::log::record::TOPIC_COMPUTER_FRAME;

use crate::log::{ComputerOrder, LogError, open_regular, take_magic};

/// Size of the type and length before every record.
const HEAD_BYTES: usize = 9;
/// A chunk's fields before its content, without the name of the compression.
const CHUNK_FIELDS_BYTES: u64 = 40;
/// What is held at a time while the next chunk is looked for.
const WINDOW_BYTES: usize = 1 << 20;
/// More than the head and the fields of a chunk: the windows overlap by it.
const OVERLAP_BYTES: usize = 64;
/// No log has more chunks and records outside of chunks; a file of tiny records must not fill the memory.
const GOOD_MAX: usize = 500_000;
const LOST_MAX: usize = 10_000;

/// The part of the footer that its checksum covers.
const FOOTER_CHECKED_BYTES: usize = 16;

/// What tells one chunk from another, in its own head and in the summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChunkName {
    pub(crate) first_ns: u64,
    pub(crate) last_ns: u64,
    pub(crate) uncompressed_bytes: u64,
    pub(crate) compressed_bytes: u64,
}

/// A good record, or a chunk whose checksum is right.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Good {
    /// Its first byte in the file.
    pub(crate) at: u64,
    pub(crate) opcode: u8,
    /// The name of a chunk.
    pub(crate) chunk: Option<ChunkName>,
}

/// A stretch of the file that cannot be kept.
#[derive(Debug, Clone)]
pub(crate) struct LostStretch {
    pub(crate) from_byte: u64,
    pub(crate) bytes: u64,
    pub(crate) span_ns: Option<(u64, u64)>,
    pub(crate) reason: String,
}

/// What a file consists of.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    pub(crate) good: Vec<Good>,
    pub(crate) lost: Vec<LostStretch>,
    /// The end mark is there.
    pub(crate) ended: bool,
    /// A message comes this long after later ones, ns.
    pub(crate) back_ns: u64,
    latest_ns: u64,
    /// The flight computer's own records are not in their order.
    pub(crate) is_mixed: bool,
    order: ComputerOrder,
    topics: BTreeMap<u16, String>,
    pub(crate) told: WriterReport,
    /// What is wrong with the summary. The chunks before it do not depend on it.
    pub(crate) summary_fault: Option<&'static str>,
}

/// What the summary behind the end mark tells. Its schemas and channels are used as far as they can be read, its list of
/// chunks and its count only if it is whole. Its own index is not used: bytes that were lost have shifted it.
#[derive(Debug, Default)]
pub(crate) struct WriterReport {
    /// Who wrote it, from the head of the file.
    pub(crate) library: String,
    pub(crate) schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    pub(crate) channels: BTreeMap<u16, Channel>,
    /// Where each chunk began, its length and its name.
    pub(crate) chunks: Vec<(u64, u64, ChunkName)>,
    /// How many messages there were.
    pub(crate) statistics: Option<Statistics>,
}

/// What the summary of a file tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summary {
    /// Frames of the flight computer in the file.
    pub frames: u64,
    /// Time of the last message, ns since the Unix epoch.
    pub last_log_time_ns: u64,
}

/// What the summary of a file tells, if it is whole. The whole file is read for it.
pub fn summary_of(path: &Path) -> Option<Summary> {
    let WriterReport { channels, statistics, .. } = Records::open(path).ok()?.contents().ok()?.told;
    let statistics = statistics?;
    let of_frames = |id: &u16| channels.get(id).is_some_and(|channel| channel.topic == TOPIC_COMPUTER_FRAME);
    let counts = statistics.channel_message_counts.iter().filter(|(id, _)| of_frames(id));
    Some(Summary {
        frames: counts.map(|(_, count)| *count).fold(0, u64::saturating_add),
        last_log_time_ns: statistics.message_end_time,
    })
}

/// A file being read record by record.
pub(crate) struct Records {
    name: String,
    input: BufReader<File>,
    size: u64,
}

impl Records {
    /// Opens a file that begins as an MCAP file does.
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let name = path.display().to_string();
        let read = |source| LogError::Read { name: name.clone(), source };
        let file = open_regular(path).map_err(read)?;
        let size = file.metadata().map_err(read)?.len();
        let mut input = BufReader::with_capacity(1 << 16, file);
        take_magic(&name, &mut input)?;
        Ok(Self { name, input, size })
    }

    /// The body of the record that begins at this byte.
    pub(crate) fn body(&mut self, at: u64) -> Result<Vec<u8>, LogError> {
        match self.head(at)? {
            Some((_, length)) => self.read(at + HEAD_BYTES as u64, length),
            None => Ok(Vec::new()),
        }
    }

    /// Reads the whole file.
    pub(crate) fn contents(&mut self) -> Result<Contents, LogError> {
        let mut contents = Contents::default();
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(mcap::MAGIC);
        let mut at = mcap::MAGIC.len() as u64;
        while at < self.size {
            let end_of_head = at + HEAD_BYTES as u64;
            let Some((opcode, length)) = self.head(at)? else {
                contents.lose(at, self.size - at, None, "ends inside a record");
                break;
            };
            if contents.good.len() >= GOOD_MAX {
                contents.lose(at, self.size - at, None, "more records than any log has");
                break;
            }
            if opcode == 0 || length > self.size - end_of_head {
                let reason = if opcode == 0 {
                    "no record begins here"
                } else {
                    "a record that is longer than the rest of the file"
                };
                at = self.skip(&mut contents, at, None, reason)?;
                continue;
            }
            let next = end_of_head + length;
            if length > RECORD_LIMIT_BYTES as u64 {
                let whole = self.begins_record(next)?;
                let until = if whole { next } else { self.next_chunk(at + 1)?.unwrap_or(self.size) };
                contents.lose(at, until - at, None, "a record larger than this program reads");
                at = until;
                continue;
            }
            let body = self.read(end_of_head, length)?;
            let chunk = (opcode == op::CHUNK).then(|| ChunkHead::read(&body)).flatten();
            if opcode == op::DATA_END {
                contents.ended = true;
                let told = body.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
                if contents.lost.is_empty() && told != 0 && hasher.finalize() != told {
                    let reason =
                        "the checksum over all data does not fit: something between the records was changed";
                    contents.lose(at, 0, None, reason);
                }
                contents.summary_fault = self.read_summary(next, &mut contents.told)?;
                if contents.summary_fault.is_some() {
                    // What is left of a list looks like a shorter one.
                    contents.told.chunks.clear();
                    contents.told.statistics = None;
                }
                break;
            }
            match contents.check(opcode, &body) {
                Ok(keeps) => {
                    hasher.update(&[opcode]);
                    hasher.update(&length.to_le_bytes());
                    hasher.update(&body);
                    if keeps {
                        let chunk = chunk.map(|head| head.name);
                        contents.good.push(Good { at, opcode, chunk });
                    }
                    at = next;
                }
                Err(error) => {
                    let what = if opcode == op::CHUNK { "a chunk" } else { "a record" };
                    let span_ns = chunk.and_then(|head| head.span_ns());
                    let reason = format!("{what} is broken: {error}");
                    if self.begins_record(next)? {
                        contents.lose(at, next - at, span_ns, &reason);
                        at = next;
                    } else {
                        // Bytes are missing, or were added: the next record does not begin where this length says.
                        at = self.skip(&mut contents, at, span_ns, &reason)?;
                    }
                }
            }
        }
        Ok(contents)
    }

    /// Reads from here to the end of the file; says what is wrong.
    fn read_summary(
        &mut self,
        from_byte: u64,
        told: &mut WriterReport,
    ) -> Result<Option<&'static str>, LogError> {
        let mut checksum = crc32fast::Hasher::new();
        let mut at = from_byte;
        // Records of types that a reader does not know may stand anywhere.
        while let Some((opcode, length)) = self.head(at)?.filter(|(opcode, length)| {
            *opcode != 0 && *length <= (RECORD_LIMIT_BYTES as u64).min(self.size - at - HEAD_BYTES as u64)
        }) {
            let body = self.read(at + HEAD_BYTES as u64, length)?;
            checksum.update(&[opcode]);
            checksum.update(&length.to_le_bytes());
            at += HEAD_BYTES as u64 + length;
            match parse_record(opcode, &body) {
                Ok(Record::Schema { header, data }) => {
                    told.schemas.insert(header.id, (header, data.into_owned()));
                }
                Ok(Record::Channel(channel)) => {
                    told.channels.insert(channel.id, channel);
                }
                Ok(Record::ChunkIndex(index)) if told.chunks.len() < GOOD_MAX => {
                    let name = ChunkName {
                        first_ns: index.message_start_time,
                        last_ns: index.message_end_time,
                        uncompressed_bytes: index.uncompressed_size,
                        compressed_bytes: index.compressed_size,
                    };
                    told.chunks.push((index.chunk_start_offset, index.chunk_length, name));
                }
                Ok(Record::Statistics(statistics)) => told.statistics = Some(statistics),
                Ok(Record::Footer(footer)) => {
                    checksum.update(body.get(..FOOTER_CHECKED_BYTES).unwrap_or_default());
                    // What the bits of a number were cannot be seen from it.
                    if footer.summary_crc != 0 && footer.summary_crc != checksum.finalize() {
                        return Ok(Some("the checksum over its summary does not fit"));
                    }
                    // A writer may list no chunk at all.
                    let counted = told.statistics.as_ref().map(|statistics| statistics.chunk_count as usize);
                    if !told.chunks.is_empty() && counted.is_some_and(|count| count != told.chunks.len()) {
                        return Ok(Some("its summary does not list as many chunks as it counts"));
                    }
                    let ends = self.read(at, mcap::MAGIC.len() as u64 + 1)? == mcap::MAGIC;
                    return Ok((!ends).then_some("the file does not end behind its footer"));
                }
                Err(_) => break,
                Ok(_) => {}
            }
            checksum.update(&body);
        }
        Ok(Some("its summary is cut off"))
    }

    /// Loses what comes until the next chunk or the end mark, and returns where that is.
    fn skip(
        &mut self,
        contents: &mut Contents,
        from_byte: u64,
        span_ns: Option<(u64, u64)>,
        reason: &str,
    ) -> Result<u64, LogError> {
        let until = self.next_chunk(from_byte + 1)?.unwrap_or(self.size);
        contents.lose(from_byte, until - from_byte, span_ns, reason);
        Ok(until)
    }

    /// Whether a record that the format defines begins here and fits into the file; also the end of the file.
    fn begins_record(&mut self, at: u64) -> Result<bool, LogError> {
        if at == self.size {
            return Ok(true);
        }
        let head = self.head(at)?;
        Ok(head.is_some_and(|(opcode, length)| {
            (op::HEADER..=op::DATA_END).contains(&opcode) && length <= self.size - at - HEAD_BYTES as u64
        }))
    }

    /// The next byte from here on at which a chunk or the end mark of the data seems to begin.
    fn next_chunk(&mut self, from_byte: u64) -> Result<Option<u64>, LogError> {
        let mut start = from_byte;
        // One buffer for all windows: a hole in a file may have gigabytes.
        let mut buffer = vec![0; WINDOW_BYTES];
        loop {
            let filled = self.fill(start, &mut buffer)?;
            let window = &buffer[..filled];
            let found = memchr::memchr2_iter(op::CHUNK, op::DATA_END, window)
                .find(|place| may_begin(&window[*place..], self.size - start - *place as u64));
            if let Some(place) = found {
                return Ok(Some(start + place as u64));
            }
            if window.len() < WINDOW_BYTES {
                return Ok(None);
            }
            start += (WINDOW_BYTES - OVERLAP_BYTES) as u64;
        }
    }

    /// Fills a buffer from here on; returns how many bytes there were.
    fn fill(&mut self, from: u64, buffer: &mut [u8]) -> Result<usize, LogError> {
        let mut filled = 0;
        self.input.seek(SeekFrom::Start(from)).map_err(|source| self.failed(source))?;
        while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            match self.input.read(rest).map_err(|source| self.failed(source))? {
                0 => break,
                count => filled += count,
            }
        }
        Ok(filled)
    }

    /// Type and length of the record that begins here; `None` if the file ends before.
    fn head(&mut self, at: u64) -> Result<Option<(u8, u64)>, LogError> {
        let head = self.read(at, HEAD_BYTES as u64)?;
        Ok(head.first().copied().zip(number_at(&head, 1)))
    }

    /// So many bytes from here, or those that are left.
    fn read(&mut self, from: u64, bytes: u64) -> Result<Vec<u8>, LogError> {
        let position = self.input.stream_position().map_err(|source| self.failed(source))?;
        let mut read = Vec::new();
        let moved =
            i64::try_from(from).and_then(|from| i64::try_from(position).map(|position| from - position));
        // A relative seek keeps the buffer.
        match moved {
            Ok(moved) => self.input.seek_relative(moved),
            Err(_) => self.input.seek(SeekFrom::Start(from)).map(|_| ()),
        }
        .and_then(|()| self.input.by_ref().take(bytes).read_to_end(&mut read))
        .map_err(|source| self.failed(source))?;
        Ok(read)
    }

    fn failed(&self, source: std::io::Error) -> LogError {
        LogError::Read { name: self.name.clone(), source }
    }
}

impl Contents {
    /// Whether a chunk is of another log: the summary does not name it, and misses none of its size, whose head was changed.
    pub(crate) fn is_foreign(&self, name: &ChunkName) -> bool {
        let is_there = |told: &ChunkName| self.good.iter().any(|piece| piece.chunk == Some(*told));
        let sizes = |name: &ChunkName| (name.uncompressed_bytes, name.compressed_bytes);
        let could_be = |told: &ChunkName| told == name || (sizes(told) == sizes(name) && !is_there(told));
        !self.told.chunks.is_empty() && !self.told.chunks.iter().any(|(_, _, told)| could_be(told))
    }

    /// Whether a record is kept, if it can be read: indexes are made anew. Notes the times of its messages.
    fn check(&mut self, opcode: u8, body: &[u8]) -> Result<bool, RecordError> {
        match opcode {
            op::CHUNK => records_of_chunk(body, |record| {
                self.note_order(&record);
                Ok(())
            })
            .map(|()| true),
            op::METADATA if body.len() > METADATA_LIMIT_BYTES => {
                Err(RecordError::TooLarge(body.len() as u64))
            }
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT => {
                let record = parse_record(opcode, body)?;
                self.note_order(&record);
                if let Record::Header(header) = record {
                    self.told.library = header.library;
                    return Ok(false);
                }
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    fn note_order(&mut self, record: &Record) {
        if let Record::Channel(channel) = record {
            self.topics.insert(channel.id, channel.topic.clone());
        }
        if let Record::Message { header, .. } = record {
            let topic = self.topics.get(&header.channel_id).map_or("", String::as_str);
            self.is_mixed |= self.order.is_broken_by(topic, header.log_time);
            self.back_ns = self.back_ns.max(self.latest_ns.saturating_sub(header.log_time));
            self.latest_ns = self.latest_ns.max(header.log_time);
        }
    }

    /// Notes a lost stretch; one that continues the last is part of it.
    fn lose(&mut self, from_byte: u64, bytes: u64, span_ns: Option<(u64, u64)>, reason: &str) {
        let full = self.lost.len() >= LOST_MAX;
        if let Some(last) = self.lost.last_mut() {
            let continues = last.from_byte + last.bytes == from_byte && span_ns.is_none();
            if continues || full {
                last.bytes = from_byte + bytes - last.from_byte;
                return;
            }
        }
        self.lost.push(LostStretch { from_byte, bytes, span_ns, reason: reason.to_owned() });
    }
}

/// The fields at the beginning of a chunk.
#[derive(Debug, Clone, Copy)]
struct ChunkHead {
    name: ChunkName,
    /// The length of the whole body that follows from its fields.
    body_bytes: u64,
}

impl ChunkHead {
    /// From the beginning of a chunk's body; `None` if the fields contradict each other.
    fn read(body: &[u8]) -> Option<Self> {
        let compression_bytes = u64::from(u32::from_le_bytes(*body.get(28..)?.first_chunk()?));
        let compression = body.get(32..)?.get(..usize::try_from(compression_bytes).ok()?)?;
        let name = ChunkName {
            first_ns: number_at(body, 0)?,
            last_ns: number_at(body, 8)?,
            uncompressed_bytes: number_at(body, 16)?,
            compressed_bytes: number_at(body, 32 + usize::try_from(compression_bytes).ok()?)?,
        };
        let known = matches!(compression, b"" | b"lz4" | b"zstd");
        let body_bytes = (CHUNK_FIELDS_BYTES + compression_bytes).checked_add(name.compressed_bytes)?;
        (known && name.first_ns <= name.last_ns).then_some(Self { name, body_bytes })
    }

    /// First and last time of its messages, ns; `None` for an empty chunk.
    fn span_ns(&self) -> Option<(u64, u64)> {
        (self.name.first_ns > 0).then_some((self.name.first_ns, self.name.last_ns))
    }
}

/// Whether a chunk or the end mark may begin with these bytes, with so many bytes left in the file.
fn may_begin(bytes: &[u8], left: u64) -> bool {
    let (Some(opcode), Some(length)) = (bytes.first(), number_at(bytes, 1)) else { return false };
    if length > (RECORD_LIMIT_BYTES as u64).min(left.saturating_sub(HEAD_BYTES as u64)) {
        return false;
    }
    if *opcode == op::DATA_END {
        // Only a schema, a channel, an index, an offset or the footer may follow.
        let next = bytes.get(HEAD_BYTES + 4);
        return length == 4 && next.is_some_and(|next| (op::FOOTER..op::DATA_END).contains(next));
    }
    let head = ChunkHead::read(&bytes[HEAD_BYTES..]);
    head.is_some_and(|head| {
        head.body_bytes == length && head.name.uncompressed_bytes <= RECORD_LIMIT_BYTES as u64
    })
}

fn number_at(bytes: &[u8], place: usize) -> Option<u64> {
    bytes.get(place..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}
