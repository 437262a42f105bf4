//! Proves the books of ground stations, or names the first broken link of each.
//!
//! A log of a station holds its book. A log of the vehicle holds the ends of books that stations sent: whoever changes a
//! station's log cannot change those.

mod read;

use std::path::Path;

use protocol::book::{Audit, Known, PublicKey, audit, shown};
use serde::Serialize;

pub use read::{Contents, ReadError, read};

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
    let head = audit.head.map_or_else(String::new, |head| format!("{}:{}", head.entries, shown(&head.hash)));
    let shown_head_fits = trusted.head.as_ref().map(|wanted| {
        audit
            .head
            .is_some_and(|head| head.entries == wanted.entries && shown(&head.hash).starts_with(&wanted.hash))
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
