//! Tests requests of other clients about parameters, files and versions, and the vehicle's log over
//! FTP.

use avionics::link::parameters;
use flight::computer::FRAME_S;
use mavlink::types::CharArray;
use protocol::dialect::{
    FILE_TRANSFER_PROTOCOL_DATA, MavParamError, MavParamType, PARAM_REQUEST_LIST_DATA,
    PARAM_REQUEST_READ_DATA, PARAM_SET_DATA, PARAM_VALUE_DATA,
};
use protocol::ftp::download::{Download, DownloadEvent, Failure};
use protocol::ftp::packet::Refusal;
use protocol::ftp::server::InMemory;
use protocol::ftp::{Opcode, Packet};
use protocol::identity::VEHICLE;

use super::*;

fn name(text: &str) -> CharArray<16> {
    let mut bytes = [0; 16];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    CharArray::new(bytes)
}

fn values(frames: &[Frame]) -> Vec<PARAM_VALUE_DATA> {
    let value = |frame: &Frame| match frame.decode() {
        Ok(MavMessage::PARAM_VALUE(value)) => Some(value),
        _ => None,
    };
    frames.iter().filter_map(value).collect()
}

impl Wire {
    fn set(&mut self, id: &str, value: f32, param_type: MavParamType) -> (Vec<PARAM_VALUE_DATA>, String) {
        self.transmit(&MavMessage::PARAM_SET(PARAM_SET_DATA {
            param_value: value,
            target_system: 1,
            target_component: 1,
            param_id: name(id),
            param_type,
        }));
        let sent = self.run(0.5);
        (values(&sent), texts(&sent).join("; "))
    }

    fn set_real(&mut self, id: &str, value: f32) -> (f32, String) {
        let (values, words) = self.set(id, value, MavParamType::MAV_PARAM_TYPE_REAL32);
        assert_eq!(values.len(), 1, "one answer to one PARAM_SET");
        (values[0].param_value, words)
    }
}

#[test]
fn the_list_is_complete_in_order_and_does_not_crowd_out_telemetry() {
    let mut wire = Wire::new();
    wire.transmit(&MavMessage::PARAM_REQUEST_LIST(PARAM_REQUEST_LIST_DATA {
        target_system: 1,
        target_component: 0,
    }));
    let sent = wire.run(10.0);
    let places: Vec<u16> = values(&sent).iter().map(|value| value.param_index).collect();
    let parameters = parameters::COUNT;
    assert_eq!(places, (0..parameters).collect::<Vec<_>>());
    assert!(values(&sent).iter().all(|value| value.param_count == parameters));
    let attitudes = count(&sent, ATTITUDE_QUATERNION_DATA::ID);
    assert!(attitudes >= 79, "{attitudes} in 10 s at 8 Hz");
}

#[test]
fn a_parameter_is_read_by_name_or_index_and_a_missing_one_is_reported() {
    let mut wire = Wire::new();
    let read = |param_id, param_index| {
        MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
            param_index,
            target_system: 1,
            target_component: 1,
            param_id,
        })
    };
    wire.transmit(&read(name("NMPC_W_THETA"), -1));
    wire.transmit(&read(name("ignored"), 0));
    let found: Vec<f32> = values(&wire.run(0.5)).iter().map(|value| value.param_value).collect();
    assert_eq!(found, [200.0, 1.0]);
    wire.transmit(&read(name("NO_SUCH"), -1));
    wire.transmit(&read(name(""), 999));
    let errors = wire.run(0.5).into_iter().filter(|frame| {
        matches!(frame.decode(), Ok(MavMessage::PARAM_ERROR(error))
            if error.error == MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST)
    });
    assert_eq!(errors.count(), 2);
}

#[test]
fn a_rate_is_set_within_the_budget_and_every_set_is_answered_with_what_holds() {
    let mut wire = Wire::new();
    assert_eq!(wire.set_real("RATE_FINS", 4.0), (4.0, String::new()));
    let found = count(&wire.run(3.0), TD_FINS_DATA::ID);
    assert!((11..=13).contains(&found), "{found} in 3 s at 4 Hz");
    for (id, value, holds, why) in [
        ("RATE_FINS", 1000.0, 4.0, "budget is 2000"),
        ("RATE_FINS", -3.0, 4.0, "must be"),
        ("RATE_GIMBAL", f32::NAN, 3.0, "must be"),
        // The fins take its room.
        ("RATE_POSITION", f32::INFINITY, 7.0, "must be"),
        ("RATE_HEARTBEAT", 0.0, 1.0, "vital messages"),
        ("NMPC_W_Q", 51.0, 0.0, "from the mission"),
    ] {
        // Texts have a share of each second.
        wire.run(1.0);
        let (found, words) = wire.set_real(id, value);
        assert_eq!(found.to_bits(), f32::to_bits(holds), "{id} = {value}");
        assert!(words.contains(why), "{id} = {value}: {words}");
    }
    let (values, _) = wire.set("RATE_FINS", 2.0, MavParamType::MAV_PARAM_TYPE_INT32);
    assert_eq!(values[0].param_value.to_bits(), 4.0f32.to_bits());
    let (values, words) = wire.set("TOUCHDOWN_U", 9.0, MavParamType::MAV_PARAM_TYPE_REAL32);
    assert!(values.is_empty() && !words.is_empty(), "{words}");
    assert_eq!(wire.set_real("RATE_FINS", 0.0).0.to_bits(), 0.0f32.to_bits());
    assert_eq!(count(&wire.run(2.0), TD_FINS_DATA::ID), 0, "switched off");
}

/// Both methods to set a rate, used by a station.
fn set_rates(wire: &mut Wire, station: Address) -> (u8, f32) {
    let ground = std::mem::replace(&mut wire.ground, Encoder::new(station));
    let request = CommandRequest {
        source: station,
        target: VEHICLE,
        command: 511,
        params: [TD_FINS_DATA::ID as f32, 500_000.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        confirmation: 0,
    };
    wire.endpoint.on_command(0, (&request, None), &wire.vehicle.state());
    let sent = wire.run(0.2);
    let answer = sent.iter().find_map(CommandAnswer::from_frame).unwrap();
    let (rate_hz, _) = wire.set_real("RATE_FINS", 1.0);
    wire.ground = ground;
    (answer.result, rate_hz)
}

#[test]
fn while_armed_only_the_station_that_armed_sets_rates_in_flight_too() {
    let other = Address { system_id: 254, component_id: 190 };
    let mut wire = Wire::new();
    assert_eq!(set_rates(&mut wire, other).0, 0, "before arming every station may");
    assert_eq!(wire.request(400, 1.0, 0.0).0, 0);
    // A second arm is accepted, because the vehicle is armed, but it does not transfer the right to
    // set rates.
    let again = CommandRequest {
        source: other,
        target: VEHICLE,
        command: 400,
        params: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        confirmation: 0,
    };
    wire.endpoint.on_command(0, (&again, None), &wire.vehicle.state());
    wire.run(0.2);
    assert_eq!(wire.set_real("RATE_FINS", 4.0).0.to_bits(), 4.0f32.to_bits());
    assert_eq!(wire.request(300, 0.0, 0.0).0, 0);
    wire.run(wire.vehicle.computer().countdown_s() + 2.0);
    assert!(!wire.vehicle.phase().on_pad(), "{:?}", wire.vehicle.phase());
    let (result, rate_hz) = set_rates(&mut wire, other);
    assert_eq!((result, rate_hz.to_bits()), (DENIED, 4.0f32.to_bits()));
    let (result, rate_hz) = set_rates(&mut wire, GROUND);
    assert_eq!(
        (result, rate_hz.to_bits()),
        (0, 1.0f32.to_bits()),
        "the station that armed may, in flight too"
    );
}

#[test]
fn questions_for_another_system_are_left_alone() {
    let mut wire = Wire::new();
    wire.transmit(&MavMessage::PARAM_REQUEST_LIST(PARAM_REQUEST_LIST_DATA {
        target_system: 2,
        target_component: 1,
    }));
    wire.transmit(&MavMessage::FILE_TRANSFER_PROTOCOL(FILE_TRANSFER_PROTOCOL_DATA {
        target_system: 2,
        target_component: 1,
        ..FILE_TRANSFER_PROTOCOL_DATA::default()
    }));
    let sent = wire.run(2.0);
    assert!(values(&sent).is_empty() && count(&sent, FILE_TRANSFER_PROTOCOL_DATA::ID) == 0);
}

// Tests the vehicle's log over MAVLink FTP: within the link's budget, beside telemetry, and refused
// while armed.

/// A log of this length, as the recorder would offer it.
pub(super) fn log(len: usize) -> InMemory {
    InMemory::new([("flight.mcap", content(len))])
}

fn content(len: usize) -> Vec<u8> {
    (0..len).map(|n| (n % 251) as u8).collect()
}

impl Wire {
    fn request_file(&mut self, packet: &Packet) {
        let frame = self.ground.encode(&packet.message(VEHICLE));
        self.endpoint.on_frame(0, &frame, &self.vehicle.state());
    }

    /// The answers to one request, and the texts.
    fn file_answers(&mut self, opcode: Opcode, path: &str) -> (Option<Refusal>, String) {
        self.request_file(&Packet::request(7, 0, opcode, 0, path));
        let sent = self.run(0.5);
        let answer = sent.iter().find_map(Packet::answer_in).expect("an answer");
        (answer.1.refusal(), texts(&sent).join("; "))
    }

    /// Fetches the file for at most this long; returns the file, and the sent frames with their
    /// times.
    fn fetch(&mut self, download: &mut Download, most_s: f64) -> (Vec<u8>, Vec<(f64, Frame)>) {
        let (mut file, mut all) = (Vec::new(), Vec::new());
        let end_s = self.vehicle.time_s() + most_s;
        while self.vehicle.time_s() < end_s && download.ended().is_none() {
            let now = Duration::from_secs_f64(self.vehicle.time_s());
            for packet in download.poll(now) {
                self.request_file(&packet);
            }
            for frame in self.run(0.5 * FRAME_S) {
                if let Some((_, packet)) = Packet::answer_in(&frame)
                    && let Some(DownloadEvent::Data(data)) = download.take(&packet, now)
                {
                    file.extend(data);
                }
                all.push((self.vehicle.time_s(), frame));
            }
        }
        (file, all)
    }
}

#[test]
fn a_log_fills_the_link_within_its_budget_and_telemetry_continues() {
    // Of a radio's budget, six pieces fit into any second, and a seventh does not.
    for (capacity_bytes_s, signature_len, least) in [(2000, 0, 0.75), (5760, 0, 0.8), (5760, 13, 0.8)] {
        let endpoint = match signature_len {
            0 => VehicleEndpoint::new(VehicleKind::Simulated),
            _ => VehicleEndpoint::sending_signed(VehicleKind::Simulated),
        };
        let mut wire = Wire { endpoint: endpoint.over_links(&[capacity_bytes_s]), ..Wire::new() };
        wire.endpoint.offer(Box::new(log(200_000)));
        let mut download = Download::new(None, 0);
        let began_s = wire.vehicle.time_s();
        let (file, sent) = wire.fetch(&mut download, 1000.0);
        assert_eq!(download.ended(), Some(Ok(())));
        assert_eq!(file, content(200_000));
        let took_s = wire.vehicle.time_s() - began_s;
        let bytes_s = 200_000.0 / took_s;
        let share = bytes_s / f64::from(capacity_bytes_s) * (266 + signature_len) as f64 / 239.0;
        println!(
            "{capacity_bytes_s} B/s, signature {signature_len}: {bytes_s:.0} B/s, {:.1} %",
            100.0 * share
        );
        assert!(share > least, "{share}");
        // No second carries more than the budget, and a frame of the vehicle arrives in each.
        for (from_s, _) in &sent {
            let within = sent.iter().filter(|(at_s, _)| (*from_s..from_s + 1.0).contains(at_s));
            let bytes: usize = within.map(|(_, frame)| frame.as_bytes().len() + signature_len).sum();
            assert!(bytes <= capacity_bytes_s as usize, "{bytes} B in the second from {from_s} s");
        }
        let beats = sent.iter().filter(|(_, frame)| frame.message_id() == HEARTBEAT_DATA::ID).count() as f64;
        assert!((beats - took_s).abs() < 3.0, "{beats} heartbeats in {took_s} s");
        // Afterwards telemetry has its rates again.
        wire.run(12.0);
        assert!(count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID) >= 30);
    }
}

#[test]
fn a_log_is_refused_while_armed_and_in_flight_with_a_reason() {
    let mut wire = Wire::new();
    wire.endpoint.offer(Box::new(log(1000)));
    assert_eq!(wire.file_answers(Opcode::OPEN_FILE_RO, "/log/flight.mcap").0, None);
    let mut download = Download::new(None, 0);
    wire.endpoint.offer(Box::new(log(100_000)));
    wire.fetch(&mut download, 10.0);
    assert_eq!(download.ended(), None, "under way");
    assert_eq!(wire.request(400, 1.0, 0.0).0, ACCEPTED);
    let (_, sent) = wire.fetch(&mut download, 60.0);
    assert_eq!(download.ended(), Some(Err(Failure::NotNow)), "armed");
    let words = texts(&sent.into_iter().map(|(_, frame)| frame).collect::<Vec<_>>()).join("; ");
    assert!(words.contains("log refused: found PAD_ARMED, armed, required disarmed"), "{words}");
    for (opcode, path) in [
        (Opcode::OPEN_FILE_RO, "/log/flight.mcap"),
        (Opcode::CALC_FILE_CRC32, "/log/flight.mcap"),
        (Opcode::LIST_DIRECTORY, "/log"),
    ] {
        assert_eq!(wire.file_answers(opcode, path).0, Some(Refusal::Busy));
    }
    // Arming has ended the session, so telemetry is as in any flight.
    wire.run(2.0);
    assert!(count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID) >= 76, "8 Hz");
}

#[test]
fn a_client_that_looks_for_parameters_in_files_is_answered_at_once_also_in_flight() {
    let mut wire = Wire::new();
    for _ in 0..2 {
        assert_eq!(
            wire.file_answers(Opcode::OPEN_FILE_RO, "@PARAM/param.pck").0,
            Some(Refusal::FileNotFound)
        );
        assert_eq!(wire.file_answers(Opcode(6), "/log/x").0, Some(Refusal::FileProtected));
        wire.request(400, 1.0, 0.0);
    }
    assert_eq!(wire.file_answers(Opcode::LIST_DIRECTORY, "/").1, "");
}

#[test]
fn a_link_that_reads_does_not_thin_the_telemetry_of_another() {
    let mut wire = Wire {
        endpoint: VehicleEndpoint::new(VehicleKind::Simulated).over_links(&[2000, 2000]),
        ..Wire::new()
    };
    wire.endpoint.offer(Box::new(log(50_000)));
    wire.run(1.0);
    wire.request_file(&Packet::request(1, 0, Opcode::OPEN_FILE_RO, 0, "/log/flight.mcap"));
    wire.run(0.5);
    wire.request_file(&Packet { size: 239, ..Packet::request(2, 0, Opcode::BURST_READ_FILE, 0, "") });
    let mut carried = [[0; 2]; 2];
    for _ in 0..1000 {
        let (_, leaving) = frame(&mut wire.vehicle, &mut wire.endpoint, &[]);
        for Outgoing { frame, links } in leaving {
            for link in links {
                carried[link][0] += usize::from(frame.message_id() == ATTITUDE_QUATERNION_DATA::ID);
                carried[link][1] += usize::from(Packet::answer_in(&frame).is_some());
            }
        }
    }
    assert!(carried[0][0] <= 2 && carried[0][1] > 20, "{carried:?}");
    assert!(carried[1][0] >= 38 && carried[1][1] == 0, "{carried:?}");
}
