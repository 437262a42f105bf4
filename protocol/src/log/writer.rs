//! Writes records as MCAP, without threads or clocks.

use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::Arc;

use foxglove::{Context, PartialMetadata, RawChannel, Schema};
use mcap::records::MessageHeader;

use super::build::build_info;
use super::record::{
    ATTACHMENT_DIALECT, ATTACHMENT_PROFILE, ATTACHMENT_SCENARIO, Direction, ENCODING_MAVLINK, METADATA_BUILD,
    METADATA_RUN, METADATA_SCHEMA, RawFrame, Record, SCHEMA_VERSION, SCHEMA_VERSION_ENTRY, TOPIC_BOOK,
    TOPIC_BOOK_HEAD, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_ESTIMATE, TOPIC_EVENTS,
    TOPIC_OPERATOR, TOPIC_PILOT_TIMING, TOPIC_RAW_RX, TOPIC_RAW_TX, TOPIC_TELEMETRY, TOPIC_TRANSFORM,
    TOPIC_TRUTH_SAMPLE, TOPIC_VERDICT, log_message, transform,
};
use super::{DESCRIPTORS_COMPUTER_V1, DESCRIPTORS_FLIGHT_V1, DESCRIPTORS_V1};
use crate::dialect::DIALECT_XML;

/// A killed process loses its open chunk, so chunks are small.
const CHUNK_BYTES: u64 = 64 * 1024;

/// The facts about a run that a log begins with.
#[derive(Debug, Clone, Default)]
pub struct LogHeader {
    /// The program that writes the log.
    pub writer: String,
    /// Start of the run, nanoseconds since the Unix epoch; the times of records count from here.
    pub start_unix_ns: u64,
    /// Facts about the run: profile, seed, start and so on.
    pub run: BTreeMap<String, String>,
    /// The profile's text, if available.
    pub profile_toml: Option<String>,
    /// The scenario's text, which the random draws are made from, if there is one.
    pub scenario_toml: Option<String>,
    /// Where the decoded records are published, too, while they are written.
    pub live: Option<Arc<Context>>,
}

#[derive(Debug, thiserror::Error)]
pub enum LogWriteError {
    /// The MCAP writer reported an error, or the file could not be written.
    #[error("the MCAP writer failed")]
    Mcap(#[from] mcap::McapError),
    /// A Foxglove message could not be encoded.
    #[error("encoding {topic}: {reason}")]
    Encode {
        topic: &'static str,
        /// The encoder's message.
        reason: String,
    },
}

/// A channel of the log, the number of its last message, and the same channel for live values.
#[derive(Clone)]
struct Channel {
    id: u16,
    sequence: u32,
    live: Option<Arc<RawChannel>>,
}

/// Writes records as MCAP messages and opens channels as they are needed.
pub struct LogWriter<W: Write + Seek> {
    writer: mcap::Writer<W>,
    start_unix_ns: u64,
    channels: BTreeMap<(String, String), Channel>,
    live: Option<Arc<Context>>,
    buffer: Vec<u8>,
}

impl<W: Write + Seek> LogWriter<W> {
    /// Starts a log with its header, the metadata of build and run, and the attached profile,
    /// scenario and dialect.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn new(output: W, header: &LogHeader) -> Result<Self, LogWriteError> {
        let mut writer = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .chunk_size(Some(CHUNK_BYTES))
            .library(format!("touchdown {} {}", header.writer, env!("CARGO_PKG_VERSION")))
            .create(output)?;
        let schema = BTreeMap::from([(SCHEMA_VERSION_ENTRY.to_owned(), SCHEMA_VERSION.to_string())]);
        for (name, metadata) in
            [(METADATA_BUILD, build_info()), (METADATA_SCHEMA, schema), (METADATA_RUN, header.run.clone())]
        {
            writer.write_metadata(&mcap::records::Metadata { name: name.to_owned(), metadata })?;
        }
        for (name, media_type, text) in [
            (ATTACHMENT_PROFILE, "application/toml", header.profile_toml.as_deref()),
            (ATTACHMENT_SCENARIO, "application/toml", header.scenario_toml.as_deref()),
            (ATTACHMENT_DIALECT, "application/xml", Some(DIALECT_XML)),
        ] {
            let Some(text) = text else { continue };
            writer.attach(&mcap::Attachment {
                log_time: header.start_unix_ns,
                create_time: header.start_unix_ns,
                name: name.to_owned(),
                media_type: media_type.to_owned(),
                data: text.as_bytes().into(),
            })?;
        }
        Ok(Self {
            writer,
            start_unix_ns: header.start_unix_ns,
            channels: BTreeMap::new(),
            live: header.live.clone(),
            buffer: Vec::new(),
        })
    }

    /// Writes one record; `time_ns` counts from the start of the run.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn write(&mut self, record: &Record, time_ns: u64) -> Result<(), LogWriteError> {
        let log_time = self.start_unix_ns.saturating_add(time_ns);
        match record {
            Record::LandingVerdict(verdict) => self.write_message(TOPIC_VERDICT, verdict.as_ref(), log_time),
            Record::Telemetry(telemetry) => self.write_message(TOPIC_TELEMETRY, telemetry.as_ref(), log_time),
            Record::OperatorAction(action) => self.write_message(TOPIC_OPERATOR, action, log_time),
            Record::BookEntry(entry) => self.write_message(TOPIC_BOOK, entry, log_time),
            Record::BookHead(head) => self.write_message(TOPIC_BOOK_HEAD, head, log_time),
            Record::ComputerStart(start) => {
                self.write_message(TOPIC_COMPUTER_START, start.as_ref(), log_time)
            }
            Record::ComputerFrame(frame) => {
                self.write_message(TOPIC_COMPUTER_FRAME, frame.as_ref(), log_time)
            }
            Record::PilotTiming(timing) => self.write_message(TOPIC_PILOT_TIMING, timing, log_time),
            Record::Estimate(estimate) => self.write_message(TOPIC_ESTIMATE, estimate.as_ref(), log_time),
            Record::TruthSample(truth) => {
                self.write_message(TOPIC_TRUTH_SAMPLE, truth.as_ref(), log_time)?;
                self.write_foxglove(TOPIC_TRANSFORM, &transform(truth, log_time), log_time)
            }
            Record::RawFrame(frame) => self.write_raw(frame, log_time),
            Record::Event(event) => {
                self.write_foxglove(TOPIC_EVENTS, &log_message(event, log_time), log_time)
            }
        }
    }

    /// Ends the open chunk, so that everything up to here can be read even if nothing follows.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn flush(&mut self) -> Result<(), LogWriteError> {
        Ok(self.writer.flush()?)
    }

    /// Writes an entry of metadata that becomes available only now.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn write_metadata(&mut self, name: &str, key: &str, value: String) -> Result<(), LogWriteError> {
        let metadata = BTreeMap::from([(key.to_owned(), value)]);
        Ok(self.writer.write_metadata(&mcap::records::Metadata { name: name.to_owned(), metadata })?)
    }

    /// Writes the summary and the footer.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn finish(mut self) -> Result<W, LogWriteError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }

    fn write_message<M: prost::Message + prost::Name>(
        &mut self,
        topic: &'static str,
        message: &M,
        log_time: u64,
    ) -> Result<(), LogWriteError> {
        let descriptors = match M::PACKAGE {
            "touchdown.log.v1" => DESCRIPTORS_V1,
            "touchdown.flight.v1" => DESCRIPTORS_FLIGHT_V1,
            _ => DESCRIPTORS_COMPUTER_V1,
        };
        self.write_protobuf(topic, Some((&M::full_name(), descriptors)), log_time, |buffer| {
            buffer.reserve(message.encoded_len());
            message.encode_raw(buffer);
            Ok(())
        })
    }

    fn write_foxglove<M: foxglove::Encode>(
        &mut self,
        topic: &'static str,
        message: &M,
        log_time: u64,
    ) -> Result<(), LogWriteError> {
        let schema = M::get_schema();
        let schema = schema.as_ref().map(|schema| (schema.name.as_str(), schema.data.as_ref()));
        self.write_protobuf(topic, schema, log_time, |buffer| {
            let encoded = message.encode(buffer);
            encoded.map_err(|error| LogWriteError::Encode { topic, reason: error.to_string() })
        })
    }

    fn write_protobuf(
        &mut self,
        topic: &'static str,
        schema: Option<(&str, &[u8])>,
        log_time: u64,
        encode: impl FnOnce(&mut Vec<u8>) -> Result<(), LogWriteError>,
    ) -> Result<(), LogWriteError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        encode(&mut buffer)?;
        let channel = self.channel(topic, "protobuf", schema, &BTreeMap::new())?;
        let written = self.put(&channel, log_time, &buffer);
        self.buffer = buffer;
        written
    }

    fn write_raw(&mut self, frame: &RawFrame, log_time: u64) -> Result<(), LogWriteError> {
        let topic = match frame.direction {
            Direction::Rx => TOPIC_RAW_RX,
            Direction::Tx => TOPIC_RAW_TX,
        };
        let metadata = BTreeMap::from([
            ("dialect".to_owned(), "touchdown".to_owned()),
            ("endpoint".to_owned(), frame.endpoint.to_owned()),
            ("link".to_owned(), frame.link.clone()),
        ]);
        // Every channel has a schema: some readers refuse a file with a channel that has none.
        let schema = ("mavlink2.Frame", RAW_FRAME_SCHEMA);
        let channel = self.channel(topic, ENCODING_MAVLINK, Some(schema), &metadata)?;
        self.put(&channel, log_time, &frame.bytes)
    }

    fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: Option<(&str, &[u8])>,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Channel, LogWriteError> {
        let distinction = metadata.values().map(String::as_str).collect::<Vec<_>>().join(" ");
        let key = (topic.to_owned(), distinction);
        if let Some(channel) = self.channels.get_mut(&key) {
            channel.sequence += 1;
            return Ok(channel.clone());
        }
        let is_protobuf = encoding == "protobuf";
        let schema_id = match schema {
            Some((name, data)) => {
                self.writer.add_schema(name, if is_protobuf { encoding } else { "text" }, data)?
            }
            None => 0,
        };
        let id = self.writer.add_channel(schema_id, topic, encoding, metadata)?;
        // The programs that show live values decode no raw frames.
        let live = self.live.as_ref().filter(|_| is_protobuf).and_then(|live| {
            let schema = schema.map(|(name, data)| Schema::new(name, encoding, data.to_vec()));
            live.channel_builder(topic).message_encoding(encoding).schema(schema).build_raw().ok()
        });
        let channel = Channel { id, sequence: 0, live };
        self.channels.insert(key, channel.clone());
        Ok(channel)
    }

    fn put(&mut self, channel: &Channel, log_time: u64, data: &[u8]) -> Result<(), LogWriteError> {
        if let Some(live) = &channel.live {
            live.log_with_meta(data, PartialMetadata::with_log_time(log_time));
        }
        // publish_time equals log_time because PlotJuggler requires it.
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.sequence,
            log_time,
            publish_time: log_time,
        };
        Ok(self.writer.write_to_known_channel(&header, data)?)
    }
}

/// The end of a log without a summary: it completes a log of the records up to a mark
/// ([`super::recorder::Recorder::mark_soon`]).
pub fn ending() -> Vec<u8> {
    // The lengths of the two records, and zeros: no checksum, no summary.
    const DATA_END_BYTES: u8 = 4;
    const FOOTER_BYTES: u8 = 20;
    let mut bytes = Vec::new();
    for (opcode, len) in
        [(mcap::records::op::DATA_END, DATA_END_BYTES), (mcap::records::op::FOOTER, FOOTER_BYTES)]
    {
        bytes.push(opcode);
        bytes.extend_from_slice(&u64::from(len).to_le_bytes());
        bytes.resize(bytes.len() + usize::from(len), 0);
    }
    bytes.extend_from_slice(mcap::MAGIC);
    bytes
}

const RAW_FRAME_SCHEMA: &[u8] =
    b"One whole MAVLink frame, start marker to signature. Definitions: the attached dialect and its includes.";
