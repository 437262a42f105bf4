//! Prints the books of ground stations, and proves them or names the broken link.
//!
//! A log of a station holds its book. A log of the vehicle holds the ends of books that stations
//! sent: whoever changes a station's log cannot change those.

use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use prost::Message as _;
use protocol::book::{Audit, PublicKey, RecordedHead, SignedHead, audit, shown as shown_hash};
use protocol::dialect::MavMessage;
use protocol::log::reader::{LogChannel, LogItem, LogReader};
use protocol::log::record::{TOPIC_BOOK, TOPIC_BOOK_HEAD};
use protocol::log::v1::{BookEntry, BookHead};
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, give};
use crate::log::{LogError, frame_of, is_received, open_regular, take_magic};

/// The result for one book.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BookFound {
    /// The log that holds it.
    pub log: String,
    pub entries: u32,
    /// The number of entries and the beginning of the hash, as the station shows it.
    pub head: String,
    /// The key that signed it.
    pub public_key: Option<String>,
    /// Whether the key is the given one.
    pub key_is_trusted: bool,
    /// Whether it ends with its last entry.
    pub closed: bool,
    /// How many entries a signature in the log covers.
    pub signed: u32,
    /// How many entries a vehicle's log covers.
    pub witnessed: u32,
    /// The broken link; `None` if the book is intact.
    pub broken: Option<String>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// A line for each entry: when, what, who.
    pub story: Vec<String>,
}

impl BookFound {
    /// Whether nothing is broken and its end is vouched for: by a closing entry under a signature,
    /// or by a vehicle.
    pub fn is_proven(&self) -> bool {
        let to_its_end = (self.closed && self.signed == self.entries) || self.witnessed == self.entries;
        self.broken.is_none() && to_its_end
    }
}

/// The result for all logs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct AuditFound {
    pub books: Vec<BookFound>,
    /// Books of which a vehicle has a hash and that are not among the logs.
    pub missing: Vec<String>,
}

impl AuditFound {
    pub fn is_proven(&self) -> bool {
        !self.books.is_empty() && self.missing.is_empty() && self.books.iter().all(BookFound::is_proven)
    }
}

/// Audits every book in these logs against the signed hashes in all of them. `trusted` is the
/// station's public key.
///
/// # Errors
/// A log cannot be read.
pub fn audit_logs(paths: &[impl AsRef<Path>], trusted: Option<PublicKey>) -> Result<AuditFound, LogError> {
    let logs = paths.iter().map(|path| read(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    let by_vehicle: Vec<&RecordedHead> =
        logs.iter().flat_map(|log| &log.heads).filter(|head| head.by_vehicle).collect();
    let mut books = Vec::new();
    let mut present = Vec::new();
    for log in logs.iter().filter(|log| log.has_book()) {
        let own: Vec<&RecordedHead> = log.heads.iter().filter(|head| !head.by_vehicle).collect();
        // The name of a book is in its heads, too: its first entry may have been changed.
        let names: Vec<u64> = own.iter().map(|head| head.signed.head.book).collect();
        let of_it = by_vehicle.iter().filter(|head| names.contains(&head.signed.head.book));
        let heads: Vec<RecordedHead> = own.iter().chain(of_it).map(|head| (*head).clone()).collect();
        books.push(found(log, &audit(&log.entries, &heads, trusted), trusted));
        present.extend(names);
    }
    let mut missing: Vec<String> = Vec::new();
    for head in by_vehicle.iter().filter(|head| !present.contains(&head.signed.head.book)) {
        let name = format!("book {:016x}, of which {} has a hash", head.signed.head.book, head.from);
        if !missing.contains(&name) {
            missing.push(name);
        }
    }
    Ok(AuditFound { books, missing })
}

fn found(log: &Contents, audit: &Audit, trusted: Option<PublicKey>) -> BookFound {
    let head =
        audit.head.map_or_else(String::new, |head| format!("{}:{}", head.entries, shown_hash(&head.hash)));
    BookFound {
        log: log.name.clone(),
        entries: audit.head.map_or(0, |head| head.entries),
        head,
        public_key: audit.key.map(|key| key.to_string()),
        key_is_trusted: trusted.is_some() && trusted == audit.key,
        closed: audit.closed,
        signed: audit.signed,
        witnessed: audit.witnessed,
        broken: audit.broken.as_ref().map(ToString::to_string),
        damage: log.damage.clone(),
        story: log.entries.iter().map(sentence).collect(),
    }
}

/// As in `12:03:07 commanded: ARM commanded, attempt 1 (Ann)`; times are UTC.
fn sentence(entry: &BookEntry) -> String {
    let second = entry.unix_ns / 1_000_000_000;
    let (hour, minute, second) = (second / 3600 % 24, second / 60 % 60, second % 60);
    let who = if entry.who.is_empty() { String::new() } else { format!(" ({})", entry.who) };
    format!("{hour:02}:{minute:02}:{second:02} {}: {}{who}", entry.kind, entry.text)
}

/// What one log holds of books.
#[derive(Debug, Clone, Default)]
struct Contents {
    name: String,
    /// The entries of the station's book, in the order of the file.
    entries: Vec<BookEntry>,
    /// The signed hashes of the station's own book, and those that the vehicle received.
    heads: Vec<RecordedHead>,
    damage: Option<String>,
}

/// Reads a log to its end, or to its first damage.
///
/// # Errors
/// The file cannot be read, or is no log.
fn read(path: &Path) -> Result<Contents, LogError> {
    let name = path.display().to_string();
    let failed = |source| LogError::Read { name: name.clone(), source };
    let mut log = BufReader::new(open_regular(path).map_err(failed)?);
    take_magic(&name, &mut log)?;
    let mut reader = LogReader::new(mcap::MAGIC.chain(log));
    let mut contents = Contents { name: name.clone(), ..Contents::default() };
    while let Some(item) = reader.next_item().map_err(failed)? {
        if let LogItem::Message { channel_id, data, .. } = item
            && let Some(channel) = reader.channel(channel_id)
        {
            contents.take(channel, &data);
        }
    }
    contents.damage = reader.damage().map(ToString::to_string);
    Ok(contents)
}

impl Contents {
    fn has_book(&self) -> bool {
        !self.entries.is_empty() || self.heads.iter().any(|head| !head.by_vehicle)
    }

    /// A record that cannot be decoded is left out: then an entry is missing.
    fn take(&mut self, channel: &LogChannel, data: &[u8]) {
        match channel.topic.as_str() {
            TOPIC_BOOK => self.entries.extend(BookEntry::decode(data).ok()),
            TOPIC_BOOK_HEAD => {
                let signed = BookHead::decode(data).ok().and_then(|record| SignedHead::of_record(&record));
                let from = "the log itself".to_owned();
                self.heads.extend(signed.map(|signed| RecordedHead { from, by_vehicle: false, signed }));
            }
            _ if is_received(channel, "vehicle") => {
                let message = frame_of(data).and_then(|frame| frame.decode().ok());
                if let Some(MavMessage::TD_BOOK_HEAD(head)) = message {
                    let from = format!("the vehicle's log {}", self.name);
                    let signed = SignedHead::of_message(&head);
                    self.heads.push(RecordedHead { from, by_vehicle: true, signed });
                }
            }
            _ => {}
        }
    }
}

impl Answer for AuditFound {
    fn sentences(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.books.iter().flat_map(BookFound::sentences).collect();
        lines.extend(self.missing.iter().map(|missing| {
            format!("MISSING: {missing}: its log is not among these, or its first entry was changed")
        }));
        if self.books.is_empty() {
            lines.push("no book in these logs: only a ground station writes one".to_owned());
        }
        lines
    }

    fn outcome(&self) -> Exit {
        if self.books.is_empty() { Exit::NotSeen } else { Exit::of(self.is_proven()) }
    }
}

impl BookFound {
    fn sentences(&self) -> Vec<String> {
        let verdict = match &self.broken {
            _ if self.is_proven() => "PROVEN",
            None => "NOT PROVEN TO ITS END",
            Some(_) => "BROKEN",
        };
        let mut lines = self.story.clone();
        lines.push(format!("{}: {verdict}: {} entries, head {}", self.log, self.entries, self.head));
        lines.extend(self.broken.as_ref().map(|broken| format!("  BROKEN: {broken}")));
        lines.push(match &self.public_key {
            Some(key) if self.key_is_trusted => format!("  signed with the given key {key}"),
            Some(key) => format!("  signed with {key}; --public-key says that it is the station's"),
            None => {
                "  not signed: the station had no key, and only a key proves the end of a book".to_owned()
            }
        });
        let closed = if self.closed {
            "closed by the station"
        } else {
            "not closed: the station was stopped, or the book was cut"
        };
        let (signed, witnessed) = (self.signed, self.witnessed);
        lines.push(format!(
            "  {signed} entries under a signature, {witnessed} confirmed by a vehicle, {closed}"
        ));
        lines.extend(self.damage.as_ref().map(|damage| format!("  the log is damaged: {damage}")));
        lines
    }
}

/// How the books of ground stations are proven.
#[derive(Debug, Args)]
#[group(id = "books")]
pub(super) struct Arguments {
    /// Print and prove the books of ground stations (who did what when) in logs of stations and of
    /// the vehicle: only the vehicle's log shows that a book was cut.
    #[arg(long, conflicts_with_all = ["strict", "explain"])]
    pub(super) book: bool,
    /// The station's public key, 64 hexadecimal digits, as the first entry of its book and the
    /// answer show it.
    #[arg(long, requires = "book", value_name = "HEX", value_parser = public_key)]
    public_key: Option<PublicKey>,
}

fn public_key(text: &str) -> Result<PublicKey, String> {
    PublicKey::from_hex(text).ok_or_else(|| "give 64 hexadecimal digits of an Ed25519 key".to_owned())
}

impl Arguments {
    pub(super) fn run(self, files: &[PathBuf], json: bool) -> Result<Exit> {
        give(&audit_logs(files, self.public_key)?, json)
    }
}
