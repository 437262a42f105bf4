//! Reads a damaged file from front to back: which records and chunks are good, and what lies
//! between them.
//!
//! Where no record begins, it looks for the next chunk: a byte that says so, lengths that fit each
//! other and the file, and then the chunk's own checksum.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use mcap::records::{Channel, Record, SchemaHeader, Statistics, op};
use protocol::log::reader::{
    METADATA_LIMIT_BYTES, RECORD_LIMIT_BYTES, RecordError, parse_record, records_of_chunk,
};

use crate::log::{LogError, open_regular, take_magic};

/// Size of the type and length before every record.
const HEAD_BYTES: usize = 9;
/// A chunk's fields before its content, without the name of the compression.
const CHUNK_FIELDS_BYTES: u64 = 40;
/// Programs may define types of their own from this one on (MCAP specification, Records).
const PRIVATE_FROM: u8 = 0x80;
/// What is held at a time while the next chunk is looked for.
const WINDOW_BYTES: usize = 1 << 20;
/// More than the head and the fields of a chunk: the windows overlap by it.
const OVERLAP_BYTES: usize = 64;
/// No log has more chunks and records outside of chunks; a file of tiny records must not fill the
/// memory.
const GOOD_MAX: usize = 500_000;
const LOST_MAX: usize = 10_000;

/// The part of the footer that its checksum covers.
const FOOTER_CHECKED_BYTES: usize = 16;

/// A good record, or a chunk whose checksum is right.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Good {
    /// Position of its first byte in the file.
    at: u64,
    /// Length of its body.
    length: u64,
    pub(crate) opcode: u8,
}

/// A stretch of the file that cannot be recovered.
#[derive(Debug, Clone)]
pub(crate) struct LostStretch {
    pub(crate) from_byte: u64,
    pub(crate) bytes: u64,
    pub(crate) span_ns: Option<(u64, u64)>,
    pub(crate) reason: String,
}

/// The parts of a file.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    pub(crate) good: Vec<Good>,
    pub(crate) lost: Vec<LostStretch>,
    /// The end mark is there.
    pub(crate) ended: bool,
    /// Library that wrote the file, from its head.
    pub(crate) library: String,
    pub(crate) summary: FileSummary,
}

/// The summary behind the end mark. Its schemas and channels are used as far as they can be read,
/// its statistics only if its checksum is right.
#[derive(Debug, Default)]
pub(crate) struct FileSummary {
    pub(crate) is_intact: bool,
    pub(crate) schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    pub(crate) channels: BTreeMap<u16, Channel>,
    pub(crate) statistics: Option<Statistics>,
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

    /// The body of a record.
    pub(crate) fn body(&mut self, good: &Good) -> Result<Vec<u8>, LogError> {
        self.read(good.at + HEAD_BYTES as u64, good.length)
    }

    /// Reads the whole file.
    pub(crate) fn contents(&mut self) -> Result<Contents, LogError> {
        let mut contents = Contents::default();
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(mcap::MAGIC);
        let mut at = mcap::MAGIC.len() as u64;
        while at < self.size {
            let end_of_head = at + HEAD_BYTES as u64;
            let Some((opcode, stated)) = self.head(at)? else {
                contents.lose(at, self.size - at, None, "ends inside a record");
                break;
            };
            if contents.good.len() >= GOOD_MAX {
                contents.lose(at, self.size - at, None, "more records than any log has");
                break;
            }
            // The sizes in a chunk's fields; if they are wrong, its content fails its checksum.
            let fields = (opcode == op::CHUNK).then(|| self.read(end_of_head, OVERLAP_BYTES as u64));
            let chunk = fields.transpose()?.and_then(|fields| ChunkHead::read(&fields));
            let length = chunk.map_or(stated, |chunk| chunk.body_bytes);
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
                let follows = self.begins_record(next)?;
                let until = if follows { next } else { self.next_chunk(at + 1)?.unwrap_or(self.size) };
                contents.lose(at, until - at, None, "a record larger than this program reads");
                at = until;
                continue;
            }
            let body = self.read(end_of_head, length)?;
            if opcode == op::DATA_END {
                contents.ended = true;
                let recorded = body.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
                if contents.lost.is_empty() && recorded != 0 && hasher.finalize() != recorded {
                    let reason =
                        "the checksum over all data does not fit: something between the records was changed";
                    contents.lose(at, 0, None, reason);
                }
                contents.summary = self.read_summary(next)?;
                break;
            }
            match contents.check(opcode, &body) {
                // No checksum protects the length of a record beside the chunks.
                Ok(_) if opcode != op::CHUNK && self.hides_a_chunk(at, next)? => {
                    let reason = "a record whose length reaches into the chunks behind it";
                    at = self.skip(&mut contents, at, None, reason)?;
                }
                Ok(is_recovered) => {
                    hasher.update(&[opcode]);
                    hasher.update(&length.to_le_bytes());
                    hasher.update(&body);
                    if is_recovered {
                        contents.good.push(Good { at, length, opcode });
                    }
                    if length != stated {
                        let reason = "the length of a chunk is wrong; its content is intact";
                        contents.lose(at, HEAD_BYTES as u64, None, reason);
                    }
                    at = next;
                }
                Err(error) => {
                    let what = if opcode == op::CHUNK { "a chunk" } else { "a record" };
                    let chunk = (opcode == op::CHUNK).then(|| ChunkHead::read(&body)).flatten();
                    let span_ns = chunk.and_then(|head| head.span_ns());
                    let reason = format!("{what} is broken: {error}");
                    if self.begins_record(next)? {
                        contents.lose(at, next - at, span_ns, &reason);
                        at = next;
                    } else {
                        // Bytes are missing, or were added: the next record does not begin where
                        // this length says.
                        at = self.skip(&mut contents, at, span_ns, &reason)?;
                    }
                }
            }
        }
        Ok(contents)
    }

    /// Reads the summary that begins here.
    fn read_summary(&mut self, from_byte: u64) -> Result<FileSummary, LogError> {
        let mut summary = FileSummary::default();
        let (mut checksum, mut statistics) = (crc32fast::Hasher::new(), None);
        let mut at = from_byte;
        // Records of types that a reader does not support may be anywhere.
        while let Some((opcode, length)) = self.head(at)?.filter(|(opcode, length)| {
            *opcode != 0 && *length <= (RECORD_LIMIT_BYTES as u64).min(self.size - at - HEAD_BYTES as u64)
        }) {
            let body = self.read(at + HEAD_BYTES as u64, length)?;
            checksum.update(&[opcode]);
            checksum.update(&length.to_le_bytes());
            at += HEAD_BYTES as u64 + length;
            match parse_record(opcode, &body) {
                Ok(Record::Schema { header, data }) => {
                    summary.schemas.insert(header.id, (header, data.into_owned()));
                }
                Ok(Record::Channel(channel)) => {
                    summary.channels.insert(channel.id, channel);
                }
                Ok(Record::Statistics(found)) => statistics = Some(found),
                Ok(Record::Footer(footer)) => {
                    checksum.update(body.get(..FOOTER_CHECKED_BYTES).unwrap_or_default());
                    let ends = self.read(at, mcap::MAGIC.len() as u64 + 1)? == mcap::MAGIC;
                    summary.is_intact = ends && [0, checksum.finalize()].contains(&footer.summary_crc);
                    summary.statistics = statistics.filter(|_| summary.is_intact);
                    break;
                }
                Err(_) => break,
                Ok(_) => {}
            }
            checksum.update(&body);
        }
        Ok(summary)
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

    /// Whether a chunk begins within a record, and none of any kind behind it: its length is wrong.
    fn hides_a_chunk(&mut self, at: u64, next: u64) -> Result<bool, LogError> {
        Ok(!self.begins_record(next)? && self.next_chunk(at + 1)?.is_some_and(|chunk| chunk < next))
    }

    /// Whether a record that the format permits begins here and fits into the file; also the end of
    /// the file.
    fn begins_record(&mut self, at: u64) -> Result<bool, LogError> {
        if at == self.size {
            return Ok(true);
        }
        let head = self.head(at)?;
        Ok(head.is_some_and(|(opcode, length)| {
            let is_permitted = (op::HEADER..=op::DATA_END).contains(&opcode) || opcode >= PRIVATE_FROM;
            is_permitted && length <= self.size - at - HEAD_BYTES as u64
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
    /// Returns whether a readable record is recovered; indexes are written again.
    fn check(&mut self, opcode: u8, body: &[u8]) -> Result<bool, RecordError> {
        match opcode {
            op::CHUNK => records_of_chunk(body, |_| Ok(())).map(|()| true),
            op::METADATA if body.len() > METADATA_LIMIT_BYTES => {
                Err(RecordError::TooLarge(body.len() as u64))
            }
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT => {
                if let Record::Header(header) = parse_record(opcode, body)? {
                    self.library = header.library;
                    return Ok(false);
                }
                Ok(true)
            }
            _ => Ok(false),
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
    first_ns: u64,
    last_ns: u64,
    uncompressed_bytes: u64,
    /// Length of the complete body that follows from its fields.
    body_bytes: u64,
}

impl ChunkHead {
    /// From the beginning of a chunk's body; `None` if the fields contradict each other.
    fn read(body: &[u8]) -> Option<Self> {
        let compression_bytes = u64::from(u32::from_le_bytes(*body.get(28..)?.first_chunk()?));
        let compression = body.get(32..)?.get(..usize::try_from(compression_bytes).ok()?)?;
        let compressed_bytes = number_at(body, 32 + usize::try_from(compression_bytes).ok()?)?;
        let head = Self {
            first_ns: number_at(body, 0)?,
            last_ns: number_at(body, 8)?,
            uncompressed_bytes: number_at(body, 16)?,
            body_bytes: (CHUNK_FIELDS_BYTES + compression_bytes).checked_add(compressed_bytes)?,
        };
        let known = matches!(compression, b"" | b"lz4" | b"zstd");
        (known && head.first_ns <= head.last_ns).then_some(head)
    }

    /// First and last time of its messages, ns; `None` for an empty chunk.
    fn span_ns(&self) -> Option<(u64, u64)> {
        (self.first_ns > 0).then_some((self.first_ns, self.last_ns))
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
    head.is_some_and(|head| head.body_bytes == length && head.uncompressed_bytes <= RECORD_LIMIT_BYTES as u64)
}

fn number_at(bytes: &[u8], place: usize) -> Option<u64> {
    bytes.get(place..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}
