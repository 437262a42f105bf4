//! MAVLink framing without I/O: bytes in any chunking to checked frames, and messages to frames.
//!
//! [`Framer`] keeps what a typed reader would throw away: the frame's exact bytes (for the log),
//! counters of what was rejected and why, and frames whose fields hold values the dialect does not
//! know (so that an unknown command can still be answered). MAVLink 2 only: its predecessor's frames are
//! garbage here, because their one-byte marker and unchecked ids would make a framer wait on noise for bytes that
//! never come. Wire format: <https://mavlink.io/en/guide/serialization.html>.

mod encoder;
mod framer;

use mavlink::{MavlinkVersion, Message as _};

use crate::dialect::MavMessage;
use crate::identity::Address;

pub use encoder::Encoder;
pub use framer::{Framer, FramerCounters};

const MAGIC: u8 = 0xFD;
const HEADER_LEN: usize = 10;
const CRC_LEN: usize = 2;
/// What a signature adds to a frame: link id, six bytes of timestamp, six of hash.
pub const SIGNATURE_LEN: usize = 13;
const INCOMPAT_SIGNED: u8 = 0x01;
/// Hands a key over in the clear.
const SETUP_SIGNING_ID: u32 = 256;

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

    /// The checksum.
    pub fn crc(&self) -> u16 {
        let at = HEADER_LEN + usize::from(self.bytes[1]);
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// Whether it carries a signature; whether that is right is another matter.
    pub fn is_signed(&self) -> bool {
        self.bytes[2] & INCOMPAT_SIGNED != 0
    }

    /// Link id, timestamp and the hash's first six bytes, as they stand on the wire; `None` if it is unsigned.
    pub(crate) fn signature(&self) -> Option<&[u8]> {
        self.is_signed().then(|| &self.bytes[self.bytes.len() - SIGNATURE_LEN..])
    }

    /// The same frame marked as signed, up to its checksum: the signature is to follow.
    pub(crate) fn marked_signed(&self) -> Self {
        self.with_flags(INCOMPAT_SIGNED)
    }

    /// Appends a signature to a frame that is marked as signed.
    pub(crate) fn push_signature(&mut self, signature: &[u8; SIGNATURE_LEN]) {
        self.bytes.extend_from_slice(signature);
    }

    /// The same message unsigned.
    #[must_use]
    pub fn without_signature(&self) -> Self {
        if self.is_signed() { self.with_flags(0) } else { self.clone() }
    }

    /// The frame as a log may have it: without its signature, and `None` for a message that carries a key.
    pub fn for_log(&self) -> Option<Vec<u8>> {
        (self.message_id() != SETUP_SIGNING_ID).then(|| self.without_signature().bytes)
    }

    fn with_flags(&self, flags: u8) -> Self {
        let crc_at = HEADER_LEN + usize::from(self.bytes[1]);
        let mut bytes = self.bytes[..crc_at].to_vec();
        bytes[2] = flags;
        // A frame's id is in the dialect, or it would not be one.
        let crc = mavlink::calculate_crc(&bytes[1..], crc_extra(self.message_id()).unwrap_or(0));
        bytes.extend_from_slice(&crc.to_le_bytes());
        Self { bytes }
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
