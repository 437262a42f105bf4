//! MAVLink 2 message signing, without clocks and files: keys, timestamps, and whom to believe.
//!
//! A signature is the first six bytes of SHA-256 over key, frame, link id and timestamp. Timestamps count 10 us since
//! 2015-01-01 UTC and only ever grow, for each system, component and link: what was heard once is never believed
//! again. <https://mavlink.io/en/guide/message_signing.html>
//!
//! Keys travel as files, never by radio: SETUP_SIGNING is not acted on.

mod memory;

use std::fmt;
use std::time::Duration;

use sha2::{Digest as _, Sha256};

use crate::frame::{Frame, SIGNATURE_LEN};

pub use memory::{Memory, MemoryError};

/// 2015-01-01 00:00 UTC after the Unix epoch: 16,436 days.
const EPOCH: Duration = Duration::from_hours(24 * 16_436);
/// A stream that was never heard may begin this far behind our own time: one minute.
const NEW_STREAM_LAG: u64 = 60 * STAMPS_PER_S;
/// A frame may be this far ahead of a clock that is known to be set: one day. A clock set to the time of another zone is
/// less than that off, and must not part vehicle and ground at the pad; the wrong year of one station must not shut
/// out all others for good.
const MAX_AHEAD: u64 = 24 * 3600 * STAMPS_PER_S;
/// 2026-01-01 00:00 UTC, before this program was written: 4,018 days after 2015-01-01. A clock that shows an earlier
/// time was never set.
const PROGRAM_WRITTEN: u64 = 4_018 * 24 * 3600 * STAMPS_PER_S;
/// What is remembered over a restart lies this far ahead, so that no timestamp is used twice.
const LEAD: u64 = 5 * STAMPS_PER_S;
const STAMPS_PER_S: u64 = 100_000;
/// Largest timestamp: it has 48 bits.
const MAX_STAMP: u64 = (1 << 48) - 1;
/// Streams remembered at most. Only holders of the key can begin one.
const MAX_STREAMS: usize = 64;
/// Reports of a radio about itself, the only frames that are taken unsigned.
const RADIO_STATUS_ID: u32 = 109;

/// The timestamp of a time since the Unix epoch.
pub fn stamp_of(since_unix_epoch: Duration) -> u64 {
    let since = since_unix_epoch.saturating_sub(EPOCH);
    u64::try_from(since.as_micros() / 10).unwrap_or(MAX_STAMP).min(MAX_STAMP)
}

/// A secret key.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; Key::LEN]);

impl Key {
    /// Length, bytes.
    pub const LEN: usize = 32;

    /// A key of these bytes.
    pub fn new(bytes: [u8; Self::LEN]) -> Self {
        Self(bytes)
    }

    /// The key of a passphrase: its SHA-256, as MAVProxy makes it.
    pub fn from_passphrase(passphrase: &str) -> Self {
        Self(Sha256::digest(passphrase).into())
    }

    /// The key written as 64 hexadecimal digits; `None` if it is anything else.
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

    /// The key as 64 hexadecimal digits, for its file and nothing else.
    pub fn to_hex(&self) -> String {
        self.0
            .iter()
            .flat_map(|byte| [byte >> 4, byte & 0xF])
            .filter_map(|digit| char::from_digit(u32::from(digit), 16))
            .collect()
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

/// Why a frame is not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Rejection {
    /// It carries no signature.
    #[error("unsigned")]
    Unsigned,
    /// Its signature was not made with our key.
    #[error("wrongly signed")]
    Wrong,
    /// Its timestamp is not newer than its stream's last.
    #[error("replayed")]
    Replayed,
    /// It begins a stream with a timestamp more than a minute behind.
    #[error("too old")]
    TooOld,
    /// Its timestamp is more than a day ahead of our clock, which is known to be set.
    #[error("too new")]
    TooNew,
}

/// What was believed and what was not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SigningCounters {
    /// Frames with a good signature.
    pub accepted: u64,
    /// Frames without a signature.
    pub unsigned: u64,
    /// Frames whose signature was not made with our key.
    pub wrong: u64,
    /// Frames that were heard before.
    pub replayed: u64,
    /// Frames that began a stream too far behind.
    pub too_old: u64,
    /// Frames too far ahead.
    pub too_new: u64,
}

impl SigningCounters {
    /// Everything that was not believed.
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

/// Signs what is sent and judges what is heard.
#[derive(Debug, Clone)]
pub struct Signing {
    key: Key,
    memory: Memory,
    /// Our clock as the runs before saw it last.
    clock_before: u64,
    counters: SigningCounters,
}

impl Signing {
    /// With a key, and what was remembered of the runs before.
    pub fn new(key: Key, memory: Memory) -> Self {
        let clock_before = memory.clock;
        Self { key, memory, clock_before, counters: SigningCounters::default() }
    }

    /// Signs an unsigned frame for a link; `clock` is the time by the system's clock, which may stand still or be
    /// wrong. Signed anew, with a newer timestamp, whenever it is sent.
    #[must_use]
    pub fn sign(&mut self, frame: &Frame, link_id: u8, clock: u64) -> Frame {
        self.memory.ours = clock.max(self.memory.ours + 1).min(MAX_STAMP);
        self.memory.clock = self.memory.clock.max(clock);
        let mut signed = frame.marked_signed();
        let mut signature = [0; SIGNATURE_LEN];
        signature[0] = link_id;
        signature[1..7].copy_from_slice(&self.memory.ours.to_le_bytes()[..6]);
        let hash = self.key.hash(&[signed.as_bytes(), &signature[..7]].concat());
        signature[7..].copy_from_slice(&hash);
        signed.push_signature(&signature);
        signed
    }

    /// Judges a frame, and counts it.
    ///
    /// # Errors
    /// Why it is not to be believed.
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
        if self.key.hash(&bytes[..bytes.len() - 6]) != signature[7..] {
            return Err(Rejection::Wrong);
        }
        let stamp = signature[1..7].iter().rev().fold(0, |stamp, byte| stamp << 8 | u64::from(*byte));
        let stream = (frame.source(), signature[0]);
        self.memory.clock = self.memory.clock.max(clock);
        // A clock that is known to be set is right about the time; else whoever was heard with the latest is.
        let is_set = self.is_set(clock);
        if is_set && stamp > clock + MAX_AHEAD {
            return Err(Rejection::TooNew);
        }
        let time = if is_set { clock } else { self.memory.ours.max(clock) };
        match self.memory.streams.get(&stream) {
            Some(last) if stamp <= *last => return Err(Rejection::Replayed),
            None if stamp + NEW_STREAM_LAG < time || self.memory.streams.len() >= MAX_STREAMS => {
                return Err(Rejection::TooOld);
            }
            _ => {}
        }
        self.memory.streams.insert(stream, stamp);
        // What we sign is to be newer than anything that was heard.
        self.memory.ours = self.memory.ours.max(stamp);
        Ok(())
    }

    /// Whether our clock is known to be set: it shows no time before this program was written, and it has not gone back
    /// since the runs before. A board whose clock does not outlive its power fails one or the other.
    fn is_set(&self, clock: u64) -> bool {
        clock >= PROGRAM_WRITTEN.max(self.clock_before)
    }

    /// What was believed and what was not.
    pub fn counters(&self) -> SigningCounters {
        self.counters
    }

    /// What is to be remembered over a restart: before anything is done that a believed frame asks for, so that it is
    /// not believed twice, and once a second at least, so that no timestamp of ours is used twice.
    pub fn memory(&self) -> Memory {
        let ours = (self.memory.ours + LEAD).min(MAX_STAMP);
        Memory { ours, ..self.memory.clone() }
    }
}
