//! Writes the records that are kept as a whole log.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata, Record, op};
use protocol::log::reader::{RecordError, parse_record, records_of_chunk};

use super::RecoverError;
use super::scan::{Contents, FileSummary, Records};
use crate::log::{ComputerOrder, IN_ORDER_NS};
use crate::output::{NewFile, WriteError};

/// Chunk size as in the recorder's own logs.
const CHUNK_BYTES: u64 = 64 * 1024;

type Writer = mcap::Writer<BufWriter<NewFile>>;

pub(crate) struct Rescue<'a> {
    path: PathBuf,
    /// The file's summary, for messages whose channel record is lost.
    summary: &'a FileSummary,
    writer: Writer,
    /// The file's schemas, and its channels with their topics, by their numbers there.
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, (u16, String)>,
    order: ComputerOrder,
    pub(crate) kept: Kept,
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
    pub(crate) beside_chunks: u64,
    /// Some message comes later than one that belongs behind it.
    pub(crate) out_of_order: bool,
}

impl<'a> Rescue<'a> {
    /// Copies the good records of a log into a new file.
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
            .library(&contents.library);
        let mut rescue = Self {
            summary: &contents.summary,
            writer: options
                .create(BufWriter::new(file))
                .map_err(|error| WriteError::at(&path)(std::io::Error::other(error)))?,
            path,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            order: ComputerOrder::default(),
            kept: Kept::default(),
        };
        for piece in &contents.good {
            let body = records.body(piece.at)?;
            rescue.keep(piece.opcode, &body)?;
        }
        Ok(rescue)
    }

    /// Keeps a record, or every record of a chunk.
    fn keep(&mut self, opcode: u8, body: &[u8]) -> Result<(), WriteError> {
        self.kept.beside_chunks += u64::from(opcode == op::MESSAGE && self.kept.chunks > 0);
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
        let is_broken = self.order.is_broken_by(topic, header.log_time);
        let header = MessageHeader { channel_id: *channel_id, ..header };
        self.writer.write_to_known_channel(&header, data)?;
        self.kept.messages += 1;
        let (first, last) = self.kept.span_ns.unwrap_or((header.log_time, header.log_time));
        self.kept.out_of_order |= is_broken || last.saturating_sub(header.log_time) > IN_ORDER_NS;
        self.kept.span_ns = Some((first.min(header.log_time), last.max(header.log_time)));
        Ok(())
    }

    /// Whether a channel is known; one whose record is lost is made from the summary.
    fn find_channel(&mut self, id: u16) -> mcap::McapResult<bool> {
        if self.channels.contains_key(&id) {
            return Ok(true);
        }
        let Some(told) = self.summary.channels.get(&id) else { return Ok(false) };
        let schema = match self.summary.schemas.get(&told.schema_id) {
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
        self.writer.write_metadata(about)?;
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner().map_err(std::io::IntoInnerError::into_error)?)
    }

    fn failed(&self, error: mcap::McapError) -> WriteError {
        WriteError::at(&self.path)(std::io::Error::other(error))
    }
}
