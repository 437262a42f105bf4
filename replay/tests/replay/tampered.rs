//! Rewrites logs with messages left out, changed or taken from another log: whole files with
//! correct checksums.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::TOPIC_COMPUTER_FRAME;

/// A message of a log, by its topic.
#[derive(Debug, Clone)]
pub(crate) struct LogMessage {
    pub(crate) topic: String,
    pub(crate) log_time_ns: u64,
    pub(crate) sequence: u32,
    pub(crate) data: Vec<u8>,
    encoding: String,
    schema: (String, std::sync::Arc<[u8]>),
}

impl LogMessage {
    /// The same at another time.
    pub(crate) fn at(&self, log_time_ns: u64) -> Self {
        Self { log_time_ns, ..self.clone() }
    }

    /// A frame of the flight computer.
    pub(crate) fn is_frame(&self) -> bool {
        self.topic == TOPIC_COMPUTER_FRAME
    }
}

/// A log in memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Held {
    library: String,
    about: Vec<LogItem>,
    pub(crate) messages: Vec<LogMessage>,
}

impl Held {
    pub(crate) fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap();
        let mut reader = LogReader::new(bytes.as_slice());
        let mut held = Self::default();
        while let Some(item) = reader.next_item().unwrap() {
            match item {
                LogItem::Library(library) => held.library = library,
                LogItem::Message { channel_id, log_time_ns, sequence, data } => {
                    let channel = reader.channel(channel_id).unwrap();
                    held.messages.push(LogMessage {
                        topic: channel.topic.clone(),
                        log_time_ns,
                        sequence,
                        data,
                        encoding: channel.message_encoding.clone(),
                        schema: (channel.schema_name.clone(), channel.schema.clone()),
                    });
                }
                item => held.about.push(item),
            }
        }
        assert_eq!(reader.damage(), None);
        held
    }

    /// Time, topic, number and bytes of each message, in an order that the file's does not change.
    pub(crate) fn facts(&self) -> Vec<(u64, String, u32, Vec<u8>)> {
        let facts = |message: &LogMessage| {
            (message.log_time_ns, message.topic.clone(), message.sequence, message.data.clone())
        };
        let mut facts: Vec<_> = self.messages.iter().map(facts).collect();
        facts.sort_unstable();
        facts
    }

    /// How many frames or frames there are.
    pub(crate) fn frames(&self) -> usize {
        self.messages.iter().filter(|message| message.is_frame()).count()
    }

    /// Leaves out the messages that are not wanted.
    pub(crate) fn retain(&mut self, wanted: impl FnMut(&LogMessage) -> bool) {
        self.messages.retain(wanted);
    }

    /// Appends everything of another log, with this delay.
    pub(crate) fn append(&mut self, other: &Self, later_ns: u64) {
        self.about.extend(other.about.iter().cloned());
        self.messages.extend(other.messages.iter().map(|message| message.at(message.log_time_ns + later_ns)));
    }

    /// Gives the messages of each topic the numbers that a writer of just these would.
    pub(crate) fn renumber(&mut self) {
        let mut next: BTreeMap<String, u32> = BTreeMap::new();
        for message in &mut self.messages {
            let number = next.entry(message.topic.clone()).or_default();
            message.sequence = *number;
            *number += 1;
        }
    }

    /// The entries of a metadata record.
    pub(crate) fn metadata(&mut self, wanted: &str) -> &mut BTreeMap<String, String> {
        let found = self.about.iter_mut().find_map(|item| match item {
            LogItem::Metadata { name, entries } if name == wanted => Some(entries),
            _ => None,
        });
        found.unwrap()
    }

    /// Writes it as a whole log.
    pub(crate) fn write(&self, path: &Path) {
        self.write_with(path, mcap::WriteOptions::new());
    }

    /// Writes it with options of the format.
    pub(crate) fn write_with(&self, path: &Path, options: mcap::WriteOptions) {
        let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
        let options = options.library(&self.library).chunk_size(Some(64 * 1024));
        let mut writer = options.create(file).unwrap();
        for item in &self.about {
            match item {
                LogItem::Metadata { name, entries } => {
                    let metadata = Metadata { name: name.clone(), metadata: entries.clone() };
                    writer.write_metadata(&metadata).unwrap();
                }
                LogItem::Attachment { name, data } => {
                    let attachment = mcap::Attachment {
                        log_time: 0,
                        create_time: 0,
                        name: name.clone(),
                        media_type: "text/plain".to_owned(),
                        data: Cow::Borrowed(data),
                    };
                    writer.attach(&attachment).unwrap();
                }
                _ => {}
            }
        }
        let mut channels: BTreeMap<String, u16> = BTreeMap::new();
        for message in &self.messages {
            let id = *channels.entry(message.topic.clone()).or_insert_with(|| {
                let (name, data) = &message.schema;
                let encoding = if data.is_empty() { "" } else { "protobuf" };
                let schema =
                    if name.is_empty() { 0 } else { writer.add_schema(name, encoding, data).unwrap() };
                writer.add_channel(schema, &message.topic, &message.encoding, &BTreeMap::new()).unwrap()
            });
            let header = MessageHeader {
                channel_id: id,
                sequence: message.sequence,
                log_time: message.log_time_ns,
                publish_time: message.log_time_ns,
            };
            writer.write_to_known_channel(&header, &message.data).unwrap();
        }
        writer.finish().unwrap();
    }
}
