//! Converts bytes into checked MAVLink frames and messages into frames, without I/O.
//!
//! [`Framer`] retains data that the crate `mavlink` would drop: the exact bytes of a frame (for the
//! log), counters of rejections by cause, and frames whose fields hold values outside the dialect
//! (so that an unknown command can still be answered). It accepts MAVLink 2 only: MAVLink 1 has a
//! one-byte marker and unchecked ids, so its framer would wait on noise for bytes that never come.
//! Wire format: <https://mavlink.io/en/guide/serialization.html>.

use alloc::string::{String, ToString as _};
use alloc::vec::Vec;
use core::ops::Range;

use mavlink::{MavlinkVersion, Message as _};

use crate::dialect::MavMessage;
use crate::identity::Address;

const MAGIC: u8 = 0xFD;
const HEADER_LEN: usize = 10;
const CRC_LEN: usize = 2;
/// Length of a signature, bytes: link id, six bytes of timestamp, six of hash.
pub const SIGNATURE_LEN: usize = 13;
pub(crate) const INCOMPAT_SIGNED: u8 = 0x01;
/// The message SETUP_SIGNING, which contains a key in the clear.
const SETUP_SIGNING_ID: u32 = 256;

/// A complete frame with a correct CRC.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    bytes: Vec<u8>,
}

impl Frame {
    /// Returns the frame's bytes as they were on the wire, from start marker to signature.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub fn sequence(&self) -> u8 {
        self.bytes[4]
    }

    pub fn source(&self) -> Address {
        Address { system_id: self.bytes[5], component_id: self.bytes[6] }
    }

    pub fn message_id(&self) -> u32 {
        self.view().message_id()
    }

    /// Returns the payload as sent; trailing zeros may be cut.
    pub fn payload(&self) -> &[u8] {
        &self.bytes[HEADER_LEN..HEADER_LEN + usize::from(self.bytes[1])]
    }

    /// Returns the payload with the trailing zeros that the sender cut.
    pub fn padded_payload(&self) -> [u8; 255] {
        let mut padded = [0; 255];
        let payload = self.payload();
        padded[..payload.len()].copy_from_slice(payload);
        padded
    }

    pub fn crc(&self) -> u16 {
        let at = HEADER_LEN + usize::from(self.bytes[1]);
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// Returns whether the frame has a signature, right or wrong.
    pub fn is_signed(&self) -> bool {
        self.bytes[2] & INCOMPAT_SIGNED != 0
    }

    /// Returns link id, timestamp and the first six bytes of the hash, as they are on the wire;
    /// `None` if the frame is unsigned.
    pub(crate) fn signature(&self) -> Option<&[u8]> {
        self.is_signed().then(|| &self.bytes[self.bytes.len() - SIGNATURE_LEN..])
    }

    /// Returns the timestamp of its signature; `None` if the frame is unsigned.
    pub(crate) fn stamp(&self) -> Option<u64> {
        let stamp = &self.signature()?[1..7];
        Some(stamp.iter().rev().fold(0, |stamp, byte| stamp << 8 | u64::from(*byte)))
    }

    /// Returns the key number in the signature; 0 for the shared key, and without a signature. It
    /// is meaningless until [`crate::signing::Signing`] has checked the frame against that key.
    pub fn key_number(&self) -> u8 {
        self.signature().map_or(0, |signature| crate::signing::key_number(signature[0]))
    }

    /// Appends a signature to a frame that is marked as signed.
    pub(crate) fn push_signature(&mut self, signature: &[u8; SIGNATURE_LEN]) {
        self.bytes.extend_from_slice(signature);
    }

    /// Returns the same message unsigned.
    #[must_use]
    pub fn without_signature(&self) -> Self {
        if self.is_signed() { self.with_flags(0) } else { self.clone() }
    }

    /// Returns the bytes that may be logged: without the signature, and `None` for a message that
    /// contains a key. A piece of a file is logged without its content: a log that is downloaded
    /// would contain itself.
    pub fn for_log(&self) -> Option<Vec<u8>> {
        if self.message_id() == SETUP_SIGNING_ID {
            return None;
        }
        let content = crate::ftp::packet::piece_begins_at(self.message_id(), self.payload());
        let cut = content.filter(|from| *from < self.payload().len()).map(|from| {
            let mut bytes = self.bytes[..HEADER_LEN + from].to_vec();
            bytes[1] = from as u8;
            Self { bytes }.with_flags(0).bytes
        });
        Some(cut.unwrap_or_else(|| self.without_signature().bytes))
    }

    pub(crate) fn with_flags(&self, flags: u8) -> Self {
        let crc_at = HEADER_LEN + usize::from(self.bytes[1]);
        let mut bytes = self.bytes[..crc_at].to_vec();
        bytes[2] = flags;
        // The id of a frame is always in the dialect; the framer checks it.
        let crc = mavlink::calculate_crc(&bytes[1..], crc_extra(self.message_id()).unwrap_or(0));
        bytes.extend_from_slice(&crc.to_le_bytes());
        Self { bytes }
    }

    ///
    /// # Errors
    /// A field holds a value that the dialect does not define.
    pub fn decode(&self) -> Result<MavMessage, DecodeError> {
        self.view().decode()
    }

    fn view(&self) -> FrameView<'_> {
        FrameView { bytes: &self.bytes }
    }
}

/// A frame inside the buffer of a [`Framer`], for code that only decodes it: nothing is copied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameView<'a> {
    bytes: &'a [u8],
}

impl FrameView<'_> {
    /// Message id.
    #[inline]
    pub fn message_id(&self) -> u32 {
        u32::from_le_bytes([self.bytes[7], self.bytes[8], self.bytes[9], 0])
    }

    ///
    /// # Errors
    /// A field holds a value that the dialect does not define.
    #[inline]
    pub fn decode(&self) -> Result<MavMessage, DecodeError> {
        let payload = &self.bytes[HEADER_LEN..HEADER_LEN + usize::from(self.bytes[1])];
        match MavMessage::parse(MavlinkVersion::V2, self.message_id(), payload) {
            Ok(message) => Ok(message),
            Err(error) => Err(DecodeError { message_id: self.message_id(), reason: error.to_string() }),
        }
    }
}

/// A frame with a correct CRC whose fields could not be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("message {message_id}: {reason}")]
pub struct DecodeError {
    pub message_id: u32,
    /// The parser's message.
    pub reason: String,
}

/// Returns the dialect's CRC seed (CRC_EXTRA) of a message; `None` for an id outside the dialect.
///
/// The generated lookup answers 0 for unknown ids, and 0 is also a possible seed, so both cases
/// must be distinguished.
#[inline]
fn crc_extra(message_id: u32) -> Option<u8> {
    match MavMessage::extra_crc(message_id) {
        0 if MavMessage::default_message_from_id(message_id).is_none() => None,
        extra => Some(extra),
    }
}

// Turns messages into frames.

/// Turns one component's messages into MAVLink 2 frames and numbers them.
#[derive(Debug, Clone)]
pub struct Encoder {
    source: Address,
    sequence: u8,
}

impl Encoder {
    /// Creates the encoder of one component. Every component numbers its own frames.
    pub fn new(source: Address) -> Self {
        Self { source, sequence: 0 }
    }

    /// Encodes a typed message.
    pub fn encode(&mut self, message: &MavMessage) -> Frame {
        let mut payload = [0; 255];
        let len = message.ser(MavlinkVersion::V2, &mut payload);
        self.frame(message.message_id(), MavMessage::extra_crc(message.message_id()), &payload[..len])
    }

    /// Encodes a payload that was built by hand, for values that the typed messages cannot hold.
    ///
    /// Returns `None` for a message id outside the dialect or more than 255 bytes.
    pub fn encode_payload(&mut self, message_id: u32, payload: &[u8]) -> Option<Frame> {
        let extra = crc_extra(message_id)?;
        if payload.len() > 255 {
            return None;
        }
        // MAVLink 2 cuts trailing zeros but always keeps the first byte.
        let len = payload.iter().rposition(|byte| *byte != 0).map_or(1, |last| last + 1).min(payload.len());
        Some(self.frame(message_id, extra, &payload[..len]))
    }

    fn frame(&mut self, message_id: u32, crc_extra: u8, payload: &[u8]) -> Frame {
        let id = message_id.to_le_bytes();
        let mut bytes = Vec::with_capacity(HEADER_LEN + payload.len() + CRC_LEN);
        bytes.extend_from_slice(&[
            MAGIC,
            payload.len() as u8,
            0,
            0,
            self.sequence,
            self.source.system_id,
            self.source.component_id,
            id[0],
            id[1],
            id[2],
        ]);
        bytes.extend_from_slice(payload);
        let crc = mavlink::calculate_crc(&bytes[1..], crc_extra);
        bytes.extend_from_slice(&crc.to_le_bytes());
        self.sequence = self.sequence.wrapping_add(1);
        Frame { bytes }
    }
}

// Finds frames with a correct checksum in bytes, however the bytes are split into pieces.

/// Counters of accepted and rejected frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct FramerCounters {
    /// Frames with a correct CRC.
    pub frames: u64,
    /// Candidates whose CRC was wrong.
    pub crc_errors: u64,
    /// Candidates with a message id outside the dialect; their CRC cannot be checked.
    pub unknown_ids: u64,
    /// Candidates that ended before their stated length.
    pub cut_short: u64,
    /// Candidates with unknown incompatibility flags.
    pub unknown_flags: u64,
    /// Bytes that belonged to no frame.
    pub garbage_bytes: u64,
}

impl core::ops::AddAssign for FramerCounters {
    fn add_assign(&mut self, other: Self) {
        self.frames += other.frames;
        self.crc_errors += other.crc_errors;
        self.unknown_ids += other.unknown_ids;
        self.cut_short += other.cut_short;
        self.unknown_flags += other.unknown_flags;
        self.garbage_bytes += other.garbage_bytes;
    }
}

/// Finds frames in a stream of bytes.
///
/// After a rejected candidate the search continues at its second byte, so that a start marker
/// inside garbage never hides the frame behind it. A candidate that waits for bytes is rejected
/// once no more bytes will come: at the end of a datagram, and when a serial line falls silent. The
/// framer stores at most one partial frame between calls.
#[derive(Debug, Default)]
pub struct Framer {
    buffer: Vec<u8>,
    start: usize,
    /// No more bytes will follow those in the buffer.
    ended: bool,
    counters: FramerCounters,
}

impl Framer {
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends bytes of a stream. Call [`Framer::next_frame`] until it returns `None` afterwards.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.start);
        self.start = 0;
        self.buffer.extend_from_slice(bytes);
        self.ended = false;
    }

    /// Appends a whole datagram; no frame continues in the next one. Call [`Framer::next_frame`]
    /// until it returns `None` afterwards.
    pub fn push_datagram(&mut self, bytes: &[u8]) {
        self.push(bytes);
        self.ended = true;
    }

    /// Notes that the stream has paused for longer than a frame may, so that an incomplete frame
    /// will stay incomplete. Call [`Framer::next_frame`] until it returns `None` afterwards: a
    /// complete frame may follow the incomplete one.
    pub fn on_silence(&mut self) {
        self.ended = true;
    }

    pub fn counters(&self) -> FramerCounters {
        self.counters
    }

    /// Returns the next complete frame, or `None` until more bytes arrive.
    pub fn next_frame(&mut self) -> Option<Frame> {
        self.next_view().map(|view| Frame { bytes: view.bytes.to_vec() })
    }

    /// As [`Framer::next_frame`], without a copy.
    #[inline]
    pub fn next_view(&mut self) -> Option<FrameView<'_>> {
        let found = self.find()?;
        Some(FrameView { bytes: &self.buffer[found] })
    }

    /// Returns the position of the next complete frame in the buffer, and counts it as taken.
    #[inline]
    fn find(&mut self) -> Option<Range<usize>> {
        loop {
            let candidate = &self.buffer[self.start..];
            // Usually a frame follows directly after a frame.
            if candidate.first() != Some(&MAGIC) {
                let Some(skipped) = candidate.iter().position(|byte| *byte == MAGIC) else {
                    self.counters.garbage_bytes += candidate.len() as u64;
                    self.start = self.buffer.len();
                    return None;
                };
                self.counters.garbage_bytes += skipped as u64;
                self.start += skipped;
            }
            match examine(&self.buffer[self.start..]) {
                Candidate::Incomplete if !self.ended => return None,
                Candidate::Incomplete => self.counters.cut_short += 1,
                Candidate::Whole(len) => {
                    let from = self.start;
                    self.start += len;
                    self.counters.frames += 1;
                    return Some(from..self.start);
                }
                Candidate::BadCrc => self.counters.crc_errors += 1,
                Candidate::UnknownId => self.counters.unknown_ids += 1,
                Candidate::UnknownFlags => self.counters.unknown_flags += 1,
            }
            self.counters.garbage_bytes += 1;
            self.start += 1;
        }
    }
}

enum Candidate {
    Incomplete,
    Whole(usize),
    BadCrc,
    UnknownId,
    UnknownFlags,
}

/// Classifies bytes that begin with a start marker.
#[inline]
fn examine(candidate: &[u8]) -> Candidate {
    let signature_len = match candidate {
        [_, _, flags, ..] if flags & !INCOMPAT_SIGNED != 0 => return Candidate::UnknownFlags,
        [_, _, flags, ..] if flags & INCOMPAT_SIGNED != 0 => SIGNATURE_LEN,
        _ => 0,
    };
    if candidate.len() < HEADER_LEN {
        return Candidate::Incomplete;
    }
    let message_id = u32::from_le_bytes([candidate[7], candidate[8], candidate[9], 0]);
    let Some(crc_extra) = crc_extra(message_id) else {
        return Candidate::UnknownId;
    };
    let crc_at = HEADER_LEN + usize::from(candidate[1]);
    let len = crc_at + CRC_LEN + signature_len;
    if candidate.len() < len {
        return Candidate::Incomplete;
    }
    let found = u16::from_le_bytes([candidate[crc_at], candidate[crc_at + 1]]);
    if mavlink::calculate_crc(&candidate[1..crc_at], crc_extra) == found {
        Candidate::Whole(len)
    } else {
        Candidate::BadCrc
    }
}
