//! Parses the requests of the parameter protocol and builds the answers.
//!
//! Protocol: <https://mavlink.io/en/services/parameter.html>. Requests are parsed from their bytes,
//! because a PARAM_SET with a type outside the dialect must be answered, too. Values are
//! MAV_PARAM_TYPE_REAL32.

use alloc::string::String;
use mavlink::types::CharArray;

use crate::dialect::{MavMessage, MavParamError, MavParamType, PARAM_ERROR_DATA, PARAM_VALUE_DATA};
use crate::frame::Frame;
use crate::identity::Address;

const REQUEST_READ_ID: u32 = 20;
const REQUEST_LIST_ID: u32 = 21;
const SET_ID: u32 = 23;

/// A parameter's name as it is sent: up to 16 bytes, ended by a NUL unless all 16 are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParamId([u8; ParamId::MAX_LEN]);

impl ParamId {
    /// Length of the longest name, bytes.
    pub const MAX_LEN: usize = 16;

    /// Converts one of our names. A longer name is cut; a test makes sure that we have none.
    pub fn new(name: &str) -> Self {
        Self::from_bytes(name.as_bytes())
    }

    fn from_bytes(bytes: &[u8]) -> Self {
        let mut id = [0; Self::MAX_LEN];
        // Bytes after a NUL are not part of the name.
        for (place, byte) in id.iter_mut().zip(bytes.iter().take_while(|byte| **byte != 0)) {
            *place = *byte;
        }
        Self(id)
    }

    pub fn is(&self, name: &str) -> bool {
        *self == Self::new(name)
    }

    /// The name without control characters, for a terminal.
    pub fn printable(&self) -> String {
        let len = self.0.iter().position(|byte| *byte == 0).unwrap_or(Self::MAX_LEN);
        crate::text::printable(&self.0[..len])
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParamKey {
    Name(ParamId),
    /// By its index in the list.
    Index(i16),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamQuestion {
    List,
    Read(ParamKey),
    Set {
        id: ParamId,
        /// The value, read as a REAL32.
        value: f32,
        /// The MAV_PARAM_TYPE number in the request.
        value_type: u8,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamRequest {
    /// The addressed component; id 0 means all.
    pub target: Address,
    pub question: ParamQuestion,
}

impl ParamRequest {
    /// Parses the request in a frame; returns `None` for any other message.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        let bytes = frame.padded_payload();
        let target = |at: usize| Address { system_id: bytes[at], component_id: bytes[at + 1] };
        Some(match frame.message_id() {
            REQUEST_LIST_ID => Self { target: target(0), question: ParamQuestion::List },
            REQUEST_READ_ID => {
                let index = i16::from_le_bytes([bytes[0], bytes[1]]);
                // Index -1 means that the name selects the parameter.
                let key = if index == -1 {
                    ParamKey::Name(ParamId::from_bytes(&bytes[4..20]))
                } else {
                    ParamKey::Index(index)
                };
                Self { target: target(2), question: ParamQuestion::Read(key) }
            }
            SET_ID => Self {
                target: target(4),
                question: ParamQuestion::Set {
                    id: ParamId::from_bytes(&bytes[6..22]),
                    value: f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
                    value_type: bytes[22],
                },
            },
            _ => return None,
        })
    }
}

/// Returns whether a PARAM_SET has the type that this project uses.
pub fn is_real32(value_type: u8) -> bool {
    value_type == MavParamType::MAV_PARAM_TYPE_REAL32 as u8
}

/// Builds a PARAM_VALUE for the parameter at `index` of `count`. It is broadcast, so that every
/// ground station receives a change.
pub fn value_message(name: &str, value: f32, index: u16, count: u16) -> MavMessage {
    MavMessage::PARAM_VALUE(PARAM_VALUE_DATA {
        param_value: value,
        param_count: count,
        param_index: index,
        param_id: CharArray::new(ParamId::new(name).0),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    })
}

/// Builds a PARAM_ERROR for a request that no value can answer.
pub fn error_message(key: ParamKey, error: MavParamError, asker: Address) -> MavMessage {
    let (param_id, param_index) = match key {
        ParamKey::Name(id) => (id.0, -1),
        ParamKey::Index(index) => ([0; ParamId::MAX_LEN], index),
    };
    MavMessage::PARAM_ERROR(PARAM_ERROR_DATA {
        param_index,
        target_system: asker.system_id,
        target_component: asker.component_id,
        param_id: CharArray::new(param_id),
        error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::PARAM_SET_DATA;
    use crate::frame::Encoder;
    use crate::identity::GROUND;

    fn set(name: &[u8; 16]) -> ParamRequest {
        let message = MavMessage::PARAM_SET(PARAM_SET_DATA {
            param_value: 2.5,
            target_system: 1,
            target_component: 1,
            param_id: CharArray::new(*name),
            param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
        });
        ParamRequest::from_frame(&Encoder::new(GROUND).encode(&message)).unwrap()
    }

    #[test]
    fn a_name_ends_after_sixteen_bytes_or_at_its_first_nul() {
        for (bytes, name) in [(b"ABCDEFGHIJKLMNOP", "ABCDEFGHIJKLMNOP"), (b"ABC\0EFGHIJKLMNOP", "ABC")] {
            let ParamQuestion::Set { id, value, value_type } = set(bytes).question else { panic!("a set") };
            assert!(id.is(name) && !id.is("ABCD") && is_real32(value_type));
            assert_eq!((id.printable().as_str(), value.to_bits()), (name, 2.5f32.to_bits()));
        }
    }

    #[test]
    fn a_request_with_an_unknown_type_is_parsed() {
        let mut payload = [0; 23];
        payload[6..9].copy_from_slice(b"ABC");
        payload[22] = 200;
        let frame = Encoder::new(GROUND).encode_payload(SET_ID, &payload).unwrap();
        assert!(frame.decode().is_err());
        let request = ParamRequest::from_frame(&frame).unwrap();
        assert!(matches!(request.question, ParamQuestion::Set { value_type: 200, .. }));
    }
}
