//! Tests that the downlink stays within its budget in any one second, for any requests, and that
//! every link has a budget.

use protocol::dialect::{LOCAL_POSITION_NED_DATA, MavModeFlag, MavState, STATUSTEXT_DATA};

use super::*;

/// The most bytes in any one second of frames with their times.
pub(super) fn worst_second(sent: &[(f64, usize)]) -> usize {
    let mut worst = 0;
    for (first, (began_s, _)) in sent.iter().enumerate() {
        let within = sent[first..].iter().take_while(|(time_s, _)| time_s - began_s < 1.0);
        worst = worst.max(within.map(|(_, bytes)| bytes).sum());
    }
    worst
}

/// Sent frames with their times.
struct Sent(Vec<(f64, Frame)>);

impl Sent {
    fn count(&self, message_id: u32) -> usize {
        self.0.iter().filter(|(_, frame)| frame.message_id() == message_id).count()
    }

    fn worst_second(&self, signature_len: usize) -> usize {
        let sizes: Vec<_> =
            self.0.iter().map(|(time_s, frame)| (*time_s, frame.as_bytes().len() + signature_len)).collect();
        worst_second(&sizes)
    }

    /// The longest pause between two messages of this kind, s.
    fn longest_pause_s(&self, message_id: u32) -> f64 {
        let times: Vec<f64> = self
            .0
            .iter()
            .filter(|(_, frame)| frame.message_id() == message_id)
            .map(|(time_s, _)| *time_s)
            .collect();
        times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    }
}

impl Wire {
    fn signed() -> Self {
        let mut wire =
            Self { endpoint: VehicleEndpoint::sending_signed(VehicleKind::Simulated), ..Self::new() };
        wire.run(2.0);
        wire
    }

    /// Runs for this long, with these requests in each frame.
    fn run_with_requests(
        &mut self,
        duration_s: f64,
        mut requests: impl FnMut(u64) -> Vec<CommandRequest>,
    ) -> Sent {
        let end_s = self.vehicle.time_s() + duration_s;
        let mut sent = Vec::new();
        for frame in 0.. {
            for request in requests(frame) {
                self.endpoint.on_command(0, (&request, None), &self.vehicle.state());
            }
            sent.extend(self.run(0.001).into_iter().map(|frame| (self.vehicle.time_s(), frame)));
            if self.vehicle.time_s() >= end_s {
                break;
            }
        }
        Sent(sent)
    }
}

fn from(station: u8, command: u16, param1: f32, param2: f32) -> CommandRequest {
    let source = Address { system_id: station, component_id: 190 };
    let params = [param1, param2, 0.0, 0.0, 0.0, 0.0, 0.0];
    CommandRequest { source, target: VEHICLE, command, params, confirmation: 0 }
}

/// Twenty a second, in frames of 5 ms.
fn twenty_hz(frame: u64) -> bool {
    frame.is_multiple_of(10)
}

#[test]
fn twenty_refused_commands_a_second_cost_no_position_and_are_counted() {
    let mut wire = Wire::new();
    wire.run(2.0);
    // A start without arming: the vehicle refuses it with a text.
    let sent = wire.run_with_requests(10.0, |frame| {
        if twenty_hz(frame) { vec![from(255, 300, 0.0, 0.0)] } else { Vec::new() }
    });
    let worst = sent.worst_second(0);
    assert!(worst <= RADIO_BUDGET_BYTES_S as usize, "{worst} B in one second");
    let positions = sent.count(LOCAL_POSITION_NED_DATA::ID);
    assert!(positions >= 79, "{positions} positions in 10 s at 8 Hz");
    // Eight answers at once, then two a second; the reason once, then a count every 5 s.
    let (answers, texts_sent) = (sent.count(77), sent.count(STATUSTEXT_DATA::ID));
    assert!((26..=29).contains(&answers), "{answers} answers");
    assert!((2..=8).contains(&texts_sent), "{texts_sent} chunks of text");
    let frames: Vec<Frame> = sent.0.into_iter().map(|(_, frame)| frame).collect();
    let words = texts(&frames);
    let counts: Vec<bool> = words.iter().take(2).map(|words| words.contains("more)")).collect();
    assert_eq!(counts, [false, true], "{words:?}");
}

/// Too much of everything: refused and accepted commands of many stations, questions, requests.
fn flood(frame: u64) -> Vec<CommandRequest> {
    let station = (frame % 40) as u8 + 100;
    vec![
        from(station, 300, 0.0, 0.0),
        from(station, 400, (frame % 3) as f32, 0.0),
        from(station, 512, 148.0, 0.0),
        from(255, 512, f32::NAN, frame as f32),
        from(255, 511, TD_FINS_DATA::ID as f32, (frame % 7) as f32 * 1e5),
        from(254, 12_345, frame as f32, 0.0),
    ]
}

#[test]
fn no_second_carries_more_than_the_budget_for_any_request_and_vital_messages_are_sent() {
    for (new, signature_len) in [(Wire::new as fn() -> Wire, 0), (Wire::signed, SIGNATURE_LEN)] {
        let mut wire = new();
        let sent = wire.run_with_requests(12.0, flood);
        let worst = sent.worst_second(signature_len);
        assert!(worst <= RADIO_BUDGET_BYTES_S as usize, "{worst} B in one second");
        assert!(worst > 1_500, "the flood was large enough: {worst} B");
        let pause_s = sent.longest_pause_s(HEARTBEAT_DATA::ID);
        assert!(pause_s <= 1.05, "{pause_s} s without a heartbeat");
        let pause_s = sent.longest_pause_s(TD_FLIGHT_STATUS_DATA::ID);
        assert!(pause_s <= 0.25, "{pause_s} s without a flight status");
    }
}

#[test]
fn an_abort_in_a_flood_is_answered_at_once_and_seen_in_hurried_heartbeats() {
    for new in [Wire::new, Wire::signed] {
        let mut wire = new();
        assert_eq!(wire.request(400, 1.0, 0.0).0, 0);
        wire.run_with_requests(5.0, flood);
        wire.endpoint.on_command(0, (&from(255, 185, 1.0, 0.0), None), &wire.vehicle.state());
        let aborted_at_s = wire.vehicle.time_s();
        let sent = wire.run_with_requests(3.0, |frame| {
            let mut requests = flood(frame);
            if frame.is_multiple_of(3) {
                requests.push(from(255, 185, 1.0, 0.0));
            }
            requests
        });
        let answers: Vec<f64> = sent
            .0
            .iter()
            .filter(|(_, frame)| {
                CommandAnswer::from_frame(frame).is_some_and(|a| (a.command, a.result) == (185, 0))
            })
            .map(|(time_s, _)| time_s - aborted_at_s)
            .collect();
        assert!(answers[0] <= 0.02 + 1e-9, "answered after {} s", answers[0]);
        assert!(answers.iter().filter(|after_s| **after_s <= 1.0).count() >= 5, "{answers:?}");
        let beats: Vec<f64> = sent
            .0
            .iter()
            .filter(|(_, frame)| {
                matches!(frame.decode(), Ok(MavMessage::HEARTBEAT(beat))
                    if beat.system_status == MavState::MAV_STATE_FLIGHT_TERMINATION)
            })
            .map(|(time_s, _)| time_s - aborted_at_s)
            .collect();
        assert!(beats[0] <= 0.12, "seen after {} s", beats[0]);
        assert!(beats.iter().filter(|after_s| **after_s <= 1.05).count() >= 5, "{beats:?}");
    }
}

#[test]
fn every_heartbeat_and_flight_status_identifies_the_vehicle_and_its_boot_from_power_up() {
    for kind in [VehicleKind::Simulated, VehicleKind::Real] {
        identifies_vehicle_and_boot(kind);
    }
}

fn identifies_vehicle_and_boot(kind: VehicleKind) {
    let marked = kind == VehicleKind::Simulated;
    let mut wire = Wire { endpoint: VehicleEndpoint::new(kind).booted(0xB007_0001), ..Wire::new() };
    let first = wire.run(0.001);
    assert!(
        count(&first, HEARTBEAT_DATA::ID) == 1 && count(&first, TD_FLIGHT_STATUS_DATA::ID) == 1,
        "at once"
    );
    // It names no boot.
    assert_eq!(wire.request(ARM, 1.0, 0.0).0, if marked { ACCEPTED } else { DENIED });
    let sent = first.into_iter().chain(wire.run(5.0));
    let (mut beats, mut statuses) = (0, 0);
    for frame in sent {
        match frame.decode() {
            Ok(MavMessage::HEARTBEAT(beat)) => {
                beats += 1;
                assert_eq!(beat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED), marked);
            }
            Ok(MavMessage::TD_FLIGHT_STATUS(status)) => {
                statuses += 1;
                assert_eq!(status.boot_number, 0xB007_0001);
                let flag = protocol::dialect::TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED;
                assert_eq!(status.vehicle_flags.contains(flag), marked);
            }
            _ => {}
        }
    }
    assert!(beats >= 5 && statuses >= 25, "{beats} heartbeats, {statuses} flight statuses");
}

// Tests several links: a request over one link applies to that link.

/// A slow link, number 0, and a fast one, number 1.
fn two_links() -> Wire {
    Wire {
        endpoint: VehicleEndpoint::new(VehicleKind::Simulated).over_links(&[2_000, 20_000]),
        ..Wire::new()
    }
}

impl Wire {
    /// Frames carried by each of two links.
    fn run_links(&mut self, duration_s: f64) -> [Vec<Frame>; 2] {
        let end_s = self.vehicle.time_s() + duration_s;
        let mut sent = [Vec::new(), Vec::new()];
        while self.vehicle.time_s() < end_s {
            let (_, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
            for Outgoing { frame, links } in leaving {
                for link in links {
                    sent[link].push(frame.clone());
                }
            }
        }
        sent
    }

    fn request_over(&mut self, link: usize, message_id: u32, interval_us: f32) -> u8 {
        let request = asking(511, [message_id as f32, interval_us, 0.0, 0.0, 0.0, 0.0, 0.0]);
        self.endpoint.on_command(link, (&request, None), &self.vehicle.state());
        self.run_links(0.1)[link].iter().find_map(CommandAnswer::from_frame).unwrap().result
    }
}

fn numbers_are_consecutive(frames: &[Frame]) -> bool {
    frames.windows(2).all(|pair| pair[1].sequence() == pair[0].sequence().wrapping_add(1))
}

#[test]
fn all_links_carry_copies_until_one_gets_another_request() {
    let mut wire = two_links();
    let [slow, fast] = wire.run_links(3.0);
    assert_eq!(slow, fast);
    // A request that changes nothing does not split the lane.
    assert_eq!(wire.request_over(1, ATTITUDE_QUATERNION_DATA::ID, 0.0), 0);
    let [slow, fast] = wire.run_links(1.0);
    assert_eq!(slow, fast);
}

#[test]
fn an_interval_applies_to_the_requesting_link_and_a_fast_link_carries_more() {
    let mut wire = two_links();
    wire.run_links(1.0);
    assert_eq!(wire.request_over(0, ATTITUDE_QUATERNION_DATA::ID, 20_000.0), DENIED);
    assert_eq!(wire.request_over(1, ATTITUDE_QUATERNION_DATA::ID, 20_000.0), 0);
    let [slow, fast] = wire.run_links(5.0);
    assert!(
        numbers_are_consecutive(&slow) && numbers_are_consecutive(&fast),
        "a gap would be counted as loss"
    );
    let of = |frames: &[Frame]| count(frames, ATTITUDE_QUATERNION_DATA::ID);
    assert!((39..=41).contains(&of(&slow)), "{} in 5 s at 8 Hz", of(&slow));
    assert!((245..=251).contains(&of(&fast)), "{} in 5 s at 50 Hz", of(&fast));
    // The slow one switches the message off.
    assert_eq!(wire.request_over(0, ATTITUDE_QUATERNION_DATA::ID, -1.0), 0);
    let [slow, fast] = wire.run_links(1.0);
    assert_eq!((of(&slow), of(&fast) >= 49), (0, true));
}

#[test]
fn texts_of_the_vehicle_go_over_every_link() {
    let mut wire = two_links();
    assert_eq!(wire.request_over(1, ATTITUDE_QUATERNION_DATA::ID, 20_000.0), 0);
    wire.endpoint.send_text(Severity::Notice, "a word");
    let sent = wire.run_links(0.1);
    assert!(sent.iter().all(|frames| texts(frames) == ["a word"]));
}
