//! MAVLink framing without I/O: bytes in any chunking to checked frames, and messages to frames.
//!
//! [`Framer`] keeps what a typed reader would throw away: the frame's exact bytes (for the log),
//! counters of what was rejected and why, and frames whose fields hold values the dialect does not
//! know (so that an unknown command can still be answered). MAVLink 2 only: its predecessor's frames are
//! garbage here, because their one-byte marker and unchecked ids would make a framer wait on noise for bytes that
//! never come. Wire format: <https://mavlink.io/en/guide/serialization.html>.

use mavlink::{MavlinkVersion, Message as _};

use crate::dialect::MavMessage;
use crate::identity::Address;

const MAGIC: u8 = 0xFD;
const HEADER_LEN: usize = 10;
const CRC_LEN: usize = 2;
const SIGNATURE_LEN: usize = 13;
const INCOMPAT_SIGNED: u8 = 0x01;

/// One whole frame whose CRC is right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    bytes: Vec<u8>,
}

impl Frame {
    /// The frame as it stood on the wire, start marker to signature.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The sender's sequence number.
    pub fn sequence(&self) -> u8 {
        self.bytes[4]
    }

    /// The sender.
    pub fn source(&self) -> Address {
        Address { system_id: self.bytes[5], component_id: self.bytes[6] }
    }

    /// Message id.
    pub fn message_id(&self) -> u32 {
        u32::from_le_bytes([self.bytes[7], self.bytes[8], self.bytes[9], 0])
    }

    /// The payload as sent: trailing zeros may be cut.
    pub fn payload(&self) -> &[u8] {
        &self.bytes[HEADER_LEN..HEADER_LEN + usize::from(self.bytes[1])]
    }

    /// The payload padded with the zeros that the sender cut.
    pub fn padded_payload(&self) -> [u8; 255] {
        let mut padded = [0; 255];
        let payload = self.payload();
        padded[..payload.len()].copy_from_slice(payload);
        padded
    }

    /// The typed message.
    ///
    /// # Errors
    /// A field holds a value that the dialect does not define.
    pub fn decode(&self) -> Result<MavMessage, DecodeError> {
        MavMessage::parse(MavlinkVersion::V2, self.message_id(), self.payload())
            .map_err(|error| DecodeError { message_id: self.message_id(), reason: error.to_string() })
    }
}

/// A frame with a right CRC whose fields could not be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("message {message_id}: {reason}")]
pub struct DecodeError {
    /// Message id.
    pub message_id: u32,
    /// What the parser said.
    pub reason: String,
}

/// What a [`Framer`] has seen, kept and thrown away.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FramerCounters {
    /// Frames with a right CRC.
    pub frames: u64,
    /// Candidates whose CRC was wrong.
    pub crc_errors: u64,
    /// Candidates with a message id outside the dialect (their CRC cannot be checked).
    pub unknown_ids: u64,
    /// Candidates that ended before their length.
    pub cut_short: u64,
    /// Candidates with incompatibility flags that this implementation does not know.
    pub unknown_flags: u64,
    /// Bytes that belonged to no frame.
    pub garbage_bytes: u64,
}

/// Finds frames in a stream of bytes.
///
/// A rejected candidate is retried from its second byte, so that a start marker inside garbage never hides the
/// frame behind it. A candidate that waits for bytes is rejected too as soon as it is known that none will come:
/// at the end of a datagram, and when a serial line falls silent. Holds at most one partial frame between calls.
#[derive(Debug, Default)]
pub struct Framer {
    buffer: Vec<u8>,
    start: usize,
    /// No byte will follow what is in the buffer.
    ended: bool,
    counters: FramerCounters,
}

impl Framer {
    /// An empty framer.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends bytes of a stream; call [`Framer::next_frame`] until it returns `None` afterwards.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.start);
        self.start = 0;
        self.buffer.extend_from_slice(bytes);
        self.ended = false;
    }

    /// Appends a whole datagram, whose end is the end of its frames; call [`Framer::next_frame`] until it returns
    /// `None` afterwards.
    pub fn push_datagram(&mut self, bytes: &[u8]) {
        self.push(bytes);
        self.ended = true;
    }

    /// The stream has fallen silent for longer than a frame may pause: what is incomplete will stay so. Call
    /// [`Framer::next_frame`] until it returns `None` afterwards: a whole frame may stand behind it.
    pub fn on_silence(&mut self) {
        self.ended = true;
    }

    /// Counters since the start.
    pub fn counters(&self) -> FramerCounters {
        self.counters
    }

    /// The next whole frame, or `None` until more bytes arrive.
    pub fn next_frame(&mut self) -> Option<Frame> {
        loop {
            let candidate = &self.buffer[self.start..];
            let Some(skipped) = candidate.iter().position(|byte| *byte == MAGIC) else {
                self.counters.garbage_bytes += candidate.len() as u64;
                self.start = self.buffer.len();
                return None;
            };
            self.counters.garbage_bytes += skipped as u64;
            self.start += skipped;
            match examine(&self.buffer[self.start..]) {
                Candidate::Incomplete if !self.ended => return None,
                Candidate::Incomplete => self.counters.cut_short += 1,
                Candidate::Whole(len) => {
                    let bytes = self.buffer[self.start..self.start + len].to_vec();
                    self.start += len;
                    self.counters.frames += 1;
                    return Some(Frame { bytes });
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

/// Looks at bytes that begin with a start marker.
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

/// The dialect's CRC seed of a message; `None` for an id outside the dialect.
///
/// The generated lookup answers 0 for unknown ids, and 0 is also a possible seed, so the seed
/// alone cannot tell.
fn crc_extra(message_id: u32) -> Option<u8> {
    match MavMessage::extra_crc(message_id) {
        0 if MavMessage::default_message_from_id(message_id).is_none() => None,
        extra => Some(extra),
    }
}

/// Turns one component's messages into MAVLink 2 frames, numbering them.
#[derive(Debug, Clone)]
pub struct Encoder {
    source: Address,
    sequence: u8,
}

impl Encoder {
    /// An encoder for one component; every component numbers its own frames.
    pub fn new(source: Address) -> Self {
        Self { source, sequence: 0 }
    }

    /// The frame of a typed message.
    pub fn encode(&mut self, message: &MavMessage) -> Frame {
        let mut payload = [0; 255];
        let len = message.ser(MavlinkVersion::V2, &mut payload);
        self.frame(message.message_id(), MavMessage::extra_crc(message.message_id()), &payload[..len])
    }

    /// The frame of a payload built by hand, for values that the typed messages cannot hold.
    ///
    /// Returns `None` for a message id outside the dialect or more than 255 bytes.
    pub fn encode_payload(&mut self, message_id: u32, payload: &[u8]) -> Option<Frame> {
        let extra = crc_extra(message_id)?;
        if payload.len() > 255 {
            return None;
        }
        // MAVLink 2 cuts trailing zeros, but never the first byte.
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
