//! Answers messages that are not commands: questions about parameters, files and lists, and
//! requests for the log.

use alloc::borrow::ToOwned as _;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::{format, vec};
use core::time::Duration;

use flight::computer::messages::Severity;
use flight::rules::operator::Operator;
use flight::rules::phase::Phase;
use mavlink::types::CharArray;
use num_traits::FromPrimitive as _;
use protocol::dialect::{
    LOG_DATA_DATA, LOG_ENTRY_DATA, MISSION_ACK_DATA, MISSION_COUNT_DATA, MavMessage, MavMissionResult,
    MavMissionType, MavParamError, PARAM_ERROR_DATA, PARAM_EXT_ACK_DATA, ParamAck,
};
use protocol::frame::Frame;
use protocol::ftp::server::{Files, NoFiles, Server, Taken};
use protocol::ftp::{FileRequest, Opcode};
use protocol::identity::Address;
use protocol::parameter::{ParamKey, ParamQuestion, ParamRequest, error_message};

use super::{Path, VehicleEndpoint, operator_of, sender_of};
use crate::link::parameters;
use crate::link::vehicle::VehicleState;

impl VehicleEndpoint {
    /// Answers a question about parameters, files or lists; returns whether the frame was one.
    pub(super) fn on_question(&mut self, path: Path, frame: &Frame, vehicle: &VehicleState<'_>) -> bool {
        let link = path.link;
        if let Some(request) = FileRequest::from_frame(frame) {
            if self.us.accepts(request.target) {
                self.on_file_request(link, &request, operator_of(frame, vehicle), vehicle);
            }
            return true;
        }
        if let Some((target, answer)) = answer_about_list(frame) {
            if self.us.accepts(target) {
                self.lane(link).request(vec![answer]);
            }
            return true;
        }
        let Some(request) = ParamRequest::from_frame(frame) else { return false };
        if !self.us.accepts(request.target) {
            return true;
        }
        let (asker, by) = (frame.source(), operator_of(frame, vehicle));
        match request.question {
            // From the first one, also if an earlier list is not finished.
            ParamQuestion::List => self.lane(link).next_parameter = Some(0),
            ParamQuestion::Read(key) => {
                let lane = self.lane(link);
                let answer = match parameters::place_of(key) {
                    Some(place) => {
                        parameters::value(place, &lane.streams, &vehicle.mission().powered.weights)
                    }
                    None => error_message(key, MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, asker),
                };
                lane.request(vec![answer]);
            }
            ParamQuestion::Set { id, value, value_type } => {
                let station = self.stations.of(&sender_of(frame, path, vehicle));
                let forbidden = self.rates_forbidden(station, by, vehicle);
                let now_s = self.now_s;
                let set = self.with_rates_of(link, |streams| {
                    parameters::set(id, value, value_type, forbidden, streams, now_s)
                });
                let lane = self.lane(link);
                let (answer, refusal) = match set {
                    Ok((place, refusal)) => {
                        (parameters::value(place, &lane.streams, &vehicle.mission().powered.weights), refusal)
                    }
                    Err(refusal) => (error_message(ParamKey::Name(id), refusal.error, asker), Some(refusal)),
                };
                lane.answer(answer.into());
                if let Some(refusal) = refusal {
                    self.send_text(Severity::Warning, &refusal.reason);
                }
            }
        }
        true
    }
}

// Answers for lists that this vehicle does not have: missions, fences, rally points, logs on board,
// extended parameters.
//
// Other ground stations request them whatever the capabilities state, and report a failure to their
// user if there is no answer. So every request is answered: the lists are empty, and nothing can be
// put into them. Protocols: <https://mavlink.io/en/services/mission.html> and LOG_REQUEST_LIST of
// common.xml. Requests are parsed from raw bytes, because an unknown mission type must be answered,
// too.

/// Addressee of the question about a list in a frame, and the answer; `None` for any other message.
fn answer_about_list(frame: &Frame) -> Option<(Address, MavMessage)> {
    let (bytes, asker) = (frame.padded_payload(), frame.source());
    let integer = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let id = |at: usize| bytes[at..at + 16].first_chunk().copied().unwrap_or_default();
    let mission_ack = |kind_at: usize, result| acknowledged(asker, bytes[kind_at], result);
    let (target_at, answer) = match frame.message_id() {
        MISSION_REQUEST_LIST => (0, empty_list(asker, bytes[2])),
        // An upload of zero items clears the list, which is always clear.
        MISSION_COUNT if integer(0) == 0 => (2, mission_ack(4, MavMissionResult::MAV_MISSION_ACCEPTED)),
        MISSION_COUNT => (2, mission_ack(4, MavMissionResult::MAV_MISSION_UNSUPPORTED)),
        MISSION_CLEAR_ALL => (0, mission_ack(2, MavMissionResult::MAV_MISSION_ACCEPTED)),
        MISSION_REQUEST | MISSION_REQUEST_INT => {
            (2, mission_ack(4, MavMissionResult::MAV_MISSION_INVALID_SEQUENCE))
        }
        MISSION_WRITE_PARTIAL_LIST => (4, mission_ack(6, MavMissionResult::MAV_MISSION_UNSUPPORTED)),
        MISSION_ITEM | MISSION_ITEM_INT => (32, mission_ack(37, MavMissionResult::MAV_MISSION_UNSUPPORTED)),
        LOG_REQUEST_LIST => (4, MavMessage::LOG_ENTRY(LOG_ENTRY_DATA::default())),
        LOG_REQUEST_DATA => {
            let ofs = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            (10, MavMessage::LOG_DATA(LOG_DATA_DATA { ofs, id: integer(8), count: 0, data: [0; 90] }))
        }
        PARAM_EXT_REQUEST_READ => (2, no_parameter(id(4), integer(0).cast_signed(), asker)),
        PARAM_EXT_REQUEST_LIST => (0, no_parameter([0; 16], -1, asker)),
        PARAM_EXT_SET => {
            let failed = PARAM_EXT_ACK_DATA {
                param_id: CharArray::new(id(2)),
                param_result: ParamAck::PARAM_ACK_FAILED,
                ..PARAM_EXT_ACK_DATA::default()
            };
            (0, MavMessage::PARAM_EXT_ACK(failed))
        }
        _ => return None,
    };
    let target = Address { system_id: bytes[target_at], component_id: bytes[target_at + 1] };
    Some((target, answer))
}

/// There are no extended parameters. The standard has no answer for that to a question; this is the
/// one of the parameters.
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

/// The list of this kind of mission has no item.
fn empty_list(asker: Address, kind: u8) -> MavMessage {
    match MavMissionType::from_u8(kind) {
        None | Some(MavMissionType::MAV_MISSION_TYPE_ALL) => {
            acknowledged(asker, kind, MavMissionResult::MAV_MISSION_UNSUPPORTED)
        }
        Some(mission_type) => MavMessage::MISSION_COUNT(MISSION_COUNT_DATA {
            count: 0,
            target_system: asker.system_id,
            target_component: asker.component_id,
            mission_type,
            ..MISSION_COUNT_DATA::default()
        }),
    }
}

fn acknowledged(asker: Address, kind: u8, result: MavMissionResult) -> MavMessage {
    MavMessage::MISSION_ACK(MISSION_ACK_DATA {
        target_system: asker.system_id,
        target_component: asker.component_id,
        mavtype: result,
        // An unknown kind is answered with "all".
        mission_type: MavMissionType::from_u8(kind).unwrap_or(MavMissionType::MAV_MISSION_TYPE_ALL),
        ..MISSION_ACK_DATA::default()
    })
}

// Serves the vehicle's log (MAVLink FTP) while a reduced telemetry is safe: on the ground,
// disarmed.

flight::with_defaults! {
    /// The log's files, and the clients' requests.
    pub(super) struct FileService {
        server: Server = Server::default(),
        files: Box<dyn Files + Send> = Box::new(NoFiles),
    }
}

impl FileService {
    /// Whether a client reads over one of these links.
    pub(super) fn is_busy(&self, links: &[usize], now_s: f64) -> bool {
        let now = Duration::from_secs_f64(now_s);
        links.iter().any(|link| self.server.is_busy(*link, now))
    }

    pub(super) fn next_answer(&mut self, links: &[usize]) -> Option<MavMessage> {
        links.iter().find_map(|link| self.server.next_answer(*link))
    }

    pub(super) fn next_piece(&mut self, links: &[usize], now_s: f64) -> Option<MavMessage> {
        let now = Duration::from_secs_f64(now_s);
        links.iter().find_map(|link| self.server.next_piece(*link, &mut *self.files, now))
    }
}

/// Whether the vehicle gives out its log: it is disarmed, and on its pad or safe on the ground.
pub fn gives_out_its_log(vehicle: &VehicleState<'_>) -> bool {
    let phase = vehicle.phase();
    !vehicle.mode().interlocks.armed && (phase.on_pad() || matches!(phase, Phase::Touchdown | Phase::Safed))
}

impl VehicleEndpoint {
    /// Offers these files from now on. They must not change any more.
    pub fn offer(&mut self, files: Box<dyn Files + Send>) {
        // Requests for other files are void.
        self.files = FileService { server: Server::default(), files };
    }

    /// Takes a request for a file. A reading link gets a separate lane: its files and its reduced
    /// telemetry affect no other link.
    pub(super) fn on_file_request(
        &mut self,
        link: usize,
        request: &FileRequest,
        by: Option<Operator>,
        vehicle: &VehicleState<'_>,
    ) {
        let forbidden = why_forbidden(by, vehicle);
        if forbidden.is_none() && request.packet.opcode == Opcode::OPEN_FILE_RO {
            self.separate(link);
        }
        let FileService { server, files } = &mut self.files;
        let now = Duration::from_secs_f64(vehicle.time_s);
        let taken = server.take(request, link, forbidden.is_none(), &**files, now);
        if let (Taken::NotNow, Some(why)) = (taken, forbidden) {
            self.send_text(Severity::Warning, &why);
        }
    }

    /// Continues long operations, and closes every file when the vehicle must not serve them any
    /// more.
    pub(super) fn serve_files(&mut self, vehicle: &VehicleState<'_>) {
        let FileService { server, files } = &mut self.files;
        if gives_out_its_log(vehicle) {
            server.work(&mut **files);
        } else {
            server.close_all();
        }
    }
}

/// Why this client may not read now, if so.
fn why_forbidden(by: Option<Operator>, vehicle: &VehicleState<'_>) -> Option<String> {
    if !vehicle.operators.is_empty() && by.is_none() {
        return Some("log refused: only an operator with a key of their own fetches it".to_owned());
    }
    let armed = if vehicle.mode().interlocks.armed { ", armed" } else { "" };
    (!gives_out_its_log(vehicle)).then(|| {
        format!("log refused: found {}{armed}, required disarmed and on the ground", vehicle.phase().name())
    })
}
