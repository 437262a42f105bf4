//! Answers for lists that this vehicle does not keep: missions, fences, rally points, logs on board, extended parameters.
//!
//! Other ground stations ask for them whatever the capabilities say, and report a failure to their user if there is no
//! answer. So every question is answered: the lists are empty, and nothing can be put into them. Protocols:
//! <https://mavlink.io/en/services/mission.html> and LOG_REQUEST_LIST of common.xml. Questions are parsed from raw
//! bytes, because a mission type that the dialect does not know must be answered, too.

use mavlink_core::types::CharArray;
use protocol::dialect::{
    LOG_DATA_DATA, LOG_ENTRY_DATA, MISSION_ACK_DATA, MISSION_COUNT_DATA, MavMessage, MavMissionResult,
    MavMissionType, MavParamError, PARAM_ERROR_DATA, PARAM_EXT_ACK_DATA, ParamAck,
};
use protocol::frame::Frame;
use protocol::identity::Address;

/// A question about a list, with its answer.
pub(super) struct ListQuestion {
    /// The addressee; 0 means all.
    pub(super) target: Address,
    pub(super) answer: MavMessage,
}

impl ListQuestion {
    /// The question in a frame; `None` for any other message.
    pub(super) fn from_frame(frame: &Frame) -> Option<Self> {
        let bytes = frame.padded_payload();
        let integer = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let of = |target_at: usize, type_at: usize| List {
            target: Address { system_id: bytes[target_at], component_id: bytes[target_at + 1] },
            asker: frame.source(),
            mission_type: mission_type(bytes[type_at]),
        };
        Some(match frame.message_id() {
            MISSION_REQUEST_LIST => of(0, 2).empty(),
            // An upload of zero items clears the list, which is always clear.
            MISSION_COUNT if integer(0) == 0 => of(2, 4).done(),
            MISSION_COUNT => of(2, 4).unsupported(),
            MISSION_CLEAR_ALL => of(0, 2).done(),
            MISSION_REQUEST | MISSION_REQUEST_INT => {
                of(2, 4).acknowledge(MavMissionResult::MAV_MISSION_INVALID_SEQUENCE)
            }
            MISSION_WRITE_PARTIAL_LIST => of(4, 6).unsupported(),
            MISSION_ITEM | MISSION_ITEM_INT => of(32, 37).unsupported(),
            LOG_REQUEST_LIST => {
                let target = Address { system_id: bytes[4], component_id: bytes[5] };
                Self { target, answer: MavMessage::LOG_ENTRY(LOG_ENTRY_DATA::default()) }
            }
            LOG_REQUEST_DATA => {
                let target = Address { system_id: bytes[10], component_id: bytes[11] };
                let ofs = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                let answer = LOG_DATA_DATA { ofs, id: integer(8), count: 0, data: [0; 90] };
                Self { target, answer: MavMessage::LOG_DATA(answer) }
            }
            PARAM_EXT_REQUEST_READ => {
                let target = Address { system_id: bytes[2], component_id: bytes[3] };
                let id = bytes[4..20].first_chunk().copied().unwrap_or_default();
                Self { target, answer: no_parameter(id, integer(0).cast_signed(), frame.source()) }
            }
            PARAM_EXT_REQUEST_LIST => {
                let target = Address { system_id: bytes[0], component_id: bytes[1] };
                Self { target, answer: no_parameter([0; 16], -1, frame.source()) }
            }
            PARAM_EXT_SET => {
                let target = Address { system_id: bytes[0], component_id: bytes[1] };
                let answer = PARAM_EXT_ACK_DATA {
                    param_id: CharArray::new(bytes[2..18].first_chunk().copied().unwrap_or_default()),
                    param_result: ParamAck::PARAM_ACK_FAILED,
                    ..PARAM_EXT_ACK_DATA::default()
                };
                Self { target, answer: MavMessage::PARAM_EXT_ACK(answer) }
            }
            _ => return None,
        })
    }
}

/// There are no extended parameters. The standard has no answer for that to a question; this is the one of the parameters.
fn no_parameter(id: [u8; 16], index: i16, asker: Address) -> MavMessage {
    MavMessage::PARAM_ERROR(PARAM_ERROR_DATA {
        param_index: index,
        target_system: asker.system_id,
        target_component: asker.component_id,
        param_id: CharArray::new(id),
        error: MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST,
    })
}

const PARAM_EXT_REQUEST_READ: u32 = 320;
const PARAM_EXT_REQUEST_LIST: u32 = 321;
const PARAM_EXT_SET: u32 = 323;

const MISSION_WRITE_PARTIAL_LIST: u32 = 38;
const MISSION_ITEM: u32 = 39;
const MISSION_REQUEST: u32 = 40;
const MISSION_REQUEST_LIST: u32 = 43;
const MISSION_COUNT: u32 = 44;
const MISSION_CLEAR_ALL: u32 = 45;
const MISSION_REQUEST_INT: u32 = 51;
const MISSION_ITEM_INT: u32 = 73;
const LOG_REQUEST_LIST: u32 = 117;
const LOG_REQUEST_DATA: u32 = 119;

/// The kind of list; `None` for an unknown number.
fn mission_type(number: u8) -> Option<MavMissionType> {
    match number {
        0 => Some(MavMissionType::MAV_MISSION_TYPE_MISSION),
        1 => Some(MavMissionType::MAV_MISSION_TYPE_FENCE),
        2 => Some(MavMissionType::MAV_MISSION_TYPE_RALLY),
        _ => None,
    }
}

struct List {
    target: Address,
    asker: Address,
    mission_type: Option<MavMissionType>,
}

impl List {
    fn empty(self) -> ListQuestion {
        let Some(mission_type) = self.mission_type else { return self.unsupported() };
        let answer = MISSION_COUNT_DATA {
            count: 0,
            target_system: self.asker.system_id,
            target_component: self.asker.component_id,
            mission_type,
            ..MISSION_COUNT_DATA::default()
        };
        ListQuestion { target: self.target, answer: MavMessage::MISSION_COUNT(answer) }
    }

    fn done(self) -> ListQuestion {
        self.acknowledge(MavMissionResult::MAV_MISSION_ACCEPTED)
    }

    fn unsupported(self) -> ListQuestion {
        self.acknowledge(MavMissionResult::MAV_MISSION_UNSUPPORTED)
    }

    fn acknowledge(self, result: MavMissionResult) -> ListQuestion {
        let answer = MISSION_ACK_DATA {
            target_system: self.asker.system_id,
            target_component: self.asker.component_id,
            mavtype: result,
            // An unknown kind is answered with "all".
            mission_type: self.mission_type.unwrap_or(MavMissionType::MAV_MISSION_TYPE_ALL),
            ..MISSION_ACK_DATA::default()
        };
        ListQuestion { target: self.target, answer: MavMessage::MISSION_ACK(answer) }
    }
}
