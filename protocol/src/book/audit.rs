//! Checks a book against itself, its signed heads, and the heads that others know.

use super::{CLOSED, HASH_LEN, Hash, Head, Line, OPENED, PublicKey, SignedHead, hash, name};
use crate::log::v1;

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
