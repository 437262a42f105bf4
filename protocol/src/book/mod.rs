//! The book of a station: who did what when, as a chain of hashes whose head is signed.
//!
//! Every entry holds the hash of the entry before it, so a later change of an entry breaks the chain there. Whoever
//! changes an entry and computes all later hashes anew gets another head, which they cannot sign. The vehicle keeps the
//! signed heads it was sent, so a book that was cut is shorter than what the vehicle knows of it.

mod audit;
mod key;

use sha2::{Digest as _, Sha256};

use crate::dialect::TD_BOOK_HEAD_DATA;
use crate::identity::Address;
use crate::log::v1;

pub use audit::{Audit, Broken, Known, Proof, audit};
pub use key::{BookKey, PublicKey};

/// Bytes of a hash.
pub const HASH_LEN: usize = 32;
/// What every hash of an entry begins with, so that no hash of something else is one.
const ENTRY_DOMAIN: &[u8] = b"touchdown book entry 1";

pub type Hash = [u8; HASH_LEN];

/// The kind of the first entry.
pub const OPENED: &str = "opened";
/// The kind of the last entry of a book that was ended properly.
pub const CLOSED: &str = "closed";

/// What is entered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line<'a> {
    /// Nanoseconds since 1970, UTC, by the station's clock.
    pub unix_ns: u64,
    /// As in `commanded`, `signed`, `key`.
    pub kind: &'a str,
    /// Who did it; empty for the station or the vehicle itself.
    pub who: &'a str,
    pub text: &'a str,
}

/// The end of a book: how many entries it has, and the hash of the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct Head {
    /// The beginning of the first entry's hash, which names the book.
    pub book: u64,
    pub entries: u32,
    pub hash: Hash,
}

/// A head and its signature; all zeros without a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignedHead {
    pub head: Head,
    pub signature: [u8; 64],
}

/// A book that is being written. It begins with the first entry.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Book {
    head: Option<Head>,
}

impl Book {
    /// Enters a line at the end.
    pub fn enter(&mut self, line: &Line) -> v1::BookEntry {
        let number = self.head.map_or(0, |head| head.entries);
        let previous = self.head.map_or([0; HASH_LEN], |head| head.hash);
        let hash = hash(&previous, number, line);
        let book = self.head.map_or_else(|| name(&hash), |head| head.book);
        self.head = Some(Head { book, entries: number.saturating_add(1), hash });
        v1::BookEntry {
            number,
            unix_ns: line.unix_ns,
            kind: line.kind.to_owned(),
            who: line.who.to_owned(),
            text: line.text.to_owned(),
            previous: previous.to_vec(),
            hash: hash.to_vec(),
        }
    }

    /// The present end; `None` before the first entry.
    pub fn head(&self) -> Option<Head> {
        self.head
    }
}

/// The name of a book whose first entry has this hash.
fn name(first: &Hash) -> u64 {
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&first[..8]);
    u64::from_le_bytes(bytes)
}

/// The hash of an entry: SHA-256 over the hash before, the number, and the line; each text with its length before it.
fn hash(previous: &Hash, number: u32, line: &Line) -> Hash {
    let mut hasher = Sha256::new()
        .chain_update(ENTRY_DOMAIN)
        .chain_update(previous)
        .chain_update(number.to_le_bytes())
        .chain_update(line.unix_ns.to_le_bytes());
    for text in [line.kind, line.who, line.text] {
        hasher.update((text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.finalize().into()
}

/// The beginning of a hash in groups of four digits, to be compared by eye.
pub fn shown(hash: &[u8]) -> String {
    let mut text = String::new();
    for (place, byte) in hash.iter().take(16).enumerate() {
        if place > 0 && place % 2 == 0 {
            text.push('-');
        }
        text.extend(
            [byte >> 4, byte & 0xF].into_iter().filter_map(|digit| char::from_digit(digit.into(), 16)),
        );
    }
    text
}

impl SignedHead {
    /// The message that tells the vehicle.
    pub fn message(&self, vehicle: Address) -> TD_BOOK_HEAD_DATA {
        TD_BOOK_HEAD_DATA {
            book: self.head.book,
            entries: self.head.entries,
            target_system: vehicle.system_id,
            target_component: vehicle.component_id,
            hash: self.head.hash,
            signature: self.signature,
        }
    }

    pub fn of_message(message: &TD_BOOK_HEAD_DATA) -> Self {
        Self {
            head: Head { book: message.book, entries: message.entries, hash: message.hash },
            signature: message.signature,
        }
    }

    /// The record of the station's log.
    pub fn record(&self, public_key: Option<PublicKey>) -> v1::BookHead {
        v1::BookHead {
            book: self.head.book,
            entries: self.head.entries,
            hash: self.head.hash.to_vec(),
            public_key: public_key.map_or_else(Vec::new, |key| key.bytes().to_vec()),
            signature: self.signature.to_vec(),
        }
    }

    /// Reads a record. `None` if a length is wrong.
    pub fn of_record(record: &v1::BookHead) -> Option<Self> {
        let hash = record.hash.as_slice().try_into().ok()?;
        let signature = record.signature.as_slice().try_into().ok()?;
        Some(Self { head: Head { book: record.book, entries: record.entries, hash }, signature })
    }
}
