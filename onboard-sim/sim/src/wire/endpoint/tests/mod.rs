//! Tests the vehicle's endpoint frame by frame.

use std::sync::LazyLock;
use std::time::Duration;

use avionics::link::streams::{STANDARD, Streams};
use flight::computer::LogState;
use flight::computer::crew::{CrewCommand, Request};
use flight::computer::messages::Severity;
use flight::rules::arming::all_passed;
use flight::rules::operator::{Name, Operator, Role};
use flight::rules::phase::Phase;
use mavlink::MessageData as _;
use proptest::prelude::*;
use protocol::command::{CommandAnswer, CommandRequest};
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, COMMAND_LONG_DATA, ESTIMATOR_STATUS_DATA, HEARTBEAT_DATA, MavCmd, MavMessage,
    MavResult, TD_DESCENT_DATA, TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_LANDING_VERDICT_DATA,
    TD_PREDICTED_PATH_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TIMESYNC_DATA, TdCheck,
};
use protocol::frame::{Encoder, Frame, SIGNATURE_LEN};
use protocol::identity::{Address, GROUND, RADIO_BUDGET_BYTES_S, VEHICLE};
use protocol::signing::Key;
use protocol::text::Reassembler;

use super::{Outgoing, VehicleEndpoint, VehicleKind, step};
use crate::dispersion::Dispersion;
use crate::wire::fly::load_flight;
use crate::wire::vehicle::{Vehicle, VehicleEvent};

/// mk2 without dispersions on its pad, with its rehearsal done: most tests begin there.
static READY: LazyLock<Vehicle> = LazyLock::new(|| {
    let mut flight = load_flight("mk2").unwrap();
    flight.recipe.dispersion = Dispersion::builtin("none").unwrap();
    let mut vehicle = Vehicle::on_the_pad(&flight).unwrap();
    vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    vehicle.set_pin_out(true);
    while !all_passed(&vehicle.arming_checks()) {
        assert!(vehicle.time_s() < 20.0, "{:?}", vehicle.arming_checks());
        vehicle.step(&[]);
    }
    vehicle
});

fn rocket() -> Vehicle {
    READY.clone()
}

const ARM: u16 = 400;
const START: u16 = 300;
const HOLD: u16 = 193;
const ABORT: u16 = 185;
const TAP: u16 = 54_000;
const TAKE_COMMAND: u16 = 54_001;
const CHECK: u16 = 54_002;

const ACCEPTED: u8 = MavResult::MAV_RESULT_ACCEPTED as u8;
const NOT_NOW: u8 = MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
const DENIED: u8 = MavResult::MAV_RESULT_DENIED as u8;

/// The number of a crew's first proposal.
const FIRST_PROPOSAL: u16 = 40_000;

/// A crew's people: two of one role, and one each of two others.
fn operators() -> Vec<Operator> {
    let people =
        [("Ann", Role::RangeSafety), ("Bob", Role::Flight), ("Cat", Role::Flight), ("Dan", Role::Pad)];
    let operator =
        |(number, (name, role)): (u8, (&str, Role))| Operator { number, role, name: Name::new(name) };
    (1..).zip(people).map(operator).collect()
}

fn key(number: u8) -> Key {
    Key::new([number; Key::LEN])
}

/// Messages without content on the pad.
const IN_FLIGHT: [u32; 5] = [
    TD_DESCENT_DATA::ID,
    TD_TOUCHDOWN_PREDICTION_DATA::ID,
    TD_PREDICTED_PATH_DATA::ID,
    TD_LANDING_VERDICT_DATA::ID,
    ESTIMATOR_STATUS_DATA::ID,
];

/// The messages of a kind among frames.
macro_rules! decoded {
    ($frames:expr, $kind:ident) => {
        $frames.iter().filter_map(|frame| match frame.decode() {
            Ok(MavMessage::$kind(data)) => Some(data),
            _ => None,
        })
    };
}

/// A command of the ground station to this vehicle.
fn asking(command: u16, params: [f32; 7]) -> CommandRequest {
    CommandRequest { source: GROUND, target: VEHICLE, command, params, confirmation: 0 }
}

/// The same as a message.
fn command(command: MavCmd, param1: f32) -> COMMAND_LONG_DATA {
    let (target_system, target_component) = (VEHICLE.system_id, VEHICLE.component_id);
    COMMAND_LONG_DATA { param1, command, target_system, target_component, ..COMMAND_LONG_DATA::default() }
}

/// A command to this vehicle, also one outside the dialect.
fn any_command(encoder: &mut Encoder, command: u16, [param1, param2, param3]: [f32; 3]) -> Frame {
    let payload = COMMAND_LONG_DATA { param2, param3, ..self::command(MavCmd::default(), param1) };
    let mut bytes = [0; 255];
    let len = mavlink::MessageData::ser(&payload, mavlink::MavlinkVersion::V1, &mut bytes);
    bytes[28..30].copy_from_slice(&command.to_le_bytes());
    encoder.encode_payload(COMMAND_LONG_DATA::ID, &bytes[..len]).unwrap()
}

/// One frame as in the run loop, with the requests of the vehicle's programme.
fn frame(
    vehicle: &mut Vehicle,
    endpoint: &mut VehicleEndpoint,
    commands: &[CrewCommand],
) -> (Vec<VehicleEvent>, Vec<Outgoing>) {
    let requests: Vec<Request> = commands.iter().copied().map(Request::of_the_programme).collect();
    let (events, _) = step(endpoint, vehicle, &requests);
    (events, endpoint.poll(&vehicle.state()))
}

struct Wire {
    vehicle: Vehicle,
    endpoint: VehicleEndpoint,
    ground: Encoder,
    /// The ground station sends heartbeats as often as to an armed vehicle.
    beats: bool,
}

impl Wire {
    fn new() -> Self {
        let mut wire = Self {
            vehicle: rocket(),
            // Every field has a value: no frame is shorter than it is in use.
            endpoint: VehicleEndpoint::new(VehicleKind::Simulated).booted(0x00AB_CDEF).with_uid(0xABCD),
            ground: Encoder::new(GROUND),
            beats: false,
        };
        wire.run(0.5);
        wire
    }

    /// Runs for this long; returns the sent frames.
    fn run(&mut self, duration_s: f64) -> Vec<Frame> {
        let end_s = self.vehicle.time_s() + duration_s;
        let mut sent = Vec::new();
        while self.vehicle.time_s() < end_s {
            // Frames of 5 ms: ten heartbeats a second.
            if self.beats && ((self.vehicle.time_s() * 200.0).round() as u64).is_multiple_of(20) {
                self.beat();
            }
            let (_, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
            sent.extend(leaving.into_iter().map(|outgoing| outgoing.frame));
        }
        sent
    }

    /// The ground station sends a message.
    fn transmit(&mut self, message: &MavMessage) {
        let frame = self.ground.encode(message);
        self.endpoint.on_frame(0, &frame, &self.vehicle.state());
    }

    fn beat(&mut self) {
        self.transmit(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    }

    /// Sends a command from a ground station with an uplink.
    fn request(&mut self, command: u16, param1: f32, param2: f32) -> (u8, String) {
        self.beats = true;
        self.beat();
        self.request_once(command, param1, param2)
    }

    fn request_once(&mut self, command: u16, param1: f32, param2: f32) -> (u8, String) {
        let frame = any_command(&mut self.ground, command, [param1, param2, f32::NAN]);
        self.endpoint.on_frame(0, &frame, &self.vehicle.state());
        let sent = self.run(0.5);
        let answers: Vec<_> = sent.iter().filter_map(CommandAnswer::from_frame).collect();
        assert_eq!(answers.len(), 1, "one answer to one command");
        assert_eq!((answers[0].command, answers[0].target), (command, GROUND));
        (answers[0].result, texts(&sent).join("; "))
    }
}

fn texts(frames: &[Frame]) -> Vec<String> {
    let mut reassembler = Reassembler::default();
    let chunks = frames.iter().filter_map(|frame| match frame.decode() {
        Ok(MavMessage::STATUSTEXT(chunk)) => Some(reassembler.push(frame.source(), &chunk, Duration::ZERO)),
        _ => None,
    });
    chunks.flatten().map(|text| text.text).collect()
}

fn count(frames: &[Frame], message_id: u32) -> usize {
    frames.iter().filter(|frame| frame.message_id() == message_id).count()
}

#[test]
fn the_standard_rates_fit_the_radio_and_are_met() {
    let streams = Streams::over_a_radio(0, false);
    assert!(streams.fit(), "{} B/s", streams.bytes_s());
    let mut wire = Wire::new();
    let sent = wire.run(10.0);
    for standard in STANDARD {
        // In flight only, and the verdict after it.
        if IN_FLIGHT.contains(&standard.message_id) {
            continue;
        }
        let expected = 10.0 * streams.rate_hz(standard.message_id);
        let found = count(&sent, standard.message_id) as f64;
        assert!((found - expected).abs() <= 1.0, "message {}: {found} of {expected}", standard.message_id);
    }
}

#[test]
fn a_refusal_is_answered_and_explained_in_words() {
    let mut wire = Wire::new();
    let (result, words) = wire.request(300, 0.0, 0.0);
    assert_eq!(result, DENIED);
    assert!(words.contains("start refused: cannot start in PAD_IDLE"), "{words}");
    wire.vehicle.set_log_state(LogState { running: false, space_bytes: 0 });
    // Force codes have no effect. The reason is sent once.
    for (code, said) in [(0.0, true), (21196.0, false), (2989.0, false)] {
        let (result, words) = wire.request(400, 1.0, code);
        assert_eq!(result, NOT_NOW);
        assert_eq!(words.contains("arm refused: log"), said, "{words}");
    }
    // Texts have a share of each second.
    wire.run(1.0);
    assert_eq!(wire.request(400, 2.0, 0.0).0, DENIED);
}

#[test]
fn a_command_for_somebody_else_is_left_alone() {
    let mut wire = Wire::new();
    for target_system in [2, 255] {
        let arm = command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0);
        let command = COMMAND_LONG_DATA { target_system, ..arm };
        wire.transmit(&MavMessage::COMMAND_LONG(command));
    }
    let sent = wire.run(0.5);
    assert_eq!(count(&sent, 77), 0);
    assert!(!wire.vehicle.mode().interlocks.armed);
}

#[test]
fn a_stream_that_was_slowed_comes_back_at_once_and_vital_ones_are_not_slowed() {
    let mut wire = Wire::new();
    let attitude = ATTITUDE_QUATERNION_DATA::ID as f32;
    assert_eq!(wire.request(511, attitude, 60e6).0, 0);
    assert!(count(&wire.run(5.0), ATTITUDE_QUATERNION_DATA::ID) <= 1);
    assert_eq!(wire.request(511, attitude, 0.0).0, 0);
    assert!(count(&wire.run(2.0), ATTITUDE_QUATERNION_DATA::ID) >= 15, "8 Hz");
    for (vital, interval_us) in [(HEARTBEAT_DATA::ID, -1.0), (TD_FLIGHT_STATUS_DATA::ID, 2e6)] {
        assert_eq!(wire.request(511, vital as f32, interval_us).0, DENIED);
    }
    assert_eq!(wire.request(511, attitude, f32::INFINITY).0, DENIED);
    assert_eq!(wire.request(511, f32::NAN, -1.0).0, DENIED);
}

#[test]
fn a_new_phase_is_sent_at_once_and_only_once() {
    let mut wire = Wire::new();
    wire.run(1.03);
    let (_, leaving) = frame(&mut wire.vehicle, &mut wire.endpoint, &[CrewCommand::Arm]);
    let mut sent: Vec<Frame> = leaving.into_iter().map(|outgoing| outgoing.frame).collect();
    sent.extend(wire.run(0.08));
    assert_eq!(count(&sent, HEARTBEAT_DATA::ID), 1);
    assert_eq!(count(&sent, TD_FLIGHT_STATUS_DATA::ID), 1);
}

#[test]
fn a_new_station_gets_the_limits() {
    let mut wire = Wire::new();
    wire.run(1.0);
    wire.beat();
    let limits = decoded!(wire.run(0.1), TD_TOUCHDOWN_LIMITS).next();
    let legs = flight::vehicles::mission::builtin("mk2").unwrap().unwrap().leg_limits;
    assert!((f64::from(limits.unwrap().vertical_m_s) - legs.vertical_m_s).abs() < 1e-6, "of the legs");
}

#[test]
fn time_is_sent_on_request_to_this_vehicle() {
    let mut wire = Wire::new();
    for (target_system, answered) in [(0, true), (1, true), (2, false)] {
        let sync = TIMESYNC_DATA { ts1: 77, target_system, ..TIMESYNC_DATA::default() };
        wire.transmit(&MavMessage::TIMESYNC(sync));
        assert_eq!(count(&wire.run(0.1), TIMESYNC_DATA::ID) == 1, answered, "target {target_system}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// For any frames, the vehicle keeps running, and only the two proper commands arm and start
    /// it.
    #[test]
    fn hostile_payloads_never_stop_the_vehicle(
        messages in prop::collection::vec((prop::sample::select(vec![0u32, 4, 75, 76, 77, 111, 253, 54_000]), prop::collection::vec(any::<u8>(), 1..64)), 1..40)
    ) {
        let mut wire = Wire::new();
        for (message_id, payload) in messages {
            if let Some(frame) = wire.ground.encode_payload(message_id, &payload) {
                wire.endpoint.on_frame(0, &frame, &wire.vehicle.state());
            }
            wire.run(0.02);
        }
        let beats = count(&wire.run(2.0), HEARTBEAT_DATA::ID);
        prop_assert!(beats >= 1);
        // None of these payloads is the arm command with exactly 1: nothing was armed or started.
        prop_assert!(!wire.vehicle.mode().interlocks.armed);
        prop_assert!(wire.vehicle.phase() == Phase::PadIdle);
    }
}

/// The bits of `checks_failed` have the order of the vehicle's checks: the name of each bit is the
/// start of its check's name.
#[test]
fn the_dialect_names_the_arming_checks_in_their_order() {
    let checks = rocket().arming_checks();
    let bits: Vec<_> = TdCheck::all().iter_names().collect();
    // The last is that of a vehicle below a drone.
    assert_eq!((bits.len(), bits[checks.len()].0), (checks.len() + 1, "TD_CHECK_HEIGHT"));
    for (place, (check, (name, bit))) in checks.iter().zip(bits).enumerate() {
        assert_eq!(bit.bits(), 1 << place);
        let words = name.trim_start_matches("TD_CHECK_").to_lowercase().replace('_', " ");
        assert!(
            check.name.to_lowercase().replace('-', " ").starts_with(&words),
            "bit {place}: {name} is not {}",
            check.name
        );
    }
}

mod addressing;
mod budget;
mod crew;
mod manners;
mod questions;
mod rocket;
mod slow_line;
mod uplink;
