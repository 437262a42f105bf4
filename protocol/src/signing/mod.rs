//! Signs MAVLink 2 frames and checks signatures, without clocks and files.
//!
//! A signature is the first six bytes of SHA-256 over key, frame, link id and timestamp. Timestamps count 10 us units
//! since 2015-01-01 UTC. For each system, component and link they only grow, so a recorded frame cannot be replayed.
//! <https://mavlink.io/en/guide/message_signing.html>
//!
//! Keys are copied as files, never sent by radio: SETUP_SIGNING is ignored.

mod lockout;
mod memory;
mod timestamp;

use alloc::collections::BTreeMap;
use alloc::string::String;
use core::fmt;

use sha2::{Digest as _, Sha256};

use crate::frame::{Frame, SIGNATURE_LEN};

use memory::{LEAD, MAX_STREAMS};
use timestamp::{MAX_STAMP, STAMPS_PER_S};

pub use lockout::Lockouts;
pub use memory::{Memory, MemoryError};
pub use timestamp::{Anchor, stamp_of};

/// A new stream may begin at most this far behind our own time: one minute.
const NEW_STREAM_LAG: u64 = 60 * STAMPS_PER_S;
/// A frame may be at most this far ahead of a clock that is known to be set: one day. A clock set to another time
/// zone is off by less, and must not separate vehicle and ground at the pad. A station with a wrong year must not
/// lock out all others for ever.
const MAX_AHEAD: u64 = 24 * 3600 * STAMPS_PER_S;
/// 2026-01-01 00:00 UTC, 4,018 days after 2015-01-01. This program is newer, so a clock that shows an earlier time
/// was never set.
const PROGRAM_WRITTEN: u64 = 4_018 * 24 * 3600 * STAMPS_PER_S;
/// RADIO_STATUS, a radio's report about itself; it is the only message that is accepted unsigned.
const RADIO_STATUS_ID: u32 = 109;

/// A secret signing key.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; Key::LEN]);

impl Key {
    /// Length, bytes.
    pub const LEN: usize = 32;

    pub fn new(bytes: [u8; Self::LEN]) -> Self {
        Self(bytes)
    }

    /// Derives the key from a passphrase as MAVProxy does: the key is the passphrase's SHA-256.
    pub fn from_passphrase(passphrase: &str) -> Self {
        Self(Sha256::digest(passphrase).into())
    }

    /// Parses a key of 64 hexadecimal digits; returns `None` for anything else.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.as_bytes();
        if digits.len() != 2 * Self::LEN {
            return None;
        }
        let mut key = [0; Self::LEN];
        for (byte, pair) in key.iter_mut().zip(digits.chunks_exact(2)) {
            let [high, low] = [pair[0], pair[1]].map(|digit| char::from(digit).to_digit(16));
            *byte = (high? << 4 | low?) as u8;
        }
        Some(Self(key))
    }

    /// Returns the key as 64 hexadecimal digits. They belong into the key file and nowhere else.
    pub fn to_hex(&self) -> String {
        self.0
            .iter()
            .flat_map(|byte| [byte >> 4, byte & 0xF])
            .filter_map(|digit| char::from_digit(u32::from(digit), 16))
            .collect()
    }

    /// The bytes of the key.
    #[cfg(feature = "std")]
    pub(crate) fn secret(&self) -> &[u8; Self::LEN] {
        &self.0
    }

    fn hash(&self, signed: &[u8]) -> [u8; 6] {
        let digest = Sha256::new().chain_update(self.0).chain_update(signed).finalize();
        let mut hash = [0; 6];
        hash.copy_from_slice(&digest[..6]);
        hash
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(secret)")
    }
}

/// Why a frame is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Rejection {
    /// It is not signed.
    #[error("unsigned")]
    Unsigned,
    /// It was signed with another key.
    #[error("wrongly signed")]
    Wrong,
    /// Its timestamp is not newer than the last one of its stream.
    #[error("replayed")]
    Replayed,
    /// It begins a stream with a timestamp that is more than a minute behind.
    #[error("too old")]
    TooOld,
    /// Its timestamp is more than a day ahead of our clock, and our clock is known to be set.
    #[error("too new")]
    TooNew,
}

/// How many frames were accepted and rejected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct SigningCounters {
    /// Frames with a good signature.
    pub accepted: u64,
    /// Unsigned frames.
    pub unsigned: u64,
    /// Frames signed with another key.
    pub wrong: u64,
    /// Frames that were heard before.
    pub replayed: u64,
    /// Frames that began a stream with a timestamp too far behind.
    pub too_old: u64,
    /// Frames with a timestamp too far ahead.
    pub too_new: u64,
}

impl SigningCounters {
    /// Returns how many frames were rejected.
    pub fn rejected(&self) -> u64 {
        self.unsigned + self.wrong + self.replayed + self.too_old + self.too_new
    }

    fn count(&mut self, outcome: Result<(), Rejection>) {
        *match outcome {
            Ok(()) => &mut self.accepted,
            Err(Rejection::Unsigned) => &mut self.unsigned,
            Err(Rejection::Wrong) => &mut self.wrong,
            Err(Rejection::Replayed) => &mut self.replayed,
            Err(Rejection::TooOld) => &mut self.too_old,
            Err(Rejection::TooNew) => &mut self.too_new,
        } += 1;
    }
}

/// Operators have keys with these numbers; 0 is the key that vehicle and stations share.
pub const OPERATORS: core::ops::RangeInclusive<u8> = 1..=15;
/// The bits of a signature's link id that select the key; the others are the number of the link.
const KEY_BITS: u32 = 4;

/// The number of the key that a signature with this link id names.
pub(crate) fn key_number(link_id: u8) -> u8 {
    link_id & ((1 << KEY_BITS) - 1)
}

/// Signs frames that are sent and checks frames that arrive.
///
/// Without operators everybody has one key. With operators each of them has a key of their own, and the link id of a
/// signature selects the key to check against; the vehicle itself and whoever only looks on use the shared one.
#[derive(Debug, Clone)]
pub struct Signing {
    /// The key that signs, and its number.
    own: (u8, Key),
    /// The key of frames whose link id names no operator.
    shared: Key,
    /// The operators' keys, by number.
    operators: BTreeMap<u8, Key>,
    memory: Memory,
    /// The latest time that our clock has shown in earlier runs.
    clock_before: u64,
    counters: SigningCounters,
}

impl Signing {
    /// Starts with a key and the timestamps remembered from earlier runs.
    pub fn new(key: Key, memory: Memory) -> Self {
        let clock_before = memory.clock;
        Self {
            own: (0, key.clone()),
            shared: key,
            operators: BTreeMap::new(),
            memory,
            clock_before,
            counters: SigningCounters::default(),
        }
    }

    /// Signs as the operator of this number from now on; what the vehicle sends is checked with the key that all share.
    #[must_use]
    pub fn as_operator(self, number: u8, shared: Key) -> Self {
        Self { own: (key_number(number), self.own.1), shared, ..self }
    }

    /// Checks frames that name an operator with that operator's key. A frame that names an unknown one is refused.
    #[must_use]
    pub fn with_operators(self, operators: BTreeMap<u8, Key>) -> Self {
        Self { operators, ..self }
    }

    /// The link id of frames over a link: its number, and the number of the key. Links beyond the 16th share an id,
    /// which costs nothing but exact statistics.
    pub fn link_id(&self, link: usize) -> u8 {
        (link as u8) << KEY_BITS | self.own.0
    }

    /// The number of the operator whose key checks this frame; 0 for the shared key.
    pub fn operator_of(&self, frame: &Frame) -> u8 {
        let number = frame.key_number();
        if self.operators.is_empty() { 0 } else { number }
    }

    fn key_of(&self, number: u8) -> Option<&Key> {
        if number == 0 || self.operators.is_empty() {
            return Some(&self.shared);
        }
        self.operators.get(&number)
    }

    /// Signs an unsigned frame for one link. `clock` is the time of the system's clock, which may stand still or be
    /// wrong. A frame that is sent again must be signed again, which gives it a newer timestamp.
    #[must_use]
    pub fn sign(&mut self, frame: &Frame, link_id: u8, clock: u64) -> Frame {
        self.memory.ours = clock.max(self.memory.ours + 1).min(MAX_STAMP);
        self.memory.clock = self.memory.clock.max(clock);
        let mut signed = frame.marked_signed();
        let mut signature = [0; SIGNATURE_LEN];
        signature[0] = link_id;
        signature[1..7].copy_from_slice(&self.memory.ours.to_le_bytes()[..6]);
        let hash = self.own.1.hash(&[signed.as_bytes(), &signature[..7]].concat());
        signature[7..].copy_from_slice(&hash);
        signed.push_signature(&signature);
        signed
    }

    /// Checks a frame and counts the result.
    ///
    /// # Errors
    /// The frame must not be acted on; the error says why.
    pub fn check(&mut self, frame: &Frame, clock: u64) -> Result<(), Rejection> {
        if frame.message_id() == RADIO_STATUS_ID && !frame.is_signed() {
            return Ok(());
        }
        let outcome = self.judge(frame, clock);
        self.counters.count(outcome);
        outcome
    }

    fn judge(&mut self, frame: &Frame, clock: u64) -> Result<(), Rejection> {
        let signature = frame.signature().ok_or(Rejection::Unsigned)?;
        let bytes = frame.as_bytes();
        let operator = self.operator_of(frame);
        let right = |key: &Key| key.hash(&bytes[..bytes.len() - 6]) == signature[7..];
        if !self.key_of(operator).is_some_and(right) {
            return Err(Rejection::Wrong);
        }
        let stamp = frame.stamp().ok_or(Rejection::Unsigned)?;
        let stream = (frame.source(), signature[0]);
        self.memory.clock = self.memory.clock.max(clock);
        // A clock that is known to be set shows the right time. Otherwise the latest timestamp that was heard is
        // taken for the time.
        let is_set = self.is_set(clock);
        if is_set && stamp > clock + MAX_AHEAD {
            return Err(Rejection::TooNew);
        }
        let time = if is_set { clock } else { self.memory.ours.max(clock) };
        match self.memory.streams.get(&stream) {
            Some(last) if stamp <= *last => return Err(Rejection::Replayed),
            None if stamp + NEW_STREAM_LAG < time || self.streams_of(operator) >= MAX_STREAMS => {
                return Err(Rejection::TooOld);
            }
            _ => {}
        }
        self.memory.streams.insert(stream, stamp);
        // What we sign must be newer than everything we have heard.
        self.memory.ours = self.memory.ours.max(stamp);
        Ok(())
    }

    /// How many streams a key has. One key's holder cannot use up the streams of another.
    fn streams_of(&self, operator: u8) -> usize {
        if self.operators.is_empty() {
            return self.memory.streams.len();
        }
        self.memory.streams.keys().filter(|(_, link_id)| key_number(*link_id) == operator).count()
    }

    /// Returns whether our clock is known to be set: it shows a time after this program was written, and it has not
    /// gone back since earlier runs. A board whose clock stops without power fails one of the two.
    fn is_set(&self, clock: u64) -> bool {
        clock >= PROGRAM_WRITTEN.max(self.clock_before)
    }

    /// Returns how many frames were accepted and rejected.
    pub fn counters(&self) -> SigningCounters {
        self.counters
    }

    /// Returns the timestamps to be stored. Store them before acting on an accepted frame, so that it is not accepted
    /// twice, and at least once a second, so that no own timestamp is used twice.
    pub fn memory(&self) -> Memory {
        let ours = (self.memory.ours + LEAD).min(MAX_STAMP);
        Memory { ours, ..self.memory.clone() }
    }
}
