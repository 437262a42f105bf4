//! Writes the records that are kept as a whole log.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::mem::take;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata, Record, op};
use protocol::log::reader::{RecordError, parse_record, records_of_chunk};

use super::scan::{Contents, Records, WriterReport};
use super::{RecoverError, is_sorted_anew};
use crate::log::Place;
use crate::output::{NewFile, WriteError};

/// Chunk size as in the recorder's own logs.
const CHUNK_BYTES: u64 = 64 * 1024;

type Writer = mcap::Writer<BufWriter<NewFile>>;

pub(crate) struct Rescue<'a> {
    path: PathBuf,
    /// What the file's own summary tells of its channels, for messages whose channel record is lost.
    told: &'a WriterReport,
    writer: Writer,
    /// The file's schemas and channels by their numbers there.
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, (u16, String)>,
    /// The chunk at hand is of another log.
    is_foreign: bool,
    pub(crate) kept: Kept,
    /// Messages wait until the end, and are then written in order of time.
    sorts: bool,
    waiting: Vec<Waiting>,
}

struct Waiting {
    header: MessageHeader,
    data: Vec<u8>,
    /// Among the messages of one time.
    place: Place,
}

/// What was kept.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Kept {
    pub(crate) span_ns: Option<(u64, u64)>,
    pub(crate) messages: u64,
    pub(crate) chunks: u64,
    pub(crate) records_about: u64,
    /// Messages whose channel nothing describes.
    pub(crate) undecodable: u64,
}

impl<'a> Rescue<'a> {
    /// Copies what can be read of a log and is kept; sorted, if it was not in order of time.
    pub(crate) fn of(
        output: &Path,
        records: &mut Records,
        contents: &'a Contents,
    ) -> Result<Self, RecoverError> {
        let file = NewFile::create(output)?;
        let path = output.to_owned();
        let options = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES))
            .library(&contents.told.library);
        let mut rescue = Self {
            told: &contents.told,
            writer: options
                .create(BufWriter::new(file))
                .map_err(|error| WriteError::at(&path)(std::io::Error::other(error)))?,
            path,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            is_foreign: false,
            kept: Kept::default(),
            sorts: is_sorted_anew(contents),
            waiting: Vec::new(),
        };
        for piece in &contents.good {
            let body = records.body(piece.at)?;
            // A chunk of another log has numbers of channels of its own.
            let is_foreign = piece.chunk.is_some_and(|name| contents.is_foreign(&name));
            let own = is_foreign.then(|| (take(&mut rescue.schemas), take(&mut rescue.channels)));
            rescue.is_foreign = is_foreign;
            rescue.keep(piece.opcode, &body)?;
            if let Some(own) = own {
                (rescue.schemas, rescue.channels) = own;
            }
        }
        Ok(rescue)
    }

    /// Keeps a record, or every record of a chunk.
    fn keep(&mut self, opcode: u8, body: &[u8]) -> Result<(), WriteError> {
        let kept = if opcode == op::CHUNK {
            self.kept.chunks += 1;
            // It was read before without an error; a file that has changed since then is lost here.
            records_of_chunk(body, |record| self.keep_record(record)).map_err(RecordError::into_mcap)
        } else {
            parse_record(opcode, body).and_then(|record| self.keep_record(record))
        };
        kept.map_err(|source| self.failed(source))
    }

    fn keep_record(&mut self, record: Record<'static>) -> mcap::McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                let id = self.writer.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => {
                // Schema 0 means no schema.
                let schema = self.schemas.get(&channel.schema_id).copied().unwrap_or(0);
                let id = self.writer.add_channel(
                    schema,
                    &channel.topic,
                    &channel.message_encoding,
                    &channel.metadata,
                )?;
                self.channels.insert(channel.id, (id, channel.topic));
            }
            Record::Message { header, data } => self.message(header, &data)?,
            Record::Metadata(metadata) => {
                self.kept.records_about += 1;
                self.writer.write_metadata(&metadata)?;
            }
            Record::Attachment { header, data, .. } => {
                self.kept.records_about += 1;
                self.writer.attach(&mcap::Attachment {
                    log_time: header.log_time,
                    create_time: header.create_time,
                    name: header.name,
                    media_type: header.media_type,
                    data,
                })?;
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, header: MessageHeader, data: &[u8]) -> mcap::McapResult<()> {
        if !self.find_channel(header.channel_id)? {
            self.kept.undecodable += 1;
            return Ok(());
        }
        let (channel_id, topic) = &self.channels[&header.channel_id];
        let header = MessageHeader { channel_id: *channel_id, ..header };
        if self.sorts {
            self.waiting.push(Waiting { header, data: data.to_vec(), place: Place::of(topic) });
        } else {
            self.writer.write_to_known_channel(&header, data)?;
        }
        self.kept.messages += 1;
        let (first, last) = self.kept.span_ns.unwrap_or((header.log_time, header.log_time));
        self.kept.span_ns = Some((first.min(header.log_time), last.max(header.log_time)));
        Ok(())
    }

    /// Whether a channel is known; one whose record is lost is made from the summary.
    fn find_channel(&mut self, id: u16) -> mcap::McapResult<bool> {
        if self.channels.contains_key(&id) {
            return Ok(true);
        }
        let Some(told) = self.told.channels.get(&id).filter(|_| !self.is_foreign) else { return Ok(false) };
        let schema = match self.told.schemas.get(&told.schema_id) {
            Some((schema, data)) => self.writer.add_schema(&schema.name, &schema.encoding, data)?,
            None => 0,
        };
        let new = self.writer.add_channel(schema, &told.topic, &told.message_encoding, &told.metadata)?;
        self.channels.insert(id, (new, told.topic.clone()));
        Ok(true)
    }

    /// Completes the log with what it is.
    pub(crate) fn finish(self, about: &Metadata) -> Result<PathBuf, WriteError> {
        let path = self.path.clone();
        let file = self.close(about).map_err(|error| WriteError::at(&path)(std::io::Error::other(error)))?;
        file.commit()
    }

    fn close(mut self, about: &Metadata) -> mcap::McapResult<NewFile> {
        let mut waiting = take(&mut self.waiting);
        let starts = waiting.iter_mut().filter(|message| message.place == Place::Release);
        if let Some(first) = starts.min_by_key(|message| message.header.log_time) {
            first.place = Place::PowerUp;
        }
        waiting.sort_by_key(|message| (message.header.log_time, message.place));
        for Waiting { header, data, .. } in waiting {
            self.writer.write_to_known_channel(&header, &data)?;
        }
        self.writer.write_metadata(about)?;
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner().map_err(std::io::IntoInnerError::into_error)?)
    }

    fn failed(&self, error: mcap::McapError) -> WriteError {
        WriteError::at(&self.path)(std::io::Error::other(error))
    }
}
