//! Walks through the records of a file and skips broken ones.

use std::fs::File;
use std::io::{BufReader, Read, Seek as _, SeekFrom};
use std::path::Path;

use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use protocol::log::reader::{RECORD_LIMIT_BYTES, parse_record};

use crate::log::{LogError, chunk_offsets};

/// Size of the type and length before every record.
const HEAD_BYTES: u64 = 9;

/// The next stretch of a file.
pub(super) enum Piece {
    /// Good records; `chunk` if they came in one.
    Records { records: Vec<Record<'static>>, chunk: bool },
    /// A stretch that cannot be kept.
    Lost { from_byte: u64, bytes: u64, span_ns: Option<(u64, u64)>, reason: String },
    /// The end mark.
    End,
}

pub(super) struct Walk {
    name: String,
    input: BufReader<File>,
    size: u64,
    at: u64,
    /// Start offsets of chunks, if the file's summary has them.
    chunks: Vec<u64>,
    over: bool,
}

impl Walk {
    pub(super) fn open(path: &Path) -> Result<Self, LogError> {
        let name = path.display().to_string();
        let read = |source| LogError::Read { name: name.clone(), source };
        let file = File::open(path).map_err(read)?;
        let size = file.metadata().map_err(read)?.len();
        let mut input = BufReader::with_capacity(1 << 16, file);
        let mut found = Vec::new();
        input.by_ref().take(mcap::MAGIC.len() as u64).read_to_end(&mut found).map_err(read)?;
        if found.is_empty() {
            return Err(LogError::Empty { name });
        }
        if found != mcap::MAGIC {
            return Err(LogError::NotMcap { name, found });
        }
        Ok(Self { name, input, size, at: mcap::MAGIC.len() as u64, chunks: chunk_offsets(path), over: false })
    }

    pub(super) fn next_piece(&mut self) -> Result<Option<Piece>, LogError> {
        while !self.over && self.at < self.size {
            let from_byte = self.at;
            let Some((opcode, length)) = self.head()? else {
                return self.skip(from_byte, None, "ends inside a record".to_owned()).map(Some);
            };
            if opcode == 0 || length > RECORD_LIMIT_BYTES as u64 {
                return self.skip(from_byte, None, "no record begins here".to_owned()).map(Some);
            }
            let mut body = Vec::new();
            self.input.by_ref().take(length).read_to_end(&mut body).map_err(|source| self.failed(source))?;
            self.at = from_byte + HEAD_BYTES + body.len() as u64;
            if (body.len() as u64) < length {
                return self
                    .skip(from_byte, span_of(opcode, &body), "ends inside a record".to_owned())
                    .map(Some);
            }
            if let Some(piece) = self.understand(opcode, &body, from_byte) {
                return Ok(Some(piece));
            }
        }
        Ok(None)
    }

    /// The decoded record; `None` for index records.
    fn understand(&mut self, opcode: u8, body: &[u8], from_byte: u64) -> Option<Piece> {
        let bytes = HEAD_BYTES + body.len() as u64;
        match opcode {
            op::DATA_END => {
                self.over = true;
                Some(Piece::End)
            }
            op::CHUNK => Some(match records_of_chunk(body) {
                Ok(records) => Piece::Records { records, chunk: true },
                Err(error) => {
                    let reason = format!("a chunk is broken: {error}");
                    Piece::Lost { from_byte, bytes, span_ns: span_of(opcode, body), reason }
                }
            }),
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT => {
                Some(match parse_record(opcode, body) {
                    Ok(record) => Piece::Records { records: vec![record], chunk: false },
                    Err(error) => Piece::Lost {
                        from_byte,
                        bytes,
                        span_ns: None,
                        reason: format!("a record is broken: {error}"),
                    },
                })
            }
            _ => None,
        }
    }

    fn head(&mut self) -> Result<Option<(u8, u64)>, LogError> {
        let mut head = Vec::with_capacity(9);
        self.input.by_ref().take(HEAD_BYTES).read_to_end(&mut head).map_err(|source| self.failed(source))?;
        let length = head.get(1..).and_then(|rest| rest.first_chunk::<8>());
        Ok(head.first().copied().zip(length.map(|bytes| u64::from_le_bytes(*bytes))))
    }

    /// Skips the damage and continues at the next chunk in the summary, if any.
    fn skip(
        &mut self,
        from_byte: u64,
        span_ns: Option<(u64, u64)>,
        reason: String,
    ) -> Result<Piece, LogError> {
        let next = self.chunks.iter().copied().find(|chunk| *chunk > from_byte && *chunk < self.size);
        match next {
            Some(chunk) => {
                self.input.seek(SeekFrom::Start(chunk)).map_err(|source| self.failed(source))?;
                self.at = chunk;
            }
            None => self.over = true,
        }
        let until = next.unwrap_or(self.size);
        Ok(Piece::Lost { from_byte, bytes: until - from_byte, span_ns, reason })
    }

    fn failed(&self, source: std::io::Error) -> LogError {
        LogError::Read { name: self.name.clone(), source }
    }
}

/// First and last message time from a chunk's header, ns; `None` for an empty chunk.
fn span_of(opcode: u8, body: &[u8]) -> Option<(u64, u64)> {
    let time = |place: usize| body.get(place..)?.first_chunk::<8>().map(|bytes| u64::from_le_bytes(*bytes));
    let (from, until) = (opcode == op::CHUNK).then(|| Some((time(0)?, time(8)?)))??;
    (from > 0 && from <= until).then_some((from, until))
}

/// Every record of a chunk, if its checksum is correct.
fn records_of_chunk(body: &[u8]) -> mcap::McapResult<Vec<Record<'static>>> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(RECORD_LIMIT_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let head: Vec<u8> = std::iter::once(op::CHUNK).chain((body.len() as u64).to_le_bytes()).collect();
    let mut input = head.as_slice().chain(body);
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                let read = input.read(reader.insert(need)).unwrap_or(0);
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => records.push(parse_record(opcode, data)?),
        }
    }
    Ok(records)
}
