//! Tests requests of other ground stations, unrequested messages, and reports of stations to the
//! vehicle.

use protocol::dialect::{
    ATTITUDE_DATA, AUTOPILOT_VERSION_DATA, BATTERY_STATUS_DATA, CURRENT_MODE_DATA, GLOBAL_POSITION_INT_DATA,
    GPS_RAW_INT_DATA, HOME_POSITION_DATA, LOCAL_POSITION_NED_DATA, LOG_ENTRY_DATA, MISSION_ACK_DATA,
    MISSION_COUNT_DATA, MavMissionResult, MavParamError, MavProtocolCapability, ParamAck, SYS_STATUS_DATA,
    TD_BOOK_HEAD_DATA, TD_BOOK_KEPT_DATA, VFR_HUD_DATA,
};
use protocol::identity::NETWORK_BUDGET_BYTES_S;
use protocol::mission::MissionHash;

use avionics::link::vehicle::Identity;

use super::*;

const SIMULATED: Identity = Identity { kind: VehicleKind::Simulated, boot_number: 0, uid: 5 };

impl Wire {
    /// The answer to a question with these bytes.
    fn question(&mut self, message_id: u32, payload: &[u8]) -> Vec<Frame> {
        let frame = self.ground.encode_payload(message_id, payload).unwrap();
        self.endpoint.on_frame(0, &frame, &self.vehicle.state());
        self.run(0.3)
    }
}

#[test]
fn mission_fence_and_rally_lists_are_empty_and_other_types_are_unsupported() {
    let mut wire = Wire::new();
    for mission_type in 0..3u8 {
        let sent = wire.question(43, &[1, 1, mission_type]);
        let list = decoded!(sent, MISSION_COUNT).next().unwrap();
        assert_eq!((list.count, list.mission_type as u8), (0, mission_type));
        assert_eq!((list.target_system, list.target_component), (255, 190));
    }
    let sent = wire.question(43, &[1, 1, 77]);
    assert_eq!((count(&sent, MISSION_COUNT_DATA::ID), count(&sent, MISSION_ACK_DATA::ID)), (0, 1));
    // For another vehicle.
    let sent = wire.question(43, &[2, 1, 0]);
    assert_eq!((count(&sent, MISSION_COUNT_DATA::ID), count(&sent, MISSION_ACK_DATA::ID)), (0, 0));
}

#[test]
fn nothing_can_be_put_into_a_list_and_clearing_one_is_done() {
    let item = |mission_type: u8| {
        let mut bytes = [0; 38];
        bytes[32..34].copy_from_slice(&[1, 1]);
        bytes[37] = mission_type;
        bytes.to_vec()
    };
    let mut wire = Wire::new();
    for (message_id, payload, result, mission_type) in [
        (44, vec![3, 0, 1, 1, 1], MavMissionResult::MAV_MISSION_UNSUPPORTED, 1),
        (44, vec![0, 0, 1, 1, 2], MavMissionResult::MAV_MISSION_ACCEPTED, 2),
        (45, vec![1, 1, 1], MavMissionResult::MAV_MISSION_ACCEPTED, 1),
        (38, vec![0, 0, 2, 0, 1, 1, 0], MavMissionResult::MAV_MISSION_UNSUPPORTED, 0),
        (40, vec![0, 0, 1, 1, 0], MavMissionResult::MAV_MISSION_INVALID_SEQUENCE, 0),
        (51, vec![4, 0, 1, 1, 2], MavMissionResult::MAV_MISSION_INVALID_SEQUENCE, 2),
        (39, item(0), MavMissionResult::MAV_MISSION_UNSUPPORTED, 0),
        (73, item(2), MavMissionResult::MAV_MISSION_UNSUPPORTED, 2),
    ] {
        let sent = wire.question(message_id, &payload);
        let answer =
            decoded!(sent, MISSION_ACK).next().unwrap_or_else(|| panic!("message {message_id} is answered"));
        assert_eq!(
            (answer.mavtype, answer.mission_type as u8),
            (result, mission_type),
            "message {message_id}"
        );
        assert_eq!((answer.target_system, answer.target_component), (255, 190));
    }
}

#[test]
fn the_list_of_logs_on_board_is_empty() {
    let mut wire = Wire::new();
    let sent = wire.question(117, &[0, 0, 0xFF, 0xFF, 1, 1]);
    let entry = decoded!(sent, LOG_ENTRY).next();
    assert_eq!(entry, Some(LOG_ENTRY_DATA::default()));
    let sent = wire.question(119, &[7, 0, 0, 0, 90, 0, 0, 0, 3, 0, 1, 1]);
    let data = decoded!(sent, LOG_DATA).next().map(|data| (data.ofs, data.id, data.count));
    assert_eq!(data, Some((7, 3, 0)));
}

#[test]
fn home_is_the_pad_and_the_compass_shows_where_the_belly_points() {
    let mut wire = Wire::new();
    let request = asking(410, [0.0; 7]);
    wire.endpoint.on_command(0, (&request, None), &wire.vehicle.state());
    let sent = wire.run(1.5);
    let home =
        decoded!(sent, HOME_POSITION).next().map(|home| (home.latitude, home.longitude, home.altitude));
    assert_eq!(home, Some((353_470_000, -1_178_090_000, 625_000)));
    // Released in the plane north of the pad, nose up: heading north.
    let hud = avionics::link::telemetry::message(VFR_HUD_DATA::ID, &wire.vehicle.state(), SIMULATED);
    assert!(matches!(&hud, Some(MavMessage::VFR_HUD(hud)) if hud.heading == 0), "{hud:?}");
    let mut flight = load_flight("mk2").unwrap();
    flight.recipe.mission.site.altitude_m = 510.0;
    let vehicle = Vehicle::on_the_pad(&flight).unwrap();
    let high = avionics::link::telemetry::message(VFR_HUD_DATA::ID, &vehicle.state(), SIMULATED);
    let above_sea = matches!(&high, Some(MavMessage::VFR_HUD(hud)) if (hud.alt - 510.0).abs() < 1e-3);
    assert!(above_sea, "above mean sea level: {high:?}");
}

#[test]
fn a_forced_disarm_disarms_on_the_pad_and_in_the_countdown_and_aborts_in_flight() {
    for code in [21196.0, 2989.0] {
        let mut wire = Wire::new();
        assert_eq!(wire.request(400, 1.0, 0.0).0, 0);
        assert_eq!(wire.request(400, 0.0, code).0, 0);
        assert!(!wire.vehicle.mode().interlocks.armed && !wire.vehicle.aborted(), "on the pad");
        assert_eq!(wire.request(400, 1.0, 0.0).0, 0, "nothing is latched");
        assert_eq!(wire.request(300, 0.0, 0.0).0, 0);
        wire.run(1.0);
        assert_eq!(wire.request(400, 0.0, code).0, 0);
        let mode = wire.vehicle.mode();
        assert!(!mode.interlocks.armed && mode.countdown_end_s.is_none() && !wire.vehicle.aborted());
        assert_eq!(wire.request(400, 1.0, 0.0).0, 0);
        assert_eq!(wire.request(300, 0.0, 0.0).0, 0);
        wire.run(wire.vehicle.computer().countdown_s() + 1.0);
        assert!(!wire.vehicle.phase().on_pad());
        assert_eq!(wire.request(400, 0.0, 0.0).0, DENIED, "unforced it stays refused");
        assert!(!wire.vehicle.aborted());
        assert_eq!(wire.request(400, 0.0, code).0, 0);
        assert!(wire.vehicle.aborted(), "in flight it is an abort");
    }
}

impl Wire {
    /// A command of the station with this number; returns the answers.
    fn numbered(&mut self, param1: f32, number: u32) -> Vec<CommandAnswer> {
        let command = command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, param1);
        self.transmit(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA { param2: number as f32, ..command }));
        self.run(0.1).iter().filter_map(CommandAnswer::from_frame).collect()
    }
}

#[test]
fn a_repeated_arming_is_answered_again_and_arms_nothing_that_was_disarmed_or_aborted_since() {
    let mut wire = Wire::new();
    wire.beats = true;
    wire.run(1.0);
    let told = |answers: Vec<CommandAnswer>| {
        answers.iter().map(|answer| (answer.result, answer.detail)).collect::<Vec<_>>()
    };
    assert_eq!(told(wire.numbered(1.0, 70_000)), [(0, 70_000)]);
    assert_eq!(told(wire.numbered(1.0, 70_000)), [(0, 70_000)]);
    assert!(wire.vehicle.mode().interlocks.armed);
    assert_eq!(told(wire.numbered(0.0, 70_001)), [(0, 70_001)]);
    assert_eq!(told(wire.numbered(1.0, 70_000)), [(0, 70_000)], "it was done");
    assert!(!wire.vehicle.mode().interlocks.armed);
    assert_eq!(told(wire.numbered(1.0, 70_002)), [(0, 70_002)], "another one");
    assert!(wire.vehicle.mode().interlocks.armed);
    assert_eq!(wire.request(185, 1.0, 0.0).0, 0);
    for number in [70_000, 70_002] {
        wire.numbered(1.0, number);
        assert!(!wire.vehicle.mode().interlocks.armed);
    }
}

#[test]
fn a_radio_s_report_from_another_address_thins_nothing() {
    let mut wire = Wire::new();
    let report = MavMessage::RADIO_STATUS(protocol::dialect::RADIO_STATUS_DATA::default());
    let before = wire.run(10.0).len();
    let mut sent = 0;
    for _ in 0..10 {
        wire.transmit(&report);
        sent += wire.run(1.0).len();
    }
    assert!(sent + 5 > before, "{sent} of {before} frames");
}

#[test]
fn every_command_of_a_flood_is_answered_or_refused_and_no_flood_of_aborts_grows_without_end() {
    let mut wire = Wire::new();
    for system_id in 2..=254 {
        for component_id in [1, 190] {
            let mut sender = Encoder::new(Address { system_id, component_id });
            let abort = COMMAND_LONG_DATA {
                param1: 1.0,
                command: MavCmd::MAV_CMD_DO_FLIGHTTERMINATION,
                ..COMMAND_LONG_DATA::default()
            };
            let frame = sender.encode(&MavMessage::COMMAND_LONG(abort));
            wire.endpoint.on_frame(0, &frame, &wire.vehicle.state());
        }
    }
    let waiting = |wire: &Wire| wire.endpoint.uplink_state(wire.vehicle.time_s()).requests.len();
    let mut decided = Vec::new();
    while waiting(&wire) > 0 {
        decided.push(waiting(&wire));
        wire.run(0.005);
        assert!(wire.vehicle.mode().interlocks.abort_latched, "in the first frame");
    }
    assert_eq!(decided, [8; 8]);
}

#[test]
fn an_abort_is_decided_before_a_flood_of_other_commands() {
    let mut wire = Wire::new();
    for number in 0..64 {
        let command = asking(ARM, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, number as f32]);
        wire.endpoint.on_command(0, (&command, None), &wire.vehicle.state());
    }
    let abort = asking(185, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    wire.endpoint.on_command(0, (&abort, None), &wire.vehicle.state());
    wire.run(0.005);
    assert!(wire.vehicle.mode().interlocks.abort_latched);
}

#[test]
fn twenty_unknown_commands_at_ten_a_second_are_each_answered() {
    let mut wire = Wire::new();
    let mut answers = Vec::new();
    for command in 30_000..30_020 {
        let request = asking(command, [0.0; 7]);
        wire.endpoint.on_command(0, (&request, None), &wire.vehicle.state());
        answers.extend(wire.run(0.1).iter().filter_map(CommandAnswer::from_frame));
    }
    answers.extend(wire.run(0.5).iter().filter_map(CommandAnswer::from_frame));
    let answers: Vec<_> = answers.iter().map(|answer| (answer.command, answer.result)).collect();
    let unsupported = MavResult::MAV_RESULT_UNSUPPORTED as u8;
    assert_eq!(answers, (30_000..30_020).map(|command| (command, unsupported)).collect::<Vec<_>>());
}

#[test]
fn what_cannot_be_cancelled_is_answered() {
    let mut wire = Wire::new();
    for (command, ours) in [(ARM, true), (CHECK, true), (ARM, false)] {
        let [low, high] = command.to_le_bytes();
        let sent = wire.question(80, &[low, high, if ours { 1 } else { 2 }, 1]);
        let answers: Vec<_> = sent.iter().filter_map(CommandAnswer::from_frame).collect();
        assert_eq!(answers.len(), usize::from(ours));
        assert!(answers.iter().all(|answer| (answer.command, answer.result) == (command, DENIED)));
    }
}

/// A verdict before the landing, a message of crews without a crew, an unknown one.
#[test]
fn a_message_without_content_is_refused_for_now_and_an_unknown_one_for_ever() {
    let mut wire = Wire::new();
    for (message_id, result) in [
        (TD_LANDING_VERDICT_DATA::ID, MavResult::MAV_RESULT_TEMPORARILY_REJECTED),
        (protocol::dialect::TD_CREW_DATA::ID, MavResult::MAV_RESULT_UNSUPPORTED),
        (9_999, MavResult::MAV_RESULT_UNSUPPORTED),
    ] {
        assert_eq!(wire.request(512, message_id as f32, 0.0).0, result as u8, "message {message_id}");
    }
}

#[test]
fn the_version_announces_files_and_has_an_id_and_a_hash() {
    let mut wire = Wire::new();
    wire.endpoint = VehicleEndpoint::new(VehicleKind::Simulated).with_uid(77);
    assert_eq!(wire.request(520, 1.0, 0.0).0, 0);
    let sent = wire.run(1.0);
    let version = decoded!(sent, AUTOPILOT_VERSION).next();
    // It may have arrived with the answer.
    let now = avionics::link::telemetry::message(
        AUTOPILOT_VERSION_DATA::ID,
        &wire.vehicle.state(),
        Identity { uid: 77, ..SIMULATED },
    );
    let Some(MavMessage::AUTOPILOT_VERSION(now)) = now else { panic!("it always has content") };
    assert!(version.is_none_or(|version| version == now));
    assert!(now.capabilities.contains(MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_FTP));
    assert_eq!(now.uid & 0xFFFF_FFFF, 77);
    assert_ne!((now.uid, now.flight_custom_version), (77, [0; 8]));
}

#[test]
fn there_are_no_extended_parameters_and_every_question_is_answered() {
    let mut wire = Wire::new();
    let mut read = [0; 20];
    read[..4].copy_from_slice(&[0xFF, 0xFF, 1, 1]);
    read[4..8].copy_from_slice(b"NAME");
    for question in [(320, &read[..]), (321, &[1, 1])] {
        let sent = wire.question(question.0, question.1);
        let error = decoded!(sent, PARAM_ERROR)
            .next()
            .map(|error| (error.error, error.target_system, error.param_index));
        assert_eq!(error, Some((MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, 255, -1)));
    }
    let mut set = [0; 147];
    set[..6].copy_from_slice(&[1, 1, b'N', b'A', b'M', b'E']);
    let sent = wire.question(323, &set);
    let answer = decoded!(sent, PARAM_EXT_ACK).next().map(|answer| (answer.param_result, answer.param_id));
    let (result, id) = answer.expect("an answer");
    assert_eq!(result, ParamAck::PARAM_ACK_FAILED);
    assert_eq!(id.to_str(), Ok("NAME"));
    assert!(texts(&wire.run(1.0)).is_empty(), "no words about it");
}

// Tests the messages that a standard ground station gets without a request.

const OF_EVERY_VEHICLE: [u32; 7] = [
    ATTITUDE_DATA::ID,
    GLOBAL_POSITION_INT_DATA::ID,
    GPS_RAW_INT_DATA::ID,
    HOME_POSITION_DATA::ID,
    SYS_STATUS_DATA::ID,
    VFR_HUD_DATA::ID,
    CURRENT_MODE_DATA::ID,
];

#[test]
fn over_a_radio_a_standard_station_gets_its_requests_and_fast_messages_slow_down() {
    for (endpoint, signature_len) in [
        (VehicleEndpoint::new(VehicleKind::Simulated), 0),
        (VehicleEndpoint::sending_signed(VehicleKind::Simulated), SIGNATURE_LEN),
    ] {
        let mut wire = Wire { endpoint, ..Wire::new() };
        let before = count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID);
        for message_id in OF_EVERY_VEHICLE {
            let result = wire.request(511, message_id as f32, 1e6).0;
            assert_eq!(result, ACCEPTED, "message {message_id}");
        }
        wire.run(2.0);
        let sent = wire.run(10.0);
        for message_id in OF_EVERY_VEHICLE {
            assert!((9..=11).contains(&count(&sent, message_id)), "message {message_id} at 1 Hz");
        }
        let attitudes = count(&sent, ATTITUDE_QUATERNION_DATA::ID);
        assert!((29..before).contains(&attitudes), "{attitudes} attitudes in 10 s after {before}");
        let bytes: usize = sent.iter().map(|frame| frame.as_bytes().len() + signature_len).sum();
        assert!(bytes <= 10 * RADIO_BUDGET_BYTES_S as usize, "{bytes} B in 10 s");
        for message_id in OF_EVERY_VEHICLE {
            assert_eq!(wire.request(511, message_id as f32, 0.0).0, 0);
        }
        let again = count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID);
        assert!(again.abs_diff(before) <= 1, "{again} again, {before} before");
    }
}

#[test]
fn the_rates_of_every_kind_of_link_fit_it() {
    for (signature_len, crew) in [(0, false), (SIGNATURE_LEN, false), (SIGNATURE_LEN, true)] {
        for capacity_bytes_s in [384, 768, 1_536, RADIO_BUDGET_BYTES_S, 4_608, NETWORK_BUDGET_BYTES_S] {
            let mut streams = Streams::over_a_radio(signature_len, crew);
            streams.set_capacity(capacity_bytes_s);
            let words = format!("{:.0} of {capacity_bytes_s} B/s", streams.bytes_s());
            assert!(streams.fit(), "{words}");
            let rate = |message_id| streams.rate_hz(message_id);
            let position = rate(LOCAL_POSITION_NED_DATA::ID);
            assert!(rate(HEARTBEAT_DATA::ID) >= 1.0 && rate(TD_FLIGHT_STATUS_DATA::ID) >= 1.0, "{words}");
            assert!(rate(GLOBAL_POSITION_INT_DATA::ID) >= 0.5, "where it lies, at least every 2 s: {words}");
            let least_hz = if capacity_bytes_s >= RADIO_BUDGET_BYTES_S { 3.0 } else { 0.45 };
            assert!(position >= least_hz, "{words}: {position} Hz");
            if capacity_bytes_s >= NETWORK_BUDGET_BYTES_S {
                assert!(OF_EVERY_VEHICLE.iter().all(|id| rate(*id) >= 1.0), "{words}");
                assert!(rate(BATTERY_STATUS_DATA::ID) >= 1.0);
            }
        }
    }
}

// Reports of stations about themselves: the end of their book, and their expected mission.

fn send_head(wire: &mut Wire, head: TD_BOOK_HEAD_DATA) -> Vec<TD_BOOK_KEPT_DATA> {
    wire.transmit(&MavMessage::TD_BOOK_HEAD(head));
    let sent = wire.run(0.5);
    let kept = decoded!(sent, TD_BOOK_KEPT);
    kept.collect()
}

#[test]
fn the_end_of_a_book_is_confirmed_to_the_station_that_sent_it() {
    let mut wire = Wire::new();
    let head = TD_BOOK_HEAD_DATA {
        book: 77,
        entries: 5,
        target_system: 1,
        target_component: 1,
        ..TD_BOOK_HEAD_DATA::default()
    };
    let kept = send_head(&mut wire, head.clone());
    let [kept] = &kept[..] else { panic!("{kept:?}") };
    assert_eq!((kept.book, kept.entries), (77, 5));
    assert_eq!((kept.target_system, kept.target_component), (GROUND.system_id, GROUND.component_id));
    assert!(
        send_head(&mut wire, TD_BOOK_HEAD_DATA { target_system: 2, ..head }).is_empty(),
        "for another vehicle"
    );
}

/// A flood of ends takes no more of the link than any other requests.
#[test]
fn a_flood_of_ends_is_answered_within_the_budget() {
    let mut wire = Wire::new();
    for entries in 0..2_000 {
        let head = TD_BOOK_HEAD_DATA {
            entries,
            target_system: 1,
            target_component: 1,
            ..TD_BOOK_HEAD_DATA::default()
        };
        wire.transmit(&MavMessage::TD_BOOK_HEAD(head));
    }
    let sent = wire.run(1.0);
    let bytes: usize = sent.iter().map(|frame| frame.as_bytes().len()).sum();
    assert!(bytes <= 2 * RADIO_BUDGET_BYTES_S as usize, "{bytes} B");
    assert!(count(&sent, HEARTBEAT_DATA::ID) >= 1);
}

fn arm_for(wire: &mut Wire, params: [f32; 3]) -> (u8, String) {
    wire.beats = true;
    wire.beat();
    wire.run(0.5);
    let [param4, param5, param6] = params;
    let arm = command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0);
    wire.transmit(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA { param4, param5, param6, ..arm }));
    let sent = wire.run(0.5);
    let answers: Vec<_> = sent.iter().filter_map(CommandAnswer::from_frame).collect();
    assert_eq!((answers.len(), answers[0].command), (1, ARM));
    (answers[0].result, texts(&sent).join("; "))
}

#[test]
fn another_mission_is_not_armed_whatever_the_station_shows() {
    let fresh = || {
        let mut wire = Wire::new();
        wire.vehicle = rocket().of_mission("mk2", "the right one");
        wire
    };
    let ours = MissionHash::of("the right one");
    let other = MissionHash::of("another one");
    let mut wire = fresh();
    let (result, words) = arm_for(&mut wire, other.to_params());
    assert_eq!(result, DENIED, "{words}");
    assert!(words.contains(&format!("this vehicle flies mk2 {ours}, not {other}")), "{words}");
    assert!(!wire.vehicle.mode().interlocks.armed);
    let (result, words) = arm_for(&mut wire, [1.0, 0.0, 0.0]);
    assert_eq!(result, DENIED, "{words}");
    assert!(!wire.vehicle.mode().interlocks.armed);
    for params in [ours.to_params(), [0.0; 3], [f32::NAN; 3]] {
        let mut wire = fresh();
        let (result, words) = arm_for(&mut wire, params);
        assert_eq!(result, ACCEPTED, "{words}");
    }
}
