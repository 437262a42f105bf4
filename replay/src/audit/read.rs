//! Reads what a log holds of books: the entries and signed ends of a station's own, and the ends that a vehicle was told.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use prost::Message as _;
use protocol::book::{Known, SignedHead};
use protocol::dialect::MavMessage;
use protocol::frame::Framer;
use protocol::log::reader::{Damage, LogChannel, LogItem, LogReader};
use protocol::log::record::{TOPIC_BOOK, TOPIC_BOOK_HEAD, TOPIC_RAW_RX};
use protocol::log::v1::{BookEntry, BookHead};

/// Why a log cannot be audited.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error("{}: cannot be read", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{}: not an MCAP file", path.display())]
    NotALog { path: PathBuf },
}

/// What one log holds of books.
#[derive(Debug, Clone, Default)]
pub struct Contents {
    pub name: String,
    /// The entries of the station's book, in the order of the file.
    pub entries: Vec<BookEntry>,
    pub heads: Vec<BookHead>,
    /// The ends of books that the vehicle received.
    pub told_to_vehicle: Vec<Known>,
    pub damage: Option<String>,
}

/// Reads a log to its end, or to its first damage.
///
/// # Errors
/// The file cannot be read, or is no log.
pub fn read(path: &Path) -> Result<Contents, ReadError> {
    let failed = |source| ReadError::Read { path: path.to_owned(), source };
    let mut reader = LogReader::new(BufReader::new(File::open(path).map_err(failed)?));
    let mut contents = Contents { name: path.display().to_string(), ..Contents::default() };
    while let Some(item) = reader.next_item().map_err(failed)? {
        if let LogItem::Message { channel_id, data, .. } = item
            && let Some(channel) = reader.channel(channel_id)
        {
            contents.take(channel, &data);
        }
    }
    if reader.damage() == Some(&Damage::NotMcap) {
        return Err(ReadError::NotALog { path: path.to_owned() });
    }
    contents.damage = reader.damage().map(ToString::to_string);
    Ok(contents)
}

impl Contents {
    /// A record that cannot be decoded is left out: then the chain shows a gap.
    fn take(&mut self, channel: &LogChannel, data: &[u8]) {
        match channel.topic.as_str() {
            TOPIC_BOOK => self.entries.extend(BookEntry::decode(data).ok()),
            TOPIC_BOOK_HEAD => self.heads.extend(BookHead::decode(data).ok()),
            TOPIC_RAW_RX
                if channel.metadata.get("endpoint").is_some_and(|endpoint| endpoint == "vehicle") =>
            {
                let mut framer = Framer::new();
                framer.push_datagram(data);
                let message = framer.next_frame().and_then(|frame| frame.decode().ok());
                if let Some(MavMessage::TD_BOOK_HEAD(head)) = message {
                    let from = format!("the vehicle's log {}", self.name);
                    self.told_to_vehicle.push(Known { from, signed: SignedHead::of_message(&head) });
                }
            }
            _ => {}
        }
    }
}
