//! The packets of MAVLink FTP, inside FILE_TRANSFER_PROTOCOL messages.

use crate::dialect::{FILE_TRANSFER_PROTOCOL_DATA, MavMessage};
use crate::frame::Frame;
use crate::identity::Address;
use alloc::vec;
use alloc::vec::Vec;

/// The message that carries the packets.
pub(crate) const FILE_TRANSFER_PROTOCOL_ID: u32 = 110;
/// Most bytes of a file in one packet.
pub const DATA_LEN: usize = 239;
/// Length of the longest message: network, system, component and packet.
pub const PAYLOAD_LEN: usize = 254;
/// Bytes before a packet in its message: network, system and component.
const ADDRESS_LEN: usize = 3;
const HEADER_LEN: usize = 12;

/// The request or answer code of a packet: a MAV_FTP_OPCODE. Any other number writes, or is
/// unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Opcode(pub u8);

impl Opcode {
    pub const NONE: Self = Self(0);
    pub const TERMINATE_SESSION: Self = Self(1);
    pub const RESET_SESSIONS: Self = Self(2);
    pub const LIST_DIRECTORY: Self = Self(3);
    pub const OPEN_FILE_RO: Self = Self(4);
    pub const READ_FILE: Self = Self(5);
    pub const CALC_FILE_CRC32: Self = Self(14);
    pub const BURST_READ_FILE: Self = Self(15);
    pub const ACK: Self = Self(128);
    pub const NAK: Self = Self(129);

    /// Whether it changes a file or a directory: create, write, remove, make and remove a
    /// directory, open for writing, truncate, rename.
    pub fn writes(self) -> bool {
        (6..=13).contains(&self.0)
    }

    fn is_answer(self) -> bool {
        self.0 >= 128
    }
}

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The file cannot be read.
    Fail,
    /// Not now (FailErrno with EBUSY).
    Busy,
    InvalidDataSize,
    InvalidSession,
    NoSessionsAvailable,
    /// The offset is at the end or behind it.
    EndOfFile,
    UnknownCommand,
    /// The files are for reading only.
    FileProtected,
    FileNotFound,
    /// Another error of another vehicle, with its number and its errno.
    Other(u8, u8),
}

const FAIL_ERRNO: u8 = 2;
const EBUSY: u8 = 16;
const ENOENT: u8 = 2;

/// Those that are a number alone: a MAV_FTP_ERR.
const NUMBERED: [(u8, Refusal); 8] = [
    (1, Refusal::Fail),
    (3, Refusal::InvalidDataSize),
    (4, Refusal::InvalidSession),
    (5, Refusal::NoSessionsAvailable),
    (6, Refusal::EndOfFile),
    (7, Refusal::UnknownCommand),
    (9, Refusal::FileProtected),
    (10, Refusal::FileNotFound),
];

impl Refusal {
    fn bytes(self) -> Vec<u8> {
        match self {
            Self::Busy => vec![FAIL_ERRNO, EBUSY],
            Self::Other(error, errno) => vec![error, errno],
            _ => NUMBERED.iter().filter(|(_, known)| *known == self).map(|(error, _)| *error).collect(),
        }
    }

    fn from_bytes(bytes: &[u8]) -> Self {
        let (error, errno) = (bytes.first().copied().unwrap_or(1), bytes.get(1).copied().unwrap_or(0));
        match (error, errno) {
            (FAIL_ERRNO, EBUSY) => Self::Busy,
            (FAIL_ERRNO, ENOENT) => Self::FileNotFound,
            _ => {
                let known = NUMBERED.iter().find(|(known, _)| *known == error);
                known.map_or(Self::Other(error, errno), |(_, refusal)| *refusal)
            }
        }
    }
}

/// One packet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    pub sequence: u16,
    pub session: u8,
    pub opcode: Opcode,
    /// The length of `data`; a request to read has no data, and requests this many bytes.
    pub size: u8,
    /// In an answer: the opcode of the request.
    pub request: Opcode,
    /// The last packet of a burst.
    pub burst_complete: bool,
    pub offset: u32,
    pub data: Vec<u8>,
}

impl Packet {
    /// A request with a path or without data.
    pub fn request(sequence: u16, session: u8, opcode: Opcode, offset: u32, path: &str) -> Self {
        let data = path.as_bytes()[..path.len().min(DATA_LEN)].to_vec();
        Self {
            sequence,
            session,
            opcode,
            size: data.len() as u8,
            request: Opcode::NONE,
            burst_complete: false,
            offset,
            data,
        }
    }

    /// The answer to this request; `data` is cut to what a packet holds.
    #[must_use]
    pub fn ack(&self, data: &[u8]) -> Self {
        let data = data[..data.len().min(DATA_LEN)].to_vec();
        Self {
            sequence: self.sequence.wrapping_add(1),
            opcode: Opcode::ACK,
            size: data.len() as u8,
            request: self.opcode,
            burst_complete: false,
            data,
            ..*self
        }
    }

    /// The refusal of this request.
    #[must_use]
    pub fn nak(&self, why: Refusal) -> Self {
        Self { opcode: Opcode::NAK, ..self.ack(&why.bytes()) }
    }

    /// Why a request was refused; `None` if this is no refusal.
    pub fn refusal(&self) -> Option<Refusal> {
        (self.opcode == Opcode::NAK).then(|| Refusal::from_bytes(&self.data))
    }

    /// Whether that packet is the answer to this request.
    pub fn is_answered_by(&self, answer: &Self) -> bool {
        answer.request == self.opcode && answer.sequence == self.sequence.wrapping_add(1)
    }

    /// A path in a request, without the zeros behind it; bytes that are no UTF-8 name no file.
    pub fn path(&self) -> &str {
        let end = self.data.iter().position(|byte| *byte == 0).unwrap_or(self.data.len());
        core::str::from_utf8(&self.data[..end]).unwrap_or("")
    }

    /// The first four bytes of the data as a number.
    pub fn number(&self) -> Option<u32> {
        self.data.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (header, rest) = bytes.split_at_checked(HEADER_LEN)?;
        let opcode = Opcode(header[3]);
        let size = header[4];
        // The data of a read is in the answer, not in the request.
        let has_data = !matches!(opcode, Opcode::READ_FILE | Opcode::BURST_READ_FILE);
        let len = if has_data { usize::from(size).min(rest.len()) } else { 0 };
        Some(Self {
            sequence: u16::from_le_bytes([header[0], header[1]]),
            session: header[2],
            opcode,
            size,
            request: Opcode(header[5]),
            burst_complete: header[6] != 0,
            offset: u32::from_le_bytes([header[8], header[9], header[10], header[11]]),
            data: rest[..len].to_vec(),
        })
    }

    /// The message that carries it to `target`.
    pub fn message(&self, target: Address) -> MavMessage {
        let mut payload = [0; PAYLOAD_LEN - ADDRESS_LEN];
        payload[..2].copy_from_slice(&self.sequence.to_le_bytes());
        payload[2] = self.session;
        payload[3] = self.opcode.0;
        payload[4] = self.size;
        payload[5] = self.request.0;
        payload[6] = u8::from(self.burst_complete);
        payload[8..HEADER_LEN].copy_from_slice(&self.offset.to_le_bytes());
        let data = &self.data[..self.data.len().min(DATA_LEN)];
        payload[HEADER_LEN..HEADER_LEN + data.len()].copy_from_slice(data);
        MavMessage::FILE_TRANSFER_PROTOCOL(FILE_TRANSFER_PROTOCOL_DATA {
            target_network: 0,
            target_system: target.system_id,
            target_component: target.component_id,
            payload,
        })
    }

    /// The packet in a frame, with its addressee, if it is an answer.
    pub fn answer_in(frame: &Frame) -> Option<(Address, Self)> {
        let (target, packet) = packet_in(frame)?;
        packet.opcode.is_answer().then_some((target, packet))
    }
}

fn packet_in(frame: &Frame) -> Option<(Address, Packet)> {
    if frame.message_id() != FILE_TRANSFER_PROTOCOL_ID {
        return None;
    }
    let bytes = frame.padded_payload();
    let target = Address { system_id: bytes[1], component_id: bytes[2] };
    Some((target, Packet::from_bytes(&bytes[ADDRESS_LEN..PAYLOAD_LEN])?))
}

/// Returns where in its payload the piece of a file begins, if a frame carries one. A log omits it:
/// a log that is downloaded would contain itself.
pub(crate) fn piece_begins_at(message_id: u32, payload: &[u8]) -> Option<usize> {
    let opcode = |place: usize| payload.get(ADDRESS_LEN + place).copied().map(Opcode);
    let is_piece = message_id == FILE_TRANSFER_PROTOCOL_ID
        && opcode(3) == Some(Opcode::ACK)
        && matches!(opcode(5), Some(Opcode::READ_FILE | Opcode::BURST_READ_FILE));
    is_piece.then_some(ADDRESS_LEN + HEADER_LEN)
}

/// A request of a client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileRequest {
    pub source: Address,
    /// The addressed component; id 0 means all.
    pub target: Address,
    pub packet: Packet,
}

impl FileRequest {
    /// Parses the request in a FILE_TRANSFER_PROTOCOL frame; returns `None` for any other message
    /// and for answers, which must not be answered.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        let (target, packet) = packet_in(frame)?;
        (!packet.opcode.is_answer()).then_some(Self { source: frame.source(), target, packet })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Encoder;
    use crate::identity::{GROUND, VEHICLE};
    use proptest::prelude::*;

    #[test]
    fn answers_are_not_answered() {
        for opcode in [Opcode::ACK, Opcode::NAK] {
            let packet = Packet::request(1, 0, opcode, 0, "");
            let frame = Encoder::new(GROUND).encode(&packet.message(VEHICLE));
            assert_eq!(FileRequest::from_frame(&frame), None);
            assert!(Packet::answer_in(&frame).is_some());
        }
    }

    proptest! {
        #[test]
        fn a_packet_survives_its_frame(
            (sequence, session, offset) in any::<(u16, u8, u32)>(),
            data in proptest::collection::vec(any::<u8>(), 0..=DATA_LEN),
            burst_complete in any::<bool>(),
        ) {
            let request = Packet::request(sequence, session, Opcode::BURST_READ_FILE, offset, "");
            let packet = Packet { burst_complete, ..request.ack(&data) };
            let frame = Encoder::new(VEHICLE).encode(&packet.message(GROUND));
            prop_assert_eq!(Packet::answer_in(&frame), Some((GROUND, packet)));
        }
    }
}
