//! Proves the books of ground stations, or names the first broken link of each.
//!
//! A log of a station holds its book. A log of the vehicle holds the ends of books that stations sent: whoever changes a
//! station's log cannot change those.

use std::io::{self, BufReader, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use prost::Message as _;
use protocol::book::{Audit, Known, PublicKey, SignedHead, audit, shown as shown_hash};
use protocol::dialect::MavMessage;
use protocol::frame::Framer;
use protocol::log::reader::{Damage, LogChannel, LogItem, LogReader};
use protocol::log::record::{TOPIC_BOOK, TOPIC_BOOK_HEAD, TOPIC_RAW_RX};
use protocol::log::v1::{BookEntry, BookHead};
use serde::Serialize;

use crate::cli::{Outcome, answer};
use crate::log::open_regular;
use crate::print::{print_json, shown};

/// A head as a station shows it at the end: the number of entries, and the beginning of the hash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShownHead {
    pub entries: u32,
    /// Groups of four hexadecimal digits.
    pub hash: String,
}

impl std::str::FromStr for ShownHead {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no head; give it as the station showed it, as in 57:ab12-cd34-...");
        let (entries, hash) = text.split_once(':').ok_or_else(wrong)?;
        let entries = entries.parse().map_err(|_not_a_number| wrong())?;
        let digits = hash.chars().filter(char::is_ascii_hexdigit).count();
        let plain = hash.chars().all(|letter| letter.is_ascii_hexdigit() || letter == '-');
        if digits < 8 || !plain {
            return Err(wrong());
        }
        Ok(Self { entries, hash: hash.to_lowercase() })
    }
}

/// What an auditor holds against the books.
#[derive(Debug, Clone, Default)]
pub struct Trusted {
    /// The station's public key.
    pub key: Option<PublicKey>,
    /// The head that a station showed.
    pub head: Option<ShownHead>,
}

/// The result for one book.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BookFound {
    /// The log that holds it.
    pub log: String,
    pub entries: u32,
    /// The number of entries and the beginning of the head, as the station shows it.
    pub head: String,
    /// The key that signed it.
    pub public_key: Option<String>,
    /// Whether the key is the given one.
    pub key_is_trusted: bool,
    /// Whether it ends with its last entry.
    pub closed: bool,
    /// How many entries a signed head of the log covers.
    pub signed: u32,
    /// How many entries a vehicle's log covers.
    pub witnessed: u32,
    /// Whether the head that the station showed is its end.
    pub shown_head_fits: Option<bool>,
    /// What is broken, the first link first; empty if it is whole.
    pub broken: Vec<String>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
}

impl BookFound {
    /// Whether no link is broken and its end is vouched for: by a closing entry under a signature, by a vehicle, or by
    /// the shown head.
    pub fn is_proven(&self) -> bool {
        let whole = self.broken.is_empty() && self.shown_head_fits != Some(false);
        let to_its_end = (self.closed && self.signed == self.entries)
            || self.witnessed == self.entries
            || self.shown_head_fits == Some(true);
        whole && to_its_end
    }
}

/// The result for all logs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct AuditFound {
    pub books: Vec<BookFound>,
    /// Books that a vehicle knows of and that are not among the logs.
    pub missing: Vec<String>,
}

impl AuditFound {
    pub fn is_proven(&self) -> bool {
        !self.books.is_empty() && self.missing.is_empty() && self.books.iter().all(BookFound::is_proven)
    }
}

/// Audits every book in these logs against what all of them know.
///
/// # Errors
/// A log cannot be read.
pub fn audit_logs(paths: &[impl AsRef<Path>], trusted: &Trusted) -> Result<AuditFound, ReadError> {
    let logs = paths.iter().map(|path| read(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    Ok(audit_contents(&logs, trusted))
}

/// Audits logs that were read.
pub fn audit_contents(logs: &[Contents], trusted: &Trusted) -> AuditFound {
    let told: Vec<&Known> = logs.iter().flat_map(|log| &log.told_to_vehicle).collect();
    let mut books = Vec::new();
    let mut present = Vec::new();
    for log in logs.iter().filter(|log| !log.entries.is_empty() || !log.heads.is_empty()) {
        // The name of a book is in its heads, too: its first entry may have been changed.
        let names = book_names(log);
        let of_it = told.iter().filter(|known| names.contains(&known.signed.head.book));
        let known: Vec<Known> = of_it.map(|known| (*known).clone()).collect();
        books.push(found(log, &audit(&log.entries, &log.heads, &known, trusted.key), trusted));
        present.extend(names);
    }
    let mut missing: Vec<String> = Vec::new();
    for known in told.iter().filter(|known| !present.contains(&known.signed.head.book)) {
        let name = format!("book {:016x}, of which {} knows", known.signed.head.book, known.from);
        if !missing.contains(&name) {
            missing.push(name);
        }
    }
    AuditFound { books, missing }
}

/// Every name under which a log's book may be known.
fn book_names(log: &Contents) -> Vec<u64> {
    let first = log.entries.first().and_then(|entry| entry.hash.first_chunk::<8>());
    let mut names: Vec<u64> = first.map(|bytes| u64::from_le_bytes(*bytes)).into_iter().collect();
    names.extend(log.heads.iter().map(|head| head.book));
    names.sort_unstable();
    names.dedup();
    names
}

fn found(log: &Contents, audit: &Audit, trusted: &Trusted) -> BookFound {
    let head =
        audit.head.map_or_else(String::new, |head| format!("{}:{}", head.entries, shown_hash(&head.hash)));
    let shown_head_fits = trusted.head.as_ref().map(|wanted| {
        audit.head.is_some_and(|head| {
            head.entries == wanted.entries && shown_hash(&head.hash).starts_with(&wanted.hash)
        })
    });
    let mut broken: Vec<String> = audit.broken.iter().map(ToString::to_string).collect();
    if shown_head_fits == Some(false) {
        broken.push("its end is not the head that the station showed".to_owned());
    }
    BookFound {
        log: log.name.clone(),
        entries: audit.entries,
        head,
        public_key: audit.key.map(|key| key.to_string()),
        key_is_trusted: trusted.key.is_some() && trusted.key == audit.key,
        closed: audit.proof.closed,
        signed: audit.proof.signed,
        witnessed: audit.proof.witnessed,
        shown_head_fits,
        broken,
        damage: log.damage.clone(),
    }
}

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
    let mut reader = LogReader::new(BufReader::new(open_regular(path).map_err(failed)?));
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

/// Writes what is proven of each book, or what is broken.
///
/// # Errors
/// The output failed.
pub fn print_audit(found: &AuditFound, output: &mut impl Write) -> io::Result<()> {
    for book in &found.books {
        print_book(book, output)?;
    }
    for missing in &found.missing {
        writeln!(
            output,
            "MISSING: {}: its log is not among these, or its first entry was changed",
            shown(missing)
        )?;
    }
    if found.books.is_empty() {
        writeln!(output, "no book in these logs: only a ground station of this version writes one")?;
    }
    Ok(())
}

fn print_book(book: &BookFound, output: &mut impl Write) -> io::Result<()> {
    let verdict = if book.is_proven() {
        "PROVEN"
    } else if book.broken.is_empty() {
        "NOT PROVEN TO ITS END"
    } else {
        "BROKEN"
    };
    writeln!(output, "{}: {verdict}: {} entries, head {}", shown(&book.log), book.entries, book.head)?;
    for broken in &book.broken {
        writeln!(output, "  BROKEN: {}", shown(broken))?;
    }
    match &book.public_key {
        Some(key) if book.key_is_trusted => writeln!(output, "  signed with the given key {key}")?,
        Some(key) => writeln!(output, "  signed with {key}; --public-key says that it is the station's")?,
        None => writeln!(output, "  not signed: the station had no key")?,
    }
    writeln!(
        output,
        "  {} entries under a signature, {} known to a vehicle, {}",
        book.signed,
        book.witnessed,
        if book.closed {
            "closed by the station"
        } else {
            "not closed: the station was stopped, or the book was cut"
        }
    )?;
    match &book.damage {
        Some(damage) => writeln!(output, "  the log is damaged: {}", shown(damage)),
        None => Ok(()),
    }
}

/// How the books of ground stations are proven.
#[derive(Debug, Args)]
#[group(id = "books")]
pub(super) struct Arguments {
    /// Prove the books of ground stations (who did what when) in logs of stations and of the vehicle: only the vehicle's
    /// log or --head shows that a book was cut.
    #[arg(long, conflicts_with_all = ["junit", "strict", "explain", "baseline"])]
    pub(super) book: bool,
    /// The station's public key, 64 hexadecimal digits, as the first entry of its book and the answer show it.
    #[arg(long, requires = "book", value_name = "HEX", value_parser = public_key)]
    public_key: Option<PublicKey>,
    /// The head that the station showed at its end, as in 57:ab12-cd34.
    #[arg(long, requires = "book", value_name = "ENTRIES:HASH")]
    head: Option<ShownHead>,
}

fn public_key(text: &str) -> Result<PublicKey, String> {
    PublicKey::from_hex(text).ok_or_else(|| "give 64 hexadecimal digits of an Ed25519 key".to_owned())
}

impl Arguments {
    pub(super) fn run(self, files: &[PathBuf], json: bool) -> Result<Outcome> {
        let trusted = Trusted { key: self.public_key, head: self.head };
        let found = audit_logs(files, &trusted)?;
        answer(|output| if json { print_json(&found, output) } else { print_audit(&found, output) })?;
        Ok(if found.books.is_empty() { Outcome::NotAll } else { Outcome::Decided { yes: found.is_proven() } })
    }
}
