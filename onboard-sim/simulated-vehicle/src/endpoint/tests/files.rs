//! Tests the vehicle's log over MAVLink FTP: within the link's budget, beside telemetry, and refused while armed.

use flight::computer::FRAME_S;
use protocol::ftp::download::{Download, Failure, News};
use protocol::ftp::packet::Refusal;
use protocol::ftp::server::InMemory;
use protocol::ftp::{Opcode, Packet};
use protocol::identity::VEHICLE;

use super::*;

/// A log of this length, as the recorder would offer it.
pub(super) fn log(len: usize) -> InMemory {
    InMemory::new([("flight.mcap", content(len))])
}

fn content(len: usize) -> Vec<u8> {
    (0..len).map(|n| (n % 251) as u8).collect()
}

impl Wire {
    fn ask_file(&mut self, packet: &Packet) {
        let frame = self.ground.encode(&packet.message(VEHICLE));
        self.endpoint.on_frame(0, &frame, &self.vehicle);
    }

    /// The answers to one request, and what is said.
    fn asked_file(&mut self, opcode: Opcode, path: &str) -> (Option<Refusal>, String) {
        self.ask_file(&Packet::request(7, 0, opcode, 0, path));
        let sent = self.run(0.5);
        let answer = sent.iter().find_map(Packet::answer_in).expect("an answer");
        (answer.1.refusal(), texts(&sent).join("; "))
    }

    /// Fetches the file for at most this long; returns the file, and what was sent with its times.
    fn fetch(&mut self, download: &mut Download, most_s: f64) -> (Vec<u8>, Vec<(f64, Frame)>) {
        let (mut file, mut all) = (vec![0; 400_000], Vec::new());
        let end_s = self.vehicle.time_s() + most_s;
        while self.vehicle.time_s() < end_s && download.ended().is_none() {
            let now = Duration::from_secs_f64(self.vehicle.time_s());
            for packet in download.poll(now) {
                self.ask_file(&packet);
            }
            for frame in self.run(0.5 * FRAME_S) {
                if let Some((_, packet)) = Packet::answer_in(&frame)
                    && let Some(News::Piece { offset, data }) = download.take(&packet, now)
                {
                    file[offset as usize..offset as usize + data.len()].copy_from_slice(&data);
                }
                all.push((self.vehicle.time_s(), frame));
            }
            if download.is_whole() {
                file.truncate(download.progress().unwrap().len as usize);
                download.compare(protocol::ftp::crc::continued(0, &file));
            }
        }
        (file, all)
    }
}

#[test]
fn a_log_fills_the_link_within_its_budget_and_the_vehicle_is_still_heard() {
    // Of a radio's budget, six pieces fit into any second, and a seventh does not.
    for (capacity_bytes_s, signature_len, least) in [(2000, 0, 0.75), (5760, 0, 0.8), (5760, 13, 0.8)] {
        let endpoint = match signature_len {
            0 => VehicleEndpoint::new(),
            _ => VehicleEndpoint::sending_signed(),
        };
        let mut wire = Wire { endpoint: endpoint.over_links(&[capacity_bytes_s]), ..Wire::new() };
        wire.endpoint.offer(Box::new(log(200_000)));
        let mut download = Download::new(None, None, 0);
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
        // No second carries more than the budget, and the vehicle is heard in each.
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
    assert_eq!(wire.asked_file(Opcode::OpenFileRo, "/log/flight.mcap").0, None);
    let mut download = Download::new(None, None, 0);
    wire.endpoint.offer(Box::new(log(100_000)));
    wire.fetch(&mut download, 10.0);
    assert_eq!(download.ended(), None, "under way");
    assert_eq!(wire.ask(400, 1.0, 0.0).0, MavResult::MAV_RESULT_ACCEPTED as u8);
    let (_, sent) = wire.fetch(&mut download, 60.0);
    assert_eq!(download.ended(), Some(Err(Failure::NotNow)), "armed");
    let words = texts(&sent.into_iter().map(|(_, frame)| frame).collect::<Vec<_>>()).join("; ");
    assert!(words.contains("log refused: found PAD_ARMED, armed, required disarmed"), "{words}");
    for (opcode, path) in [
        (Opcode::OpenFileRo, "/log/flight.mcap"),
        (Opcode::CalcFileCrc32, "/log/flight.mcap"),
        (Opcode::ListDirectory, "/log"),
    ] {
        assert_eq!(wire.asked_file(opcode, path).0, Some(Refusal::Busy));
    }
    // Arming has ended the session, so telemetry is as in any flight.
    wire.run(2.0);
    assert!(count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID) >= 76, "8 Hz");
}

#[test]
fn a_client_that_looks_for_parameters_in_files_is_answered_at_once_also_in_flight() {
    let mut wire = Wire::new();
    for _ in 0..2 {
        assert_eq!(wire.asked_file(Opcode::OpenFileRo, "@PARAM/param.pck").0, Some(Refusal::FileNotFound));
        assert_eq!(wire.asked_file(Opcode::Other(6), "/log/x").0, Some(Refusal::FileProtected));
        wire.ask(400, 1.0, 0.0);
    }
    assert_eq!(wire.asked_file(Opcode::ListDirectory, "/").1, "");
}

#[test]
fn a_link_that_reads_does_not_thin_the_telemetry_of_another() {
    let mut wire = Wire { endpoint: VehicleEndpoint::new().over_links(&[2000, 2000]), ..Wire::new() };
    wire.endpoint.offer(Box::new(log(50_000)));
    wire.run(1.0);
    wire.ask_file(&Packet::request(1, 0, Opcode::OpenFileRo, 0, "/log/flight.mcap"));
    wire.run(0.5);
    wire.ask_file(&Packet { size: 239, ..Packet::request(2, 0, Opcode::BurstReadFile, 0, "") });
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
