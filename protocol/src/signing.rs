//! MAVLink 2 message signing, without clocks and files: keys, timestamps, and whom to believe.
//!
//! A signature is the first six bytes of SHA-256 over key, frame, link id and timestamp. Timestamps count 10 us since
//! 2015-01-01 UTC and only ever grow, for each system, component and link: what was heard once is never believed
//! again. <https://mavlink.io/en/guide/message_signing.html>
//!
//! Keys travel as files, never by radio: SETUP_SIGNING is not acted on.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use sha2::{Digest as _, Sha256};

use crate::frame::{Frame, SIGNATURE_LEN};
use crate::identity::Address;

/// 2015-01-01 00:00 UTC after the Unix epoch: 16,436 days.
const EPOCH: Duration = Duration::from_hours(24 * 16_436);
/// A stream that was never heard may begin this far behind our own time: one minute.
const NEW_STREAM_LAG: u64 = 60 * STAMPS_PER_S;
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
}

impl SigningCounters {
    /// Everything that was not believed.
    pub fn rejected(&self) -> u64 {
        self.unsigned + self.wrong + self.replayed + self.too_old
    }

    fn count(&mut self, outcome: Result<(), Rejection>) {
        *match outcome {
            Ok(()) => &mut self.accepted,
            Err(Rejection::Unsigned) => &mut self.unsigned,
            Err(Rejection::Wrong) => &mut self.wrong,
            Err(Rejection::Replayed) => &mut self.replayed,
            Err(Rejection::TooOld) => &mut self.too_old,
        } += 1;
    }
}

/// What must outlive a restart: the last timestamps.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Memory {
    ours: u64,
    streams: BTreeMap<(Address, u8), u64>,
}

impl Memory {
    /// As lines of text.
    pub fn to_text(&self) -> String {
        let heard = |((Address { system_id, component_id }, link_id), stamp): (&(Address, u8), &u64)| {
            format!("heard {system_id} {component_id} {link_id} {stamp}\n")
        };
        [format!("ours {}\n", self.ours)].into_iter().chain(self.streams.iter().map(heard)).collect()
    }

    /// Reads those lines.
    ///
    /// # Errors
    /// The line that is neither `ours STAMP` nor `heard SYSTEM COMPONENT LINK STAMP`.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let mut memory = Self::default();
        for line in text.lines() {
            memory.read_line(line).ok_or_else(|| line.to_owned())?;
        }
        Ok(memory)
    }

    fn read_line(&mut self, line: &str) -> Option<()> {
        let words: Vec<&str> = line.split(' ').collect();
        let stamp = |word: &str| word.parse().ok().filter(|stamp| *stamp <= MAX_STAMP);
        match words[..] {
            ["ours", ours] => self.ours = stamp(ours)?,
            ["heard", system, component, link, heard] if self.streams.len() < MAX_STREAMS => {
                let [system_id, component_id, link_id] =
                    [system.parse().ok()?, component.parse().ok()?, link.parse().ok()?];
                self.streams.insert((Address { system_id, component_id }, link_id), stamp(heard)?);
            }
            _ => return None,
        }
        Some(())
    }
}

/// Signs what is sent and judges what is heard.
#[derive(Debug, Clone)]
pub struct Signing {
    key: Key,
    memory: Memory,
    counters: SigningCounters,
}

impl Signing {
    /// With a key, and what was remembered of the runs before.
    pub fn new(key: Key, memory: Memory) -> Self {
        Self { key, memory, counters: SigningCounters::default() }
    }

    /// Signs an unsigned frame for a link; `clock` is the time by the system's clock, which may stand still or be
    /// wrong. Signed anew, with a newer timestamp, whenever it is sent.
    #[must_use]
    pub fn sign(&mut self, frame: &Frame, link_id: u8, clock: u64) -> Frame {
        self.memory.ours = clock.max(self.memory.ours + 1).min(MAX_STAMP);
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
        let ours = self.memory.ours.max(clock);
        match self.memory.streams.get(&stream) {
            Some(last) if stamp <= *last => return Err(Rejection::Replayed),
            None if stamp + NEW_STREAM_LAG < ours || self.memory.streams.len() >= MAX_STREAMS => {
                return Err(Rejection::TooOld);
            }
            _ => {}
        }
        self.memory.streams.insert(stream, stamp);
        // Whoever holds the key and has a later time is right about it.
        self.memory.ours = self.memory.ours.max(stamp);
        Ok(())
    }

    /// What was believed and what was not.
    pub fn counters(&self) -> SigningCounters {
        self.counters
    }

    /// What is to be remembered over a restart; worth keeping once a second.
    pub fn memory(&self) -> Memory {
        let ours = (self.memory.ours + LEAD).min(MAX_STAMP);
        Memory { ours, streams: self.memory.streams.clone() }
    }
}
