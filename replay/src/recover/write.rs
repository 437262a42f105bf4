//! Writes the recovered records as a complete log.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{Channel, MessageHeader, Metadata, Record, op};
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::log::reader::{RecordError, parse_record, records_of_chunk};
use protocol::log::record::{TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START};
use serde::Serialize;

use super::RecoverError;
use super::scan::{Contents, Records};
use crate::log::{ComputerOrder, IN_ORDER_NS, Place, Sequences};
use crate::output::{NewFile, WriteError};

/// Chunk size as in the recorder's own logs.
const CHUNK_BYTES: u64 = 64 * 1024;

type Writer = mcap::Writer<BufWriter<NewFile>>;

pub(crate) struct Rescue<'a> {
    path: PathBuf,
    /// The parts of the file, with its summary for messages whose channel record is lost.
    contents: &'a Contents,
    writer: Writer,
    /// The file's schemas, and its channels with their topics, by their numbers there.
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, (u16, String)>,
    order: ComputerOrder,
    sequences: Sequences,
    /// Messages that are still to be put in order; `None` while they are written as they come.
    held: Option<Vec<Held>>,
    pub(crate) recovered: Recovered,
}

/// A message with its new channel.
struct Held {
    header: MessageHeader,
    data: Vec<u8>,
    place: Place,
    /// Number of a frame; 0 of a start, after which numbers may begin again.
    frame: Option<u64>,
}

/// Counts of what was recovered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Recovered {
    #[serde(skip)]
    pub(crate) span_ns: Option<(u64, u64)>,
    pub messages: u64,
    pub chunks: u64,
    /// Attachments and metadata records.
    pub records_about: u64,
    /// Messages of a channel without a description.
    pub undecodable: u64,
    /// Messages from between the chunks.
    pub beside_chunks: u64,
    /// Messages that were missing already, by their numbers.
    pub missing: u64,
    /// Some message comes later than one that belongs behind it.
    pub out_of_order: bool,
    /// How the recovered log is in order; `None` if it was, or if no order was found.
    pub put_in_order: Option<&'static str>,
}

impl<'a> Rescue<'a> {
    /// Copies the good records of a log into a new file.
    pub(crate) fn of(
        output: &Path,
        records: &mut Records,
        contents: &'a Contents,
    ) -> Result<Self, RecoverError> {
        let mut rescue = Self::begin(output, contents, None)?;
        rescue.add_all(records)?;
        let missing = rescue.sequences.lost();
        if rescue.recovered.out_of_order {
            drop(rescue);
            rescue = Self::begin(output, contents, Some(Vec::new()))?;
            rescue.add_all(records)?;
            rescue.put_in_order().map_err(|error| rescue.failed(error))?;
        }
        rescue.recovered.missing = missing;
        Ok(rescue)
    }

    fn begin(output: &Path, contents: &'a Contents, held: Option<Vec<Held>>) -> Result<Self, RecoverError> {
        let file = NewFile::create(output)?;
        let path = output.to_owned();
        let options = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES))
            .library(&contents.library);
        Ok(Self {
            contents,
            writer: options
                .create(BufWriter::new(file))
                .map_err(|error| WriteError::at(&path)(std::io::Error::other(error)))?,
            path,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            order: ComputerOrder::default(),
            sequences: Sequences::default(),
            held,
            recovered: Recovered::default(),
        })
    }

    fn add_all(&mut self, records: &mut Records) -> Result<(), RecoverError> {
        for piece in &self.contents.good {
            let body = records.body(piece)?;
            self.add(piece.opcode, &body)?;
        }
        Ok(())
    }

    /// Writes the held messages by time; where the numbers of the frames contradict their times, as
    /// they came, each at the earliest at the time of the one before it.
    fn put_in_order(&mut self) -> mcap::McapResult<()> {
        let mut held = self.held.take().unwrap_or_default();
        // A start is that of a power-up if the first frame is of its time.
        let first = |held: &&Held| held.place == Place::Frame && held.frame == Some(1);
        let begins: BTreeSet<u64> = held.iter().filter(first).map(|held| held.header.log_time).collect();
        for start in held.iter_mut().filter(|held| held.place == Place::Release) {
            if begins.contains(&start.header.log_time) {
                start.place = Place::PowerUp;
            }
        }
        let as_they_came: Vec<&Held> = held.iter().collect();
        let mut by_time = as_they_came.clone();
        by_time.sort_by_key(|held| (held.header.log_time, held.place));
        let ascend = |order: &[&Held]| {
            order.iter().filter_map(|held| held.frame).is_sorted_by(|last, next| last < next || *next == 0)
        };
        let (order, words) = if ascend(&by_time) {
            (by_time, Some("its records are sorted by time"))
        } else if ascend(&as_they_came) {
            let words = "its times contradict the numbers of its frames, whose order is kept: times that went back are replaced";
            (as_they_came, Some(words))
        } else {
            (as_they_came, None)
        };
        self.recovered.put_in_order = words;
        let (mut last_ns, mut before_ns) = (0, None);
        for Held { header, data, .. } in order {
            let mut header = *header;
            if words.is_some() {
                // Records of one time stay so.
                let same = before_ns.replace(header.log_time) == Some(header.log_time);
                last_ns = if same { last_ns } else { header.log_time.max(last_ns + 1) };
                header.log_time = last_ns;
            }
            self.writer.write_to_known_channel(&header, data)?;
        }
        Ok(())
    }

    /// Adds a record, or every record of a chunk.
    fn add(&mut self, opcode: u8, body: &[u8]) -> Result<(), WriteError> {
        self.recovered.beside_chunks += u64::from(opcode == op::MESSAGE && self.recovered.chunks > 0);
        let added = if opcode == op::CHUNK {
            self.recovered.chunks += 1;
            // It was read before without an error; a file that has changed since then is lost here.
            records_of_chunk(body, |record| self.add_record(record)).map_err(RecordError::into_mcap)
        } else {
            parse_record(opcode, body).and_then(|record| self.add_record(record))
        };
        added.map_err(|source| self.failed(source))
    }

    fn add_record(&mut self, record: Record<'_>) -> mcap::McapResult<()> {
        match record {
            Record::Schema { header, data } => {
                let id = self.writer.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => {
                // Schema 0 means no schema.
                let schema = self.schemas.get(&channel.schema_id).copied().unwrap_or(0);
                self.add_channel(schema, &channel)?;
            }
            Record::Message { header, data } => self.message(header, &data)?,
            Record::Metadata(metadata) => {
                self.recovered.records_about += 1;
                self.writer.write_metadata(&metadata)?;
            }
            Record::Attachment { header, data, .. } => {
                self.recovered.records_about += 1;
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
            self.recovered.undecodable += 1;
            return Ok(());
        }
        let (channel_id, topic) = &self.channels[&header.channel_id];
        let is_broken = self.order.is_broken_by(topic, header.log_time);
        let header = MessageHeader { channel_id: *channel_id, ..header };
        self.sequences.note(header.channel_id, header.sequence);
        if let Some(held) = &mut self.held {
            let frame = match topic.as_str() {
                TOPIC_COMPUTER_FRAME => ComputerFrame::decode(data).ok().map(|frame| frame.input.frame),
                TOPIC_COMPUTER_START => Some(0),
                _ => None,
            };
            held.push(Held { header, data: data.to_vec(), place: Place::of(topic), frame });
        } else {
            self.writer.write_to_known_channel(&header, data)?;
        }
        self.recovered.messages += 1;
        let (first, last) = self.recovered.span_ns.unwrap_or((header.log_time, header.log_time));
        self.recovered.out_of_order |= is_broken || last.saturating_sub(header.log_time) > IN_ORDER_NS;
        self.recovered.span_ns = Some((first.min(header.log_time), last.max(header.log_time)));
        Ok(())
    }

    /// Whether a channel is available; one whose record is lost is made from the summary.
    fn find_channel(&mut self, id: u16) -> mcap::McapResult<bool> {
        if self.channels.contains_key(&id) {
            return Ok(true);
        }
        let Some(channel) = self.contents.summary.channels.get(&id) else { return Ok(false) };
        let schema = match self.contents.summary.schemas.get(&channel.schema_id) {
            Some((schema, data)) => self.writer.add_schema(&schema.name, &schema.encoding, data)?,
            None => 0,
        };
        self.add_channel(schema, channel)?;
        Ok(true)
    }

    fn add_channel(&mut self, schema: u16, channel: &Channel) -> mcap::McapResult<()> {
        let Channel { id, topic, message_encoding, metadata, .. } = channel;
        let new = self.writer.add_channel(schema, topic, message_encoding, metadata)?;
        self.channels.insert(*id, (new, topic.clone()));
        Ok(())
    }

    /// Completes the log with what it is.
    pub(crate) fn finish(mut self, about: &Metadata) -> Result<PathBuf, WriteError> {
        let ended = self.writer.write_metadata(about).and_then(|()| self.writer.finish());
        ended.map_err(|error| self.failed(error))?;
        let file = self.writer.into_inner().into_inner().map_err(std::io::IntoInnerError::into_error);
        file.map_err(WriteError::at(&self.path))?.commit()
    }

    fn failed(&self, error: mcap::McapError) -> WriteError {
        WriteError::at(&self.path)(std::io::Error::other(error))
    }
}
