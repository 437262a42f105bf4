//! The book of a station: who did what when, as a chain of hashes whose head is signed.
//!
//! Every entry holds the hash of the entry before it, so a later change of an entry breaks the chain there. Whoever
//! changes an entry and computes all later hashes anew gets another head, which they cannot sign. The vehicle keeps the
//! signed heads it was sent, so a book that was cut is shorter than what the vehicle knows of it.
//!
//! The way of an entry: the ground's `update` enters a line for a key, a command, an answer, a signature of the checklist or a
//! word of the vehicle. Its `app` adds the time of day; here it is numbered and hashed, and it goes to `/book` of the station's
//! log. At most every 2 s the head is signed, recorded (`/book/head`) and sent to the vehicle until the vehicle confirms it. The
//! frame is in the vehicle's log before the confirmation leaves. `replay verify --book` compares all of them ([`audit`]).

use std::fmt;

use ed25519_dalek::{Signature, Signer as _, SigningKey, VerifyingKey};
use sha2::{Digest as _, Sha256};

use crate::dialect::TD_BOOK_HEAD_DATA;
use crate::identity::Address;
use crate::log::v1;
use crate::signing::Key;

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

// The key that signs a book's head: Ed25519, so that who checks a book needs no secret.

/// The seed of the signing key is the hash of this and the station's secret: the secret itself signs frames only.
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
    /// The key that belongs to a station's secret key. Vehicle and station share that secret, so both could sign.
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

// Checks a book against itself, its signed heads, and the heads that others know.

/// A head that the auditor has from somewhere else.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Known {
    /// As in `the vehicle's log flight.mcap`.
    pub from: String,
    pub signed: SignedHead,
}

/// Why a book is not what was written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Broken {
    #[error("entry {number} is missing: the next one in the log is entry {found}")]
    Missing { number: u32, found: u32 },
    #[error("entry {number} was changed: its hash does not fit its text")]
    Changed { number: u32 },
    #[error("entry {number} does not follow entry {}: an entry before it was changed or exchanged", number - 1)]
    NotLinked { number: u32 },
    #[error("entry {number} is no entry: a hash has the wrong length")]
    NoHash { number: u32 },
    #[error("the book does not begin with its first entry")]
    NoBeginning,
    #[error("{from} has another hash for the first {entries} entries: an entry up to {} was changed", entries - 1)]
    OtherHistory { from: String, entries: u32 },
    #[error("the book was cut: it has {entries} entries, and {from} knows of {known}")]
    Cut { entries: u32, from: String, known: u32 },
    #[error("the head of {entries} entries in {from} is not signed with the key of the book")]
    BadSignature { from: String, entries: u32 },
    #[error("the book is signed with another key than the given one: {found}")]
    OtherKey { found: String },
}

/// What is proven of a book whose links all hold.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Proof {
    /// The entries that a signed head of the station covers: only the key's owner can have written them.
    pub signed: u32,
    /// The entries that somebody else knows the head of: they cannot have been changed or cut since.
    pub witnessed: u32,
    /// Whether the last entry says that the book was closed.
    pub closed: bool,
}

/// The result for one book.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Audit {
    /// The name of the book.
    pub book: u64,
    pub entries: u32,
    pub head: Option<Head>,
    /// The key named in the first entry's text, that has signed the heads.
    pub key: Option<PublicKey>,
    /// The first of each kind of broken link, the earliest first; empty if the book is whole.
    pub broken: Vec<Broken>,
    pub proof: Proof,
}

/// Checks the entries of one book, in the order of the log, its own signed heads, and the heads that others know.
/// `pinned` is the key that the auditor trusts; without it the key in the log is taken.
pub fn audit(
    entries: &[v1::BookEntry],
    own: &[v1::BookHead],
    known: &[Known],
    pinned: Option<PublicKey>,
) -> Audit {
    let mut found = Audit::default();
    let heads = chain(entries, &mut found);
    found.entries = u32::try_from(heads.len()).unwrap_or(u32::MAX);
    found.head = heads.last().copied();
    found.book = found.head.map(|head| head.book).unwrap_or_default();
    found.proof.closed = entries.last().is_some_and(|entry| entry.kind == CLOSED);
    let named = entries.first().and_then(|entry| key_in(&entry.text));
    let in_heads = own.iter().find_map(|head| PublicKey::from_bytes(&head.public_key));
    found.key = named.or(in_heads);
    if let (Some(pinned), Some(key)) = (pinned, found.key)
        && pinned != key
    {
        found.broken.push(Broken::OtherKey { found: key.to_string() });
    }
    let key = pinned.or(found.key);
    for signed in own.iter().filter_map(SignedHead::of_record) {
        let from = "the log itself".to_owned();
        if hold(&heads, &Known { from, signed }, key, &mut found) && key.is_some() {
            found.proof.signed = found.proof.signed.max(signed.head.entries);
        }
    }
    for known in known {
        if hold(&heads, known, key, &mut found) {
            found.proof.witnessed = found.proof.witnessed.max(known.signed.head.entries);
        }
    }
    found
}

/// Follows the chain to its first broken link. Returns the head after each entry.
fn chain(entries: &[v1::BookEntry], found: &mut Audit) -> Vec<Head> {
    let mut heads: Vec<Head> = Vec::new();
    if entries.first().is_none_or(|first| first.number != 0 || first.kind != OPENED) {
        found.broken.push(Broken::NoBeginning);
        return heads;
    }
    for (place, entry) in entries.iter().enumerate() {
        let number = u32::try_from(place).unwrap_or(u32::MAX);
        if entry.number != number {
            found.broken.push(Broken::Missing { number, found: entry.number });
            return heads;
        }
        let stored: Result<Hash, _> = entry.hash.as_slice().try_into();
        let previous: Result<Hash, _> = entry.previous.as_slice().try_into();
        let (Ok(stored), Ok(previous)) = (stored, previous) else {
            found.broken.push(Broken::NoHash { number });
            return heads;
        };
        if previous != heads.last().map_or([0; HASH_LEN], |head| head.hash) {
            found.broken.push(Broken::NotLinked { number });
            return heads;
        }
        let line = Line { unix_ns: entry.unix_ns, kind: &entry.kind, who: &entry.who, text: &entry.text };
        if hash(&previous, number, &line) != stored {
            found.broken.push(Broken::Changed { number });
            return heads;
        }
        let book = heads.first().map_or_else(|| name(&stored), |head| head.book);
        heads.push(Head { book, entries: number.saturating_add(1), hash: stored });
    }
    heads
}

/// Whether a known head fits the chain and is signed with the book's key, if it has one.
fn hold(heads: &[Head], known: &Known, key: Option<PublicKey>, found: &mut Audit) -> bool {
    let Head { entries, hash, .. } = known.signed.head;
    let from = known.from.clone();
    if key.is_some_and(|key| !key.signed(&known.signed)) {
        return report(found, Broken::BadSignature { from, entries });
    }
    let place = usize::try_from(entries).unwrap_or(usize::MAX).checked_sub(1);
    match place.and_then(|place| heads.get(place)) {
        Some(head) if head.hash == hash => true,
        Some(_) => report(found, Broken::OtherHistory { from, entries }),
        // What comes after a broken link cannot be compared.
        None if entries == 0 || !found.broken.is_empty() => false,
        None => {
            let entries_here = u32::try_from(heads.len()).unwrap_or(u32::MAX);
            report(found, Broken::Cut { entries: entries_here, from, known: entries })
        }
    }
}

/// Adds a broken link, unless one of its kind is known. Returns false.
fn report(found: &mut Audit, broken: Broken) -> bool {
    let kind = std::mem::discriminant(&broken);
    if !found.broken.iter().any(|other| std::mem::discriminant(other) == kind) {
        found.broken.push(broken);
    }
    false
}

/// The key in the text of the first entry.
fn key_in(text: &str) -> Option<PublicKey> {
    text.split_whitespace().find_map(PublicKey::from_hex)
}
