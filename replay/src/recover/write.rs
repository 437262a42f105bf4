//! Writes the recovered records as a whole log.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata, Record, op};
use protocol::log::reader::{RecordError, parse_record, records_of_chunk};
use protocol::log::record::{METADATA_RECOVERY, RECOVERY_FAULT_ENTRY};

use super::Recovery;
use super::scan::WriterReport;
use crate::output::{Destination, NewFile, WriteError};

/// Chunk size as in the recorder's own logs.
const CHUNK_BYTES: u64 = 64 * 1024;

type Writer = mcap::Writer<BufWriter<NewFile>>;

pub(super) struct Rescue<'a> {
    path: PathBuf,
    /// What the file's own summary tells of its channels, for messages whose channel record is lost.
    told: &'a WriterReport,
    /// Created when the library's name is known, which is the first record of a file.
    state: State,
    /// The file's schemas and channels by their numbers there.
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, u16>,
    span_ns: Option<(u64, u64)>,
    messages: u64,
    chunks: u64,
    records_about: u64,
    /// Messages whose channel nothing describes.
    undecodable: u64,
}

enum State {
    Waiting(NewFile),
    Writing(Box<Writer>),
    Gone,
}

impl<'a> Rescue<'a> {
    pub(super) fn create(
        destination: Destination,
        input: &Path,
        told: &'a WriterReport,
    ) -> Result<Self, WriteError> {
        Ok(Self {
            path: destination.path.to_owned(),
            told,
            state: State::Waiting(NewFile::create(destination, input)?),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            span_ns: None,
            messages: 0,
            chunks: 0,
            records_about: 0,
            undecodable: 0,
        })
    }

    pub(super) fn first_ns(&self) -> Option<u64> {
        self.span_ns.map(|(first, _)| first)
    }

    pub(super) fn messages(&self) -> u64 {
        self.messages
    }

    /// Keeps a record, or every record of a chunk.
    pub(super) fn keep(&mut self, opcode: u8, body: &[u8]) -> Result<(), WriteError> {
        let kept = if opcode == op::CHUNK {
            self.chunks += 1;
            // It was read before without an error; a file that has changed since then is lost here.
            records_of_chunk(body, |record| self.keep_record(record)).map_err(RecordError::into_mcap)
        } else {
            parse_record(opcode, body).and_then(|record| self.keep_record(record))
        };
        kept.map_err(|source| self.failed(source))
    }

    fn keep_record(&mut self, record: Record<'static>) -> mcap::McapResult<()> {
        match record {
            Record::Header(header) => {
                self.writer(&header.library)?;
            }
            Record::Schema { header, data } => {
                let id = self.writer("")?.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => {
                // Schema 0 means no schema.
                let schema = self.schemas.get(&channel.schema_id).copied().unwrap_or(0);
                let id = self.writer("")?.add_channel(
                    schema,
                    &channel.topic,
                    &channel.message_encoding,
                    &channel.metadata,
                )?;
                self.channels.insert(channel.id, id);
            }
            Record::Message { header, data } => self.message(header, &data)?,
            Record::Metadata(metadata) => {
                self.records_about += 1;
                self.writer("")?.write_metadata(&metadata)?;
            }
            Record::Attachment { header, data, .. } => {
                self.records_about += 1;
                self.writer("")?.attach(&mcap::Attachment {
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
        let Some(channel_id) = self.channel(header.channel_id)? else {
            self.undecodable += 1;
            return Ok(());
        };
        self.writer("")?.write_to_known_channel(&MessageHeader { channel_id, ..header }, data)?;
        self.messages += 1;
        let (first, last) = self.span_ns.unwrap_or((header.log_time, header.log_time));
        self.span_ns = Some((first.min(header.log_time), last.max(header.log_time)));
        Ok(())
    }

    /// The new number of a channel; of one whose record is lost, from the summary.
    fn channel(&mut self, id: u16) -> mcap::McapResult<Option<u16>> {
        if let Some(known) = self.channels.get(&id) {
            return Ok(Some(*known));
        }
        let Some(told) = self.told.channels.get(&id) else { return Ok(None) };
        let schema = match self.told.schemas.get(&told.schema_id) {
            Some((schema, data)) => self.writer("")?.add_schema(&schema.name, &schema.encoding, data)?,
            None => 0,
        };
        let new =
            self.writer("")?.add_channel(schema, &told.topic, &told.message_encoding, &told.metadata)?;
        self.channels.insert(id, new);
        Ok(Some(new))
    }

    /// The writer; created with this library's name if necessary.
    fn writer(&mut self, library: &str) -> mcap::McapResult<&mut Writer> {
        self.state = match std::mem::replace(&mut self.state, State::Gone) {
            State::Waiting(file) => State::Writing(Box::new(
                mcap::WriteOptions::new()
                    .compression(Some(mcap::Compression::Lz4))
                    .chunk_size(Some(CHUNK_BYTES))
                    .library(library)
                    .create(BufWriter::new(file))?,
            )),
            other => other,
        };
        match &mut self.state {
            State::Writing(writer) => Ok(writer),
            // It is only absent after a failed creation, whose error has ended the recovery.
            State::Waiting(_) | State::Gone => Err(mcap::McapError::UnexpectedEof),
        }
    }

    pub(super) fn finish(mut self, recovery: &mut Recovery) -> Result<(), WriteError> {
        recovery.messages = self.messages;
        recovery.chunks = self.chunks;
        recovery.records_about = self.records_about;
        recovery.undecodable = self.undecodable;
        recovery.kept_s = self.span_ns.map(|(first, last)| last.saturating_sub(first) as f64 / 1e9);
        self.close(recovery).map_err(|source| self.failed(source))
    }

    fn close(&mut self, recovery: &Recovery) -> mcap::McapResult<()> {
        let lost = recovery.lost.iter().map(|lost| {
            format!("bytes {} to {}: {}", lost.from_byte, lost.from_byte + lost.bytes, lost.reason)
        });
        let facts = BTreeMap::from([
            ("from".to_owned(), recovery.input.clone()),
            ("ended".to_owned(), recovery.ended.to_string()),
            ("lost".to_owned(), lost.collect::<Vec<_>>().join("; ")),
            (RECOVERY_FAULT_ENTRY.to_owned(), recovery.fault().unwrap_or_default()),
        ]);
        let writer = self.writer("")?;
        writer.write_metadata(&Metadata { name: METADATA_RECOVERY.to_owned(), metadata: facts })?;
        writer.finish()?;
        if let State::Writing(writer) = std::mem::replace(&mut self.state, State::Gone) {
            let file = writer.into_inner().into_inner().map_err(std::io::IntoInnerError::into_error)?;
            file.commit().map_err(|error| error.source)?;
        }
        Ok(())
    }

    fn failed(&self, error: mcap::McapError) -> WriteError {
        WriteError::at(&self.path)(std::io::Error::other(error))
    }
}
