//! Declines every MAVLink FTP request at once, because the vehicle has no files.
//!
//! A client that gets no answer waits and asks again; MAVProxy waits about 11 s before it requests the parameters
//! without FTP. Protocol: <https://mavlink.io/en/services/ftp.html>.

use crate::dialect::{FILE_TRANSFER_PROTOCOL_DATA, MavMessage};
use crate::frame::Frame;
use crate::identity::Address;

const FILE_TRANSFER_PROTOCOL_ID: u32 = 110;
/// Opcodes and errors of the FTP service.
const TERMINATE_SESSION: u8 = 1;
const RESET_SESSIONS: u8 = 2;
const ACK: u8 = 128;
const NAK: u8 = 129;
const ERROR_UNKNOWN_COMMAND: u8 = 7;
const ERROR_FILE_NOT_FOUND: u8 = 10;
/// Opcodes that name a file or a directory: list, open for reading, create, remove, open for writing.
const OPENING: [u8; 5] = [3, 4, 6, 8, 11];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileRequest {
    pub source: Address,
    /// The addressed component; id 0 means all.
    pub target: Address,
    sequence: u16,
    session: u8,
    opcode: u8,
}

impl FileRequest {
    /// Parses the request in a FILE_TRANSFER_PROTOCOL frame; returns `None` for any other message and for answers,
    /// which must not be answered.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        if frame.message_id() != FILE_TRANSFER_PROTOCOL_ID {
            return None;
        }
        let bytes = frame.padded_payload();
        let opcode = bytes[6];
        (opcode < ACK).then_some(Self {
            source: frame.source(),
            target: Address { system_id: bytes[1], component_id: bytes[2] },
            sequence: u16::from_le_bytes([bytes[3], bytes[4]]),
            session: bytes[5],
            opcode,
        })
    }

    /// Builds the answer of a vehicle without files: no file exists, no session is open, no other command is known.
    pub fn decline(&self) -> MavMessage {
        let (opcode, error) = match self.opcode {
            TERMINATE_SESSION | RESET_SESSIONS => (ACK, None),
            opening if OPENING.contains(&opening) => (NAK, Some(ERROR_FILE_NOT_FOUND)),
            _ => (NAK, Some(ERROR_UNKNOWN_COMMAND)),
        };
        let mut payload = [0; 251];
        payload[..2].copy_from_slice(&self.sequence.wrapping_add(1).to_le_bytes());
        payload[2] = self.session;
        payload[3] = opcode;
        payload[4] = u8::from(error.is_some());
        payload[5] = self.opcode;
        payload[12] = error.unwrap_or(0);
        MavMessage::FILE_TRANSFER_PROTOCOL(FILE_TRANSFER_PROTOCOL_DATA {
            target_network: 0,
            target_system: self.source.system_id,
            target_component: self.source.component_id,
            payload,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Encoder;
    use crate::identity::{GROUND, VEHICLE};

    fn asked(opcode: u8) -> Frame {
        let mut payload = [0; 254];
        payload[1..7].copy_from_slice(&[1, 1, 0xFF, 0xFF, 3, opcode]);
        Encoder::new(GROUND).encode_payload(FILE_TRANSFER_PROTOCOL_ID, &payload).unwrap()
    }

    fn answer(opcode: u8) -> Option<[u8; 13]> {
        let request = FileRequest::from_frame(&asked(opcode))?;
        assert_eq!((request.source, request.target), (GROUND, VEHICLE));
        let MavMessage::FILE_TRANSFER_PROTOCOL(data) = request.decline() else { panic!("an answer") };
        assert_eq!((data.target_system, data.target_component), (255, 190));
        data.payload[..13].try_into().ok()
    }

    #[test]
    fn every_request_is_declined_with_the_next_number_and_its_own_opcode() {
        // Opcode 4 opens a file, which is not found; 15 is a burst read, which is unknown; 2 is a reset, which
        // succeeds.
        assert_eq!(answer(4), Some([0, 0, 3, NAK, 1, 4, 0, 0, 0, 0, 0, 0, ERROR_FILE_NOT_FOUND]));
        assert_eq!(answer(15), Some([0, 0, 3, NAK, 1, 15, 0, 0, 0, 0, 0, 0, ERROR_UNKNOWN_COMMAND]));
        assert_eq!(answer(2), Some([0, 0, 3, ACK, 0, 2, 0, 0, 0, 0, 0, 0, 0]));
    }

    #[test]
    fn answers_are_not_answered() {
        assert_eq!((answer(ACK), answer(NAK)), (None, None));
    }
}
