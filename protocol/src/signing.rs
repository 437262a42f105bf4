//! Signs MAVLink 2 frames and checks signatures, without clocks and files.
//!
//! A signature is the first six bytes of SHA-256 over key, frame, link id and timestamp. Timestamps
//! count 10 us units since 2015-01-01 UTC. For each system, component and link they only grow, so a
//! recorded frame cannot be replayed. <https://mavlink.io/en/guide/message_signing.html>
//!
//! Keys are copied as files, never sent by radio: SETUP_SIGNING is ignored.

use alloc::borrow::ToOwned as _;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use sha2::{Digest as _, Sha256};

use crate::frame::{Frame, INCOMPAT_SIGNED, SIGNATURE_LEN};
use crate::identity::Address;

/// Maximum age of a new stream's first timestamp: one minute.
const NEW_STREAM_LAG: u64 = 60 * STAMPS_PER_S;
/// Maximum lead of a frame over a clock that is set: one day. A clock in another time zone is off
/// by less, and must not separate vehicle and ground at the pad. A station with a wrong year must
/// not lock out all others permanently.
const MAX_AHEAD: u64 = 24 * 3600 * STAMPS_PER_S;
/// 2026-01-01 00:00 UTC, 4,018 days after 2015-01-01. This program is newer, so a clock that shows
/// an earlier time was never set.
const PROGRAM_WRITTEN: u64 = 4_018 * 24 * 3600 * STAMPS_PER_S;

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
    /// Its timestamp is more than a day ahead of our clock, and our clock is set.
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
    /// Frames received before.
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
/// Without operators there is one shared key. With operators each has a key, and the link id of a
/// signature selects the key to check against; the vehicle itself and observers use the shared one.
#[derive(Debug, Clone)]
pub struct Signing {
    /// The key that signs, and its number.
    sender_key: (u8, Key),
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
            sender_key: (0, key.clone()),
            shared: key,
            operators: BTreeMap::new(),
            memory,
            clock_before,
            counters: SigningCounters::default(),
        }
    }

    /// Signs as the operator of this number from now on; frames of the vehicle are checked with the
    /// shared key.
    #[must_use]
    pub fn as_operator(self, number: u8, shared: Key) -> Self {
        Self { sender_key: (key_number(number), self.sender_key.1), shared, ..self }
    }

    /// Checks frames that name an operator with that operator's key. A frame that names an unknown
    /// one is refused.
    #[must_use]
    pub fn with_operators(self, operators: BTreeMap<u8, Key>) -> Self {
        Self { operators, ..self }
    }

    /// The link id of frames over a link: its number, and the number of the key. Links beyond the
    /// 16th share an id, which costs nothing but exact statistics.
    pub fn link_id(&self, link: usize) -> u8 {
        (link as u8) << KEY_BITS | self.sender_key.0
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

    /// Signs an unsigned frame for one link. `clock` is the time of the system's clock, which may
    /// stand still or be wrong. A repeated frame must be signed again, which gives it a newer
    /// timestamp.
    #[must_use]
    pub fn sign(&mut self, frame: &Frame, link_id: u8, clock: u64) -> Frame {
        self.memory.ours = clock.max(self.memory.ours + 1).min(MAX_STAMP);
        self.memory.clock = self.memory.clock.max(clock);
        // Without its signature, which must follow.
        let mut signed = frame.with_flags(INCOMPAT_SIGNED);
        let mut signature = [0; SIGNATURE_LEN];
        signature[0] = link_id;
        signature[1..7].copy_from_slice(&self.memory.ours.to_le_bytes()[..6]);
        let hash = self.sender_key.1.hash(&[signed.as_bytes(), &signature[..7]].concat());
        signature[7..].copy_from_slice(&hash);
        signed.push_signature(&signature);
        signed
    }

    /// Checks a frame and counts the result.
    ///
    /// # Errors
    /// The frame must be ignored; the error gives the reason.
    pub fn check(&mut self, frame: &Frame, clock: u64) -> Result<(), Rejection> {
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
        // A clock that is set shows the right time. Otherwise the latest received timestamp is used
        // as the time.
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
        // Our signatures must be newer than all received ones.
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

    /// Returns whether our clock is set: it shows a time after this program was written, and it has
    /// not gone back since earlier runs. A board whose clock stops without power fails one of the
    /// two.
    fn is_set(&self, clock: u64) -> bool {
        clock >= PROGRAM_WRITTEN.max(self.clock_before)
    }

    /// Returns how many frames were accepted and rejected.
    pub fn counters(&self) -> SigningCounters {
        self.counters
    }

    /// Returns the timestamps to be stored. Store them before acting on an accepted frame, so that
    /// it is not accepted twice, and at least once a second, so that no timestamp of ours is used
    /// twice.
    pub fn memory(&self) -> Memory {
        let ours = (self.memory.ours + LEAD).min(MAX_STAMP);
        Memory { ours, ..self.memory.clone() }
    }
}

// The timestamps of MAVLink signatures, which count 10 us units since 2015-01-01 UTC.

/// 2015-01-01 00:00 UTC after the Unix epoch: 16,436 days.
const EPOCH: Duration = Duration::from_hours(24 * 16_436);
const STAMPS_PER_S: u64 = 100_000;
/// The largest timestamp: timestamps have 48 bits.
const MAX_STAMP: u64 = (1 << 48) - 1;

/// Converts a time since the Unix epoch into a timestamp.
pub fn stamp_of(since_unix_epoch: Duration) -> u64 {
    let since = since_unix_epoch.saturating_sub(EPOCH);
    u64::try_from(since.as_micros() / 10).unwrap_or(MAX_STAMP).min(MAX_STAMP)
}

/// The time of day at one instant, from which on only elapsed time counts. So the stamps of a run
/// do not follow a clock that is set while it runs, forward or back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Anchor(Duration);

impl Anchor {
    /// Starts at this time since the Unix epoch.
    pub fn at(since_unix_epoch: Duration) -> Self {
        Self(since_unix_epoch)
    }

    /// Returns the timestamp this long after the start.
    pub fn stamp(self, since_start: Duration) -> u64 {
        stamp_of(self.0 + since_start)
    }
}

// The timestamps that must survive a restart, as lines of text to which further lines may be
// appended.

/// Stored timestamps are this far ahead of the ones in use, so that no timestamp is used twice
/// after a restart.
const LEAD: u64 = 5 * STAMPS_PER_S;
/// At most this many streams of one key are remembered. Only holders of the key can begin one.
const MAX_STREAMS: usize = 64;
/// The shared key and fifteen operators'.
const MAX_KEYS: usize = 16;

/// Why remembered timestamps cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MemoryError {
    /// A line cannot be parsed.
    #[error("`{0}` is neither `ours STAMP`, `clock STAMP` nor `heard SYSTEM COMPONENT LINK STAMP`")]
    Line(String),
    /// The timestamp of the last frame that was sent is missing.
    #[error("the line `ours STAMP` is missing, so recorded frames could be replayed")]
    NoOwnStamp,
}

/// The timestamps that must survive a restart: ours, our clock's, and those of each received
/// stream.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Memory {
    /// The last timestamp that was used for signing, plus a margin: see [`Signing::memory`].
    ours: u64,
    /// The latest time that our clock has shown.
    clock: u64,
    streams: BTreeMap<(Address, u8), u64>,
}

impl Memory {
    pub fn to_text(&self) -> String {
        [self.our_lines()].into_iter().chain(self.streams.iter().map(stream_line)).collect()
    }

    /// Returns the lines that update `other`, an older memory, to this one. While at least half of
    /// our timestamp margin is left, our lines are not rewritten.
    pub fn lines_since(&self, other: &Self) -> String {
        let changed = self.streams.iter().filter(|(stream, stamp)| other.streams.get(stream) != Some(stamp));
        let ours = (self.ours > other.ours + LEAD / 2).then(|| self.our_lines());
        changed.map(stream_line).chain(ours).collect()
    }

    fn our_lines(&self) -> String {
        format!("ours {}\nclock {}\n", self.ours, self.clock)
    }

    /// Notes that the result of [`Memory::lines_since`] was written, so that it is not written
    /// again.
    pub fn catch_up(&mut self, with: &Self) {
        if with.ours > self.ours + LEAD / 2 {
            (self.ours, self.clock) = (with.ours, with.clock);
        }
        self.streams.clone_from(&with.streams);
    }

    /// Parses the lines of a timestamp file; later lines override earlier ones. An incomplete last
    /// line was cut off while it was written. Its frame was not acted on, so the line is ignored.
    ///
    /// # Errors
    /// A line cannot be parsed, or our timestamp is missing.
    pub fn from_text(text: &str) -> Result<Self, MemoryError> {
        let mut memory = Self::default();
        let mut has_ours = false;
        for line in text.split_inclusive('\n') {
            match line.strip_suffix('\n') {
                Some(line) => {
                    memory.read_line(line).ok_or_else(|| MemoryError::Line(line.to_owned()))?;
                    has_ours |= line.starts_with("ours ");
                }
                None if has_ours => {}
                None => return Err(MemoryError::Line(line.to_owned())),
            }
        }
        if has_ours { Ok(memory) } else { Err(MemoryError::NoOwnStamp) }
    }

    fn read_line(&mut self, line: &str) -> Option<()> {
        let words: Vec<&str> = line.split(' ').collect();
        let stamp = |word: &str| word.parse().ok().filter(|stamp| *stamp <= MAX_STAMP);
        match words[..] {
            ["ours", ours] => self.ours = stamp(ours)?,
            ["clock", clock] => self.clock = stamp(clock)?,
            ["heard", system, component, link, heard] => {
                let [system_id, component_id, link_id] =
                    [system.parse().ok()?, component.parse().ok()?, link.parse().ok()?];
                let stream = (Address { system_id, component_id }, link_id);
                if self.streams.len() >= MAX_KEYS * MAX_STREAMS && !self.streams.contains_key(&stream) {
                    return None;
                }
                self.streams.insert(stream, stamp(heard)?);
            }
            _ => return None,
        }
        Some(())
    }
}

fn stream_line((stream, stamp): (&(Address, u8), &u64)) -> String {
    let (Address { system_id, component_id }, link_id) = stream;
    format!("heard {system_id} {component_id} {link_id} {stamp}\n")
}

// Detects a sender whose frames are all rejected for their timestamps although the key is right,
// and advises the crew.

/// A sender is locked out when for this long only such frames arrived.
const AFTER: Duration = Duration::from_secs(2);
/// Interval of repeated reports.
const AGAIN_AFTER: Duration = Duration::from_secs(30);
/// Maximum number of monitored senders. Only holders of the key get this far.
const MAX_SENDERS: usize = 16;

#[derive(Debug, Clone, Copy)]
struct Refused {
    since: Duration,
    reported_at: Option<Duration>,
}

/// The senders of which nothing but refused time stamps has arrived for a while.
#[derive(Debug, Default)]
pub struct Lockouts(BTreeMap<Address, Refused>);

impl Lockouts {
    /// Notes a frame that was accepted: its sender is not locked out.
    pub fn accepted(&mut self, frame: &Frame) {
        if frame.is_signed() {
            self.0.remove(&frame.source());
        }
    }

    /// Notes a refused frame. Returns the words for the crew when they are due. `clock` is the time
    /// that the frame was judged by, as a time stamp.
    pub fn refused(&mut self, frame: &Frame, why: Rejection, now: Duration, clock: u64) -> Option<String> {
        let stamp = frame.stamp()?;
        if !matches!(why, Rejection::Replayed | Rejection::TooOld | Rejection::TooNew) {
            return None;
        }
        let source = frame.source();
        if self.0.len() >= MAX_SENDERS && !self.0.contains_key(&source) {
            return None;
        }
        let refused = self.0.entry(source).or_insert(Refused { since: now, reported_at: None });
        let due = now.saturating_sub(refused.since) >= AFTER
            && refused.reported_at.is_none_or(|at| now.saturating_sub(at) >= AGAIN_AFTER);
        if !due {
            return None;
        }
        refused.reported_at = Some(now);
        let Address { system_id, component_id } = source;
        let off = in_words(stamp.abs_diff(clock));
        let side = if stamp > clock { "ahead of" } else { "behind" };
        let what_to_do = match why {
            Rejection::TooNew => {
                "if this clock is right, set the vehicle's, remove its file KEY.vehicle.stamps and restart it"
            }
            Rejection::TooOld => "set the clock that is wrong, then restart that program",
            _ => {
                "either somebody plays a recording, or its clock or its file of stamps was set back: set its clock, remove \
                 this station's file KEY.ground.stamps and restart the station"
            }
        };
        Some(format!(
            "LOCKED OUT: nothing of {system_id}/{component_id} is believed, its time stamps are {off} {side} this clock \
             ({why}); {what_to_do}"
        ))
    }
}

/// A span of time stamps in the unit that fits.
fn in_words(stamps: u64) -> String {
    let seconds = stamps / STAMPS_PER_S;
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7_200 => format!("{} min", seconds / 60),
        7_200..172_800 => format!("{} h", seconds / 3_600),
        _ => format!("{:.1} days", seconds as f64 / 86_400.0),
    }
}
