//! Tests vehicle and station over a serial line of a slow baud rate, on a simulated clock.

use std::collections::VecDeque;

use protocol::command::{CommandSender, Resend};
use protocol::dialect::{MavState, TdInterlock};
use protocol::hub::line::SHARE;
use protocol::hub::{Hub, LinkEvent, Received};
use protocol::signing::{Key, Memory, Signing};

use super::*;

const STEP_S: f64 = 0.005;
/// A vehicle's frame in steps.
const FRAME_STEPS: u64 = 1;
const BAUDS: [u32; 3] = [4_800, 9_600, 57_600];

/// One direction of the line: bytes arrive in order, ten bits a byte.
struct Way {
    bytes_s: f64,
    free_at_s: f64,
    flying: VecDeque<(f64, Vec<u8>)>,
    carried: usize,
    /// Share of the bytes that are wrong.
    errors: f64,
    random: u64,
}

impl Way {
    fn of(baud: u32) -> Self {
        let bytes_s = f64::from(baud) / 10.0;
        Self { bytes_s, free_at_s: 0.0, flying: VecDeque::new(), carried: 0, errors: 0.0, random: 1 }
    }

    fn give(&mut self, mut bytes: Vec<u8>, now_s: f64) {
        for byte in &mut bytes {
            self.random =
                self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if (self.random >> 33) as f64 / f64::from(1_u32 << 31) < self.errors {
                *byte ^= 0x55;
            }
        }
        self.free_at_s = self.free_at_s.max(now_s) + bytes.len() as f64 / self.bytes_s;
        self.carried += bytes.len();
        self.flying.push_back((self.free_at_s, bytes));
    }

    fn arrived(&mut self, now_s: f64) -> Vec<u8> {
        let count = self.flying.iter().take_while(|(at_s, _)| *at_s <= now_s).count();
        self.flying.drain(..count).flat_map(|(_, bytes)| bytes).collect()
    }
}

/// A vehicle, a station and the line between them.
struct Line {
    vehicle: Vehicle,
    endpoint: VehicleEndpoint,
    vehicle_hub: Hub,
    station_hub: Hub,
    station: Encoder,
    sender: CommandSender,
    down: Way,
    up: Way,
    step: u64,
    /// When the vehicle made the frame of each sequence number, s.
    made_s: [f64; 256],
    /// When the vehicle made the newest frame that the station has, s.
    newest_s: f64,
    /// The longest time that a frame waited before the line began to carry it, s.
    longest_wait_s: f64,
    oldest_s: f64,
    received: Vec<u32>,
    latched_s: Option<f64>,
    observed_s: Option<f64>,
}

impl Line {
    fn at(baud: u32, signed: bool) -> Self {
        let endpoint = if signed {
            VehicleEndpoint::sending_signed(VehicleKind::Simulated)
        } else {
            VehicleEndpoint::new(VehicleKind::Simulated)
        };
        let budget = ((SHARE * f64::from(baud) / 10.0) as u32).min(RADIO_BUDGET_BYTES_S);
        let hub = || {
            let signing = signed.then(|| Signing::new(Key::new([7; Key::LEN]), Memory::default()));
            Hub::new(1, signing).over(&[Some(baud / 10)])
        };
        Self {
            vehicle: rocket(),
            endpoint: endpoint.over_links(&[budget]),
            vehicle_hub: hub(),
            station_hub: hub(),
            station: Encoder::new(GROUND),
            sender: CommandSender::new(0),
            down: Way::of(baud),
            up: Way::of(baud),
            step: 0,
            made_s: [0.0; 256],
            newest_s: 0.0,
            longest_wait_s: 0.0,
            oldest_s: 0.0,
            received: Vec::new(),
            latched_s: None,
            observed_s: None,
        }
    }

    fn now_s(&self) -> f64 {
        self.step as f64 * STEP_S
    }

    fn clock(&self) -> (Duration, u64) {
        (Duration::from_secs_f64(self.now_s()), 37_000_000_000_000 + (1e5 * self.now_s()) as u64)
    }

    fn run(&mut self, duration_s: f64, beats_every_s: f64) {
        let end = self.step + (duration_s / STEP_S).round() as u64;
        let every = |interval_s: f64| (interval_s / STEP_S).round() as u64;
        while self.step < end {
            if self.step.is_multiple_of(every(beats_every_s)) {
                self.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            }
            if self.step.is_multiple_of(every(5.0)) {
                self.send(&MavMessage::TIMESYNC(TIMESYNC_DATA { ts1: 1, ..TIMESYNC_DATA::default() }));
            }
            for message in self.sender.poll(self.clock().0) {
                self.send(&message);
            }
            if self.step.is_multiple_of(FRAME_STEPS) {
                self.vehicle_frame();
            }
            let (now, clock) = self.clock();
            while let Some((_, bytes)) = self.station_hub.leaving(0, now, clock) {
                self.up.give(bytes, self.now_s());
            }
            self.station_receives();
            self.oldest_s = self.oldest_s.max(self.now_s() - self.newest_s);
            self.step += 1;
        }
    }

    fn send(&mut self, message: &MavMessage) {
        let frame = self.station.encode(message);
        let (_, clock) = self.clock();
        assert!(self.station_hub.send(0, &frame, clock).is_none());
    }

    fn vehicle_frame(&mut self) {
        let ((now, clock), now_s) = (self.clock(), self.now_s());
        let bytes = self.up.arrived(now_s);
        for event in self.vehicle_hub.take(0, Received::Stream(0, bytes), now, clock) {
            if let LinkEvent::Frame(frame) = event {
                self.endpoint.on_frame(0, &frame, &self.vehicle.state());
            }
        }
        let (_, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
        for Outgoing { frame, .. } in leaving {
            self.made_s[usize::from(frame.sequence())] = now_s;
            self.vehicle_hub.send(0, &frame, clock);
        }
        while let Some((frame, bytes)) = self.vehicle_hub.leaving(0, now, clock) {
            let begins_s = self.down.free_at_s.max(now_s);
            self.longest_wait_s =
                self.longest_wait_s.max(begins_s - self.made_s[usize::from(frame.sequence())]);
            self.down.give(bytes, now_s);
        }
        if self.vehicle.mode().interlocks.abort_latched {
            self.latched_s.get_or_insert(now_s);
        }
    }

    fn station_receives(&mut self) {
        let ((now, clock), now_s) = (self.clock(), self.now_s());
        let bytes = self.down.arrived(now_s);
        for event in self.station_hub.take(0, Received::Stream(0, bytes), now, clock) {
            let LinkEvent::Frame(frame) = event else { continue };
            self.sender.on_received(now);
            self.newest_s = self.newest_s.max(self.made_s[usize::from(frame.sequence())]);
            self.received.push(frame.message_id());
            if let Some(answer) = CommandAnswer::from_frame(&frame) {
                self.sender.on_answer(&answer, now);
            }
            let latched = match frame.decode() {
                Ok(MavMessage::HEARTBEAT(beat)) => {
                    beat.system_status == MavState::MAV_STATE_FLIGHT_TERMINATION
                }
                Ok(MavMessage::TD_FLIGHT_STATUS(status)) => {
                    status.interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED)
                }
                _ => false,
            };
            if latched {
                self.observed_s.get_or_insert(now_s);
            }
        }
    }
}

#[test]
fn what_a_slow_line_brings_is_at_most_a_second_old_and_waits_at_most_three_tenths_for_the_line() {
    for (baud, signed) in BAUDS.iter().flat_map(|baud| [(*baud, false), (*baud, true)]) {
        let mut line = Line::at(baud, signed);
        line.run(5.0, 1.0);
        (line.oldest_s, line.down.carried, line.received) = (0.0, 0, Vec::new());
        line.run(60.0, 1.0);
        let (oldest_s, wait_s) = (line.oldest_s, line.longest_wait_s);
        assert!(oldest_s <= 1.0, "{baud} baud, signed {signed}: {oldest_s} s old");
        assert!(wait_s <= 0.3 + 1e-9, "{baud} baud, signed {signed}: waited {wait_s} s");
        let share = line.down.carried as f64 / 60.0 / line.down.bytes_s;
        assert!(share <= SHARE + 0.01, "{baud} baud, signed {signed}: {share} of the line");
        for (message_id, least) in
            [(HEARTBEAT_DATA::ID, 58), (TD_FLIGHT_STATUS_DATA::ID, 58), (ATTITUDE_QUATERNION_DATA::ID, 30)]
        {
            let found = line.received.iter().filter(|id| **id == message_id).count();
            assert!(found >= least, "{baud} baud, signed {signed}: {found} of message {message_id}");
        }
    }
}

/// One byte of a hundred is wrong: a third of the commands is lost, and a third of the answers.
#[test]
fn an_arming_arrives_over_a_bad_line_and_arms_once() {
    let mut armed = 0;
    for trial in 0..100 {
        let mut line = Line::at(9_600, false);
        for (way, random) in [(&mut line.up, 2 * trial), (&mut line.down, 2 * trial + 1)] {
            (way.errors, way.random) = (0.01, random);
        }
        line.run(4.0, 0.1);
        let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
        let now = line.clock().0;
        line.sender.submit(VEHICLE, arm, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], Resend::Times(4), now);
        line.run(2.5, 0.1);
        armed += u32::from(line.vehicle.mode().interlocks.armed);
    }
    assert!(armed >= 97, "{armed} of 100");
}

#[test]
fn an_abort_over_a_slow_line_latches_within_three_tenths_and_is_seen_within_a_second() {
    for (baud, signed) in BAUDS.iter().flat_map(|baud| [(*baud, false), (*baud, true)]) {
        // At other moments of telemetry, heartbeats and the vehicle's frames.
        for trial in 0..25 {
            let mut line = Line::at(baud, signed);
            line.run(4.0, 0.1);
            let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
            let now = line.clock().0;
            line.sender.submit(VEHICLE, arm, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], Resend::Never, now);
            line.run(2.0 + f64::from(trial) * 0.045, 0.1);
            assert!(line.vehicle.mode().interlocks.armed, "{baud} baud, signed {signed}");
            let (now, aborted_s) = (line.clock().0, line.now_s());
            let abort = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
            line.sender.submit(VEHICLE, abort, [1.0; 7], Resend::UntilWithdrawn, now);
            line.run(3.0, 0.1);
            let after = |at_s: Option<f64>| at_s.map_or(f64::INFINITY, |at_s| at_s - aborted_s);
            let (latched_s, observed_s) = (after(line.latched_s), after(line.observed_s));
            assert!(latched_s <= 0.3, "{baud} baud, signed {signed}: latched after {latched_s} s");
            assert!(observed_s <= 1.0, "{baud} baud, signed {signed}: seen after {observed_s} s");
        }
    }
}

#[test]
fn a_radio_without_room_in_its_buffer_gets_a_quarter_and_all_of_it_again_later() {
    use protocol::dialect::RADIO_STATUS_DATA;
    let mut wire = Wire::new();
    let mut radio = Encoder::new(Address { system_id: 51, component_id: 68 });
    let bytes_s = |frames: &[Frame], duration_s: f64| {
        frames.iter().map(|frame| frame.as_bytes().len()).sum::<usize>() as f64 / duration_s
    };
    let before = bytes_s(&wire.run(10.0), 10.0);
    let mut report = |wire: &mut Wire, txbuf| {
        let status = RADIO_STATUS_DATA { txbuf, ..RADIO_STATUS_DATA::default() };
        let frame = radio.encode(&MavMessage::RADIO_STATUS(status));
        wire.endpoint.on_frame(0, &frame, &wire.vehicle.state());
        wire.run(1.0)
    };
    for _ in 0..10 {
        report(&mut wire, 5);
    }
    let sent = (0..10).flat_map(|_| report(&mut wire, 5)).collect::<Vec<_>>();
    let slowed = bytes_s(&sent, 10.0);
    assert!((300.0..=510.0).contains(&slowed), "{slowed} B/s of 2000");
    assert!(count(&sent, HEARTBEAT_DATA::ID) >= 9 && count(&sent, TD_FLIGHT_STATUS_DATA::ID) >= 9);
    for _ in 0..15 {
        report(&mut wire, 95);
    }
    let again = bytes_s(&wire.run(10.0), 10.0);
    assert!(again > 0.95 * before, "{again} of {before} B/s");
}
