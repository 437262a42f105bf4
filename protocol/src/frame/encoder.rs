//! Turns messages into frames.

use alloc::vec::Vec;
use mavlink_core::{MavlinkVersion, Message as _};

use super::{CRC_LEN, Frame, HEADER_LEN, MAGIC, crc_extra};
use crate::dialect::MavMessage;
use crate::identity::Address;

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
        let crc = mavlink_core::calculate_crc(&bytes[1..], crc_extra);
        bytes.extend_from_slice(&crc.to_le_bytes());
        self.sequence = self.sequence.wrapping_add(1);
        Frame { bytes }
    }
}
