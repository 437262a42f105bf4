//! The book of a station: a record of crew actions with operator and time, and a signed hash over
//! all entries.
//!
//! A changed entry gives another hash, which cannot be signed without the key. The vehicle stores
//! the signed hashes that it receives, so a truncated book is shorter than the vehicle's record of
//! it.
//!
//! Path of an entry: the ground's `update` enters a line for a key, a command, an answer, a
//! signature of the checklist or a message of the vehicle. Its `app` adds the time of day; here it
//! is numbered and hashed, and written to `/book` of the station's log. At most every 2 s, and at
//! the close, the hash of all entries is signed, recorded (`/book/head`) and sent to the vehicle
//! until the vehicle confirms it. The frame is in the vehicle's log before the confirmation leaves.
//! `replay verify --book` compares all of them ([`audit`]).

use std::fmt;

use ed25519_dalek::{Signature, Signer as _, SigningKey, VerifyingKey};
use sha2::{Digest as _, Sha256};

use crate::dialect::TD_BOOK_HEAD_DATA;
use crate::identity::Address;
use crate::log::v1;
use crate::signing::Key;
pub use crate::text::shown;

pub type Hash = [u8; 32];

/// The kind of the first entry.
pub const OPENED: &str = "opened";
/// The kind of the last entry of a book that was ended properly.
pub const CLOSED: &str = "closed";

/// An entry.
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

/// The end of a book: how many entries it has, and the hash over all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct Head {
    /// The beginning of the hash over the first entry, which names the book.
    pub book: u64,
    pub entries: u32,
    pub hash: Hash,
}

/// A head and its signature; all zeros without a key, and on an attached screen, which sends none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct SignedHead {
    pub head: Head,
    #[cfg_attr(feature = "transport", serde(skip, default = "no_signature"))]
    pub signature: [u8; 64],
}

#[cfg(feature = "transport")]
fn no_signature() -> [u8; 64] {
    [0; 64]
}

/// A book that is being written. It begins with the first entry.
#[derive(Debug, Clone, Default)]
pub struct Book {
    hasher: Sha256,
    head: Option<Head>,
}

impl Book {
    /// Enters a line at the end.
    pub fn enter(&mut self, line: &Line) -> v1::BookEntry {
        let entry = v1::BookEntry {
            number: self.head.map_or(0, |head| head.entries),
            unix_ns: line.unix_ns,
            kind: line.kind.to_owned(),
            who: line.who.to_owned(),
            text: line.text.to_owned(),
        };
        self.add(&entry);
        entry
    }

    /// The present end; `None` before the first entry.
    pub fn head(&self) -> Option<Head> {
        self.head
    }

    /// Adds the numbers and texts of an entry to the hash; each text with its length before it.
    fn add(&mut self, entry: &v1::BookEntry) -> Head {
        self.hasher.update(entry.number.to_le_bytes());
        self.hasher.update(entry.unix_ns.to_le_bytes());
        for text in [&entry.kind, &entry.who, &entry.text] {
            self.hasher.update((text.len() as u64).to_le_bytes());
            self.hasher.update(text.as_bytes());
        }
        let hash: Hash = self.hasher.clone().finalize().into();
        let name = hash.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let book = self.head.map_or(name, |head| head.book);
        *self.head.insert(Head { book, entries: entry.number.saturating_add(1), hash })
    }
}

impl SignedHead {
    /// The message that sends the head to the vehicle.
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
    pub fn record(&self) -> v1::BookHead {
        v1::BookHead {
            book: self.head.book,
            entries: self.head.entries,
            hash: self.head.hash.to_vec(),
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

// The key that signs a book's head: Ed25519, so that who checks a book needs no secret.

/// The seed of the signing key is the hash of this and the station's secret: the secret itself
/// signs frames only.
const SEED_DOMAIN: &[u8] = b"touchdown book key 1";
const HEAD_DOMAIN: &[u8] = b"touchdown book head 1";

/// Signs heads.
#[derive(Clone)]
pub struct BookKey(SigningKey);

impl fmt::Debug for BookKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("BookKey(secret)")
    }
}

/// Checks signatures of heads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl BookKey {
    /// The key that belongs to a station's secret key. Vehicle and station share that secret, so
    /// both could sign.
    pub fn of(key: &Key) -> Self {
        let seed = Sha256::new().chain_update(SEED_DOMAIN).chain_update(key.secret()).finalize();
        Self(SigningKey::from_bytes(&seed.into()))
    }

    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key())
    }

    pub fn sign(&self, head: Head) -> SignedHead {
        SignedHead { head, signature: self.0.sign(&signed_bytes(&head)).to_bytes() }
    }
}

impl PublicKey {
    /// `None` if these bytes are no key.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        VerifyingKey::from_bytes(bytes.try_into().ok()?).ok().map(Self)
    }

    /// Reads 64 hexadecimal digits; `None` for anything else.
    pub fn from_hex(text: &str) -> Option<Self> {
        Self::from_bytes(Key::from_hex(text)?.secret())
    }

    pub fn bytes(&self) -> &[u8; 32] {
        self.0.as_bytes()
    }

    /// Whether this key signed the head.
    pub fn signed(&self, signed: &SignedHead) -> bool {
        let signature = Signature::from_bytes(&signed.signature);
        self.0.verify_strict(&signed_bytes(&signed.head), &signature).is_ok()
    }
}

/// As 64 hexadecimal digits.
impl fmt::Display for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Key::new(*self.bytes()).to_hex())
    }
}

fn signed_bytes(head: &Head) -> Vec<u8> {
    [HEAD_DOMAIN, &head.book.to_le_bytes(), &head.entries.to_le_bytes(), &head.hash].concat()
}

// Checks a book against the signed heads in its log and in the vehicle's.

/// A signed head that was found in a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedHead {
    /// As in `the vehicle's log flight.mcap`.
    pub from: String,
    pub by_vehicle: bool,
    pub signed: SignedHead,
}

/// Why a book is not authentic.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Broken {
    #[error("the book does not begin with its first entry")]
    NoBeginning,
    #[error("entry {number} is missing: the next one in the log is entry {found}")]
    Missing { number: u32, found: u32 },
    #[error("an entry from {first} to {last} was changed: {from} has another hash")]
    Changed { first: u32, last: u32, from: String },
    #[error("the book was cut: it has {entries} entries, and {from} has a hash of {signed}")]
    Cut { entries: u32, from: String, signed: u32 },
    #[error("the hash of {entries} entries in {from} is not signed with the key of the book")]
    BadSignature { from: String, entries: u32 },
    #[error("the book is signed with another key than the given one: {found}")]
    OtherKey { found: String },
}

/// The result for one book.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Audit {
    pub head: Option<Head>,
    /// The key in the text of the first entry.
    pub key: Option<PublicKey>,
    /// The first fault; `None` if the book is intact.
    pub broken: Option<Broken>,
    /// The entries under a signature in the station's log: only the owner of the key can have
    /// written them.
    pub signed: u32,
    /// The entries whose hash a vehicle has: they cannot have been changed or cut since.
    pub witnessed: u32,
    /// Whether the last entry closes the book.
    pub closed: bool,
}

/// Checks the entries of one book, in the order of the log, against the signed heads of it.
/// `trusted` is the key that the auditor trusts; without it the key in the first entry is taken.
pub fn audit(entries: &[v1::BookEntry], heads: &[RecordedHead], trusted: Option<PublicKey>) -> Audit {
    let mut audit = Audit {
        key: entries.first().and_then(|first| first.text.split_whitespace().find_map(PublicKey::from_hex)),
        closed: entries.last().is_some_and(|entry| entry.kind == CLOSED),
        ..Audit::default()
    };
    audit.broken = check(entries, heads, trusted, &mut audit).err();
    audit
}

fn check(
    entries: &[v1::BookEntry],
    heads: &[RecordedHead],
    trusted: Option<PublicKey>,
    audit: &mut Audit,
) -> Result<(), Broken> {
    let mut book = Book::default();
    let mut ends: Vec<Head> = Vec::new();
    if entries.first().is_none_or(|first| first.number != 0 || first.kind != OPENED) {
        return Err(Broken::NoBeginning);
    }
    for entry in entries {
        let number = ends.len() as u32;
        if entry.number != number {
            return Err(Broken::Missing { number, found: entry.number });
        }
        ends.push(book.add(entry));
    }
    audit.head = book.head();
    if let (Some(trusted), Some(key)) = (trusted, audit.key)
        && trusted != key
    {
        return Err(Broken::OtherKey { found: key.to_string() });
    }
    let key = trusted.or(audit.key);
    let mut heads: Vec<&RecordedHead> = heads.iter().collect();
    heads.sort_by_key(|found| found.signed.head.entries);
    for RecordedHead { from, by_vehicle, signed } in heads {
        let (from, count) = (from.clone(), signed.head.entries);
        if key.is_some_and(|key| !key.signed(signed)) {
            return Err(Broken::BadSignature { from, entries: count });
        }
        let Some(end) = count.checked_sub(1).and_then(|last| ends.get(last as usize)) else {
            return Err(Broken::Cut { entries: ends.len() as u32, from, signed: count });
        };
        if end.hash != signed.head.hash {
            let first = audit.signed.max(audit.witnessed);
            return Err(Broken::Changed { first, last: count - 1, from });
        }
        if *by_vehicle {
            audit.witnessed = count;
        } else if key.is_some() {
            audit.signed = count;
        }
    }
    Ok(())
}
