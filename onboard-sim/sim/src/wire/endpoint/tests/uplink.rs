//! Tests the uplink: arming waits for it, a countdown is held without it, and any station holds.

use flight::computer::FRAME_S;
use flight::computer::messages::CrewMessage;
use flight::rules::arming::UPLINK_CHECK;
use flight::rules::phase::{HOLD_LIMIT_S, UPLINK_PROVEN_S, UPLINK_SILENT_S};
use protocol::dialect::{COMMAND_CANCEL_DATA, MavState, MavType, TdHold, TdMotor};

use super::*;

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
const HOLD: MavCmd = MavCmd::MAV_CMD_DO_PAUSE_CONTINUE;
const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;

const SPARE: Address = Address { system_id: 254, component_id: 190 };

/// Any vehicle on its pad, with stations.
struct Pad {
    vehicle: Vehicle,
    endpoint: VehicleEndpoint,
    stations: [Encoder; 2],
    /// The stations that send heartbeats, ten a second.
    speaking: Vec<usize>,
    sent: Vec<Frame>,
    events: Vec<VehicleEvent>,
    /// Frames until the next heartbeat.
    beat_in: u32,
}

/// The crew's station, the first of a [`Pad`]'s.
const CREW: usize = 0;
const OTHER: usize = 1;

impl Pad {
    fn of(mut vehicle: Vehicle, endpoint: VehicleEndpoint) -> Self {
        vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
        vehicle.set_pin_out(true);
        let stations = [Encoder::new(GROUND), Encoder::new(SPARE)];
        let mut pad = Self {
            vehicle,
            endpoint,
            stations,
            speaking: vec![CREW],
            sent: Vec::new(),
            events: Vec::new(),
            beat_in: 0,
        };
        pad.run(0.1);
        while !all_passed(&pad.vehicle.arming_checks()) {
            assert!(pad.vehicle.time_s() < 20.0, "{:?}", pad.vehicle.arming_checks());
            pad.run(0.1);
        }
        pad
    }

    fn rocket() -> Self {
        Self::of(rocket(), VehicleEndpoint::new(VehicleKind::Simulated))
    }

    /// Below a drone.
    fn hanging() -> Self {
        Self::flying("vlr")
    }

    fn flying(mission: &str) -> Self {
        let mut flight = load_flight(mission).unwrap();
        flight.recipe.dispersion = Dispersion::builtin("none").unwrap();
        Self::of(Vehicle::on_the_pad(&flight).unwrap(), VehicleEndpoint::new(VehicleKind::Simulated))
    }

    /// One frame as in the run loop.
    fn frame(&mut self) {
        if self.beat_in == 0 {
            for station in self.speaking.clone() {
                let beat = self.stations[station].encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
                self.endpoint.on_frame(0, &beat, &self.vehicle.state());
            }
            self.beat_in = (0.1 / FRAME_S).round() as u32;
        }
        self.beat_in -= 1;
        let (events, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
        self.events.extend(events);
        self.sent.extend(frames(leaving));
    }

    fn run(&mut self, duration_s: f64) {
        let end_s = self.vehicle.time_s() + duration_s - 1e-9;
        while self.vehicle.time_s() < end_s {
            self.frame();
        }
    }

    fn transmit(&mut self, station: usize, command: MavCmd, param1: f32) {
        let message = MavMessage::COMMAND_LONG(super::command(command, param1));
        let frame = self.stations[station].encode(&message);
        self.sent.clear();
        self.endpoint.on_frame(0, &frame, &self.vehicle.state());
    }

    fn answers(&self) -> Vec<u8> {
        self.sent.iter().filter_map(CommandAnswer::from_frame).map(|answer| answer.result).collect()
    }

    /// Sends a command, and returns its result.
    fn request(&mut self, station: usize, command: MavCmd, param1: f32) -> u8 {
        self.transmit(station, command, param1);
        // Some time after the previous answer.
        let end_s = self.vehicle.time_s() + 0.3;
        while self.answers().is_empty() && self.vehicle.time_s() < end_s {
            self.frame();
        }
        let answers = self.answers();
        assert_eq!(answers.len(), 1, "{answers:?}");
        answers[0]
    }

    fn count_down(&mut self) {
        assert_eq!(self.request(CREW, ARM, 1.0), ACCEPTED);
        assert_eq!(self.request(CREW, START, 0.0), ACCEPTED);
    }

    fn counting(&self) -> bool {
        self.vehicle.mode().countdown_end_s.is_some()
    }

    fn status(&mut self) -> TD_FLIGHT_STATUS_DATA {
        self.sent.clear();
        self.run(0.3);
        let status = decoded!(self.sent, TD_FLIGHT_STATUS).last();
        status.expect("five a second")
    }

    fn message_count(&self, words: &str) -> usize {
        let says = |event: &&VehicleEvent| matches!(event, VehicleEvent::Message(CrewMessage::Text { text, .. }) if text.contains(words));
        self.events.iter().filter(says).count()
    }
}

fn frames(leaving: Vec<Outgoing>) -> Vec<Frame> {
    leaving.into_iter().map(|leaving| leaving.frame).collect()
}

#[test]
fn arming_waits_for_a_heartbeat_of_the_requesting_station() {
    for pad in [Pad::rocket, Pad::hanging] {
        let mut pad = pad();
        // Another station has an uplink, but not the requesting one.
        assert_eq!(pad.request(OTHER, ARM, 1.0), NOT_NOW);
        assert_eq!(pad.message_count("arm refused: uplink: found no heartbeat of this station"), 1);
        pad.speaking = vec![OTHER];
        pad.run(UPLINK_PROVEN_S + 0.2);
        assert_eq!(pad.request(CREW, ARM, 1.0), NOT_NOW);
        assert_eq!(pad.message_count("arm refused: uplink: found heartbeat 2."), 1);
        assert_eq!(pad.request(OTHER, ARM, 1.0), ACCEPTED);
    }
}

#[test]
fn the_check_fails_without_an_uplink_and_a_lost_heartbeat_raises_no_warning() {
    let mut pad = Pad::rocket();
    assert!(pad.status().checks_failed.is_empty());
    pad.speaking.clear();
    pad.run(3.0);
    let bits: Vec<_> = pad.status().checks_failed.iter_names().map(|(name, _)| name).collect();
    assert_eq!(bits, ["TD_CHECK_UPLINK"]);
    assert_eq!(pad.message_count(UPLINK_CHECK), 0);
}

/// It reports its downlink in its heartbeats.
#[test]
fn a_station_without_a_downlink_in_the_countdown_holds_it() {
    let mut pad = Pad::rocket();
    pad.count_down();
    let deaf = HEARTBEAT_DATA {
        mavtype: MavType::MAV_TYPE_GCS,
        system_status: MavState::MAV_STATE_CRITICAL,
        ..HEARTBEAT_DATA::default()
    };
    for (station, counts) in [(OTHER, true), (CREW, false)] {
        let beat = pad.stations[station].encode(&MavMessage::HEARTBEAT(deaf.clone()));
        pad.endpoint.on_frame(0, &beat, &pad.vehicle.state());
        pad.run(0.05);
        assert_eq!(pad.counting(), counts, "the one that armed it is meant");
    }
    pad.run(0.5);
    assert_eq!(pad.status().hold, TdHold::TD_HOLD_STATION_DEAF);
    assert_eq!(pad.message_count("255/190 receives nothing of this vehicle"), 1);
}

#[test]
fn a_log_that_fails_holds_the_countdown_until_the_release() {
    let failed = LogState { running: false, space_bytes: 0 };
    let mut pad = Pad::rocket();
    pad.count_down();
    pad.vehicle.set_log_state(failed);
    pad.run(0.5);
    assert!(!pad.counting());
    assert_eq!(pad.status().hold, TdHold::TD_HOLD_CHECK_FAILED);
    assert_eq!(pad.message_count("log: found not running, required running"), 1);
    assert_eq!(pad.request(CREW, START, 0.0), NOT_NOW);
    assert_eq!(pad.message_count("start refused: log: found not running"), 1);
    let mut pad = Pad::rocket();
    pad.count_down();
    pad.run(pad.vehicle.computer().countdown_s() - 1.0);
    pad.vehicle.set_log_state(failed);
    pad.run(2.0);
    assert!(pad.vehicle.phase().on_pad() && !pad.counting(), "nothing has current before the release");
}

/// Who starts is who armed, or has taken command: the silence of that station holds the countdown.
#[test]
fn only_the_station_that_armed_it_starts_or_the_one_that_has_taken_command() {
    let mut pad = Pad::rocket();
    pad.speaking = vec![CREW, OTHER];
    pad.run(0.5);
    assert_eq!(pad.request(CREW, ARM, 1.0), ACCEPTED);
    assert_eq!(pad.request(OTHER, START, 0.0), DENIED);
    let words = "start refused: 255/190 armed it: start there, or take command when it is silent";
    assert_eq!((pad.message_count(words), pad.counting()), (1, false));
    pad.speaking = vec![OTHER];
    pad.run(2.5);
    assert_eq!(pad.request(OTHER, MavCmd::MAV_CMD_TD_TAKE_COMMAND, 0.0), ACCEPTED);
    assert_eq!(pad.request(OTHER, START, 0.0), ACCEPTED);
    pad.run(1.0);
    assert!(pad.counting());
    pad.speaking = vec![CREW];
    pad.run(UPLINK_SILENT_S + 0.2);
    assert!(!pad.counting(), "the one who started is watched");
}

/// Two operators may type at once: a disarm is not undone by an arming that another station sent
/// at the same time.
#[test]
fn no_other_station_arms_in_the_three_seconds_after_a_disarm() {
    let mut pad = Pad::rocket();
    pad.speaking = vec![CREW, OTHER];
    pad.run(0.5);
    assert_eq!(pad.request(OTHER, ARM, 0.0), ACCEPTED, "a disarm of a disarmed vehicle");
    assert_eq!(pad.request(CREW, ARM, 1.0), DENIED);
    let words = "arm refused: 254/190 has just disarmed it: agree, then arm again";
    assert_eq!((pad.message_count(words), pad.vehicle.phase()), (1, Phase::PadIdle));
    assert_eq!(pad.request(OTHER, ARM, 1.0), ACCEPTED, "the station that disarmed");
    assert_eq!(pad.request(OTHER, ARM, 0.0), ACCEPTED);
    pad.run(3.1);
    assert_eq!((pad.request(CREW, ARM, 1.0), pad.vehicle.phase()), (ACCEPTED, Phase::PadArmed));
}

#[test]
fn a_running_check_can_be_cancelled() {
    let mut pad = Pad::rocket();
    assert_eq!(pad.request(CREW, MavCmd::MAV_CMD_TD_PAD_CHECK, 1.0), ACCEPTED);
    pad.run(0.5);
    assert!(pad.vehicle.computer().pad_check().is_running());
    let cancel =
        COMMAND_CANCEL_DATA { command: MavCmd::MAV_CMD_TD_PAD_CHECK, target_system: 1, target_component: 1 };
    let cancel = pad.stations[CREW].encode(&MavMessage::COMMAND_CANCEL(cancel));
    pad.sent.clear();
    pad.endpoint.on_frame(0, &cancel, &pad.vehicle.state());
    pad.run(0.3);
    assert_eq!(pad.answers(), [MavResult::MAV_RESULT_CANCELLED as u8]);
    assert!(!pad.vehicle.computer().pad_check().is_running());
}

#[test]
fn a_held_vehicle_disarms_after_a_minute() {
    for pad in [Pad::rocket, Pad::hanging] {
        let mut pad = pad();
        pad.count_down();
        pad.speaking.clear();
        pad.run(UPLINK_SILENT_S + 0.2);
        assert_eq!(pad.vehicle.phase(), Phase::PadArmed);
        pad.run(HOLD_LIMIT_S - 1.0);
        assert_eq!(pad.vehicle.phase(), Phase::PadArmed);
        pad.run(1.1);
        assert_eq!(pad.vehicle.phase(), Phase::PadIdle);
        assert!(!pad.vehicle.aborted() && pad.message_count("held for 60 s without a new start") == 1);
        assert_eq!(pad.status().hold, TdHold::TD_HOLD_NONE);
    }
}

/// Its station was killed, and no crew stands beside it.
#[test]
fn a_vehicle_that_nobody_commands_disarms_itself() {
    let mut pad = Pad::rocket();
    assert_eq!(pad.request(CREW, ARM, 1.0), ACCEPTED);
    pad.speaking.clear();
    pad.run(59.5);
    assert!(pad.vehicle.mode().interlocks.armed);
    pad.run(1.5);
    assert!(!pad.vehicle.mode().interlocks.armed && !pad.vehicle.aborted());
    assert_eq!(pad.message_count("nothing received from 255/190 for 60 s: DISARMED"), 1);
    // The next station that arms it is in command.
    pad.speaking = vec![OTHER];
    pad.run(1.0);
    assert_eq!(pad.request(OTHER, ARM, 1.0), ACCEPTED);
    assert_eq!(pad.request(OTHER, START, 0.0), ACCEPTED);
}

#[test]
fn any_station_holds_by_command_and_repeats_it_without_a_complaint() {
    for pad in [Pad::rocket, Pad::hanging] {
        let mut pad = pad();
        assert_eq!(pad.request(OTHER, HOLD, 0.0), DENIED, "nothing to hold");
        pad.count_down();
        assert_eq!(pad.request(OTHER, HOLD, 0.0), ACCEPTED);
        assert_eq!((pad.counting(), pad.message_count("station 254/190 requests a hold")), (false, 1));
        assert_eq!(pad.status().hold, TdHold::TD_HOLD_COMMANDED);
        let complaints = pad.message_count("refused");
        for _ in 0..10 {
            assert_eq!(pad.request(OTHER, HOLD, 0.0), ACCEPTED);
        }
        assert_eq!((pad.message_count("refused"), pad.message_count("HOLD: no countdown")), (complaints, 1));
        assert!(pad.vehicle.mode().interlocks.armed);
    }
}

#[test]
fn a_vehicle_that_starts_by_itself_needs_no_station() {
    let mut pad = Pad::rocket();
    pad.endpoint = VehicleEndpoint::new(VehicleKind::Simulated).starting_by_itself();
    pad.speaking.clear();
    frame(&mut pad.vehicle, &mut pad.endpoint, &[CrewCommand::Arm, CrewCommand::Start]);
    pad.run(pad.vehicle.computer().countdown_s() + 0.5);
    assert!(!pad.vehicle.phase().on_pad(), "{:?}", pad.vehicle.phase());
}

#[test]
fn an_abort_in_the_air_is_acknowledged_when_its_latch_is_seen() {
    let mut pad = Pad::rocket();
    pad.count_down();
    pad.run(pad.vehicle.computer().countdown_s() + 1.0);
    assert!(pad.vehicle.phase().in_descent());
    pad.transmit(CREW, ABORT, 1.0);
    // The flight computer takes it at its next frame: until then nothing is latched and nothing
    // acknowledged.
    let before = frames(pad.endpoint.poll(&pad.vehicle.state()));
    assert!(!pad.vehicle.aborted());
    assert!(before.iter().all(|frame| CommandAnswer::from_frame(frame).is_none()));
    pad.transmit(CREW, ABORT, 1.0);
    pad.frame();
    assert!(pad.vehicle.aborted());
    assert_eq!(pad.answers(), [ACCEPTED], "answered once, although it was repeated");
    assert_eq!(pad.request(CREW, ABORT, 1.0), ACCEPTED, "later aborts are acknowledged at once");
}

#[test]
fn the_motor_and_its_wait_are_on_the_wire() {
    let mut pad = Pad::rocket();
    let status = pad.status();
    assert_eq!((status.motor, status.approach_wait_s), (TdMotor::TD_MOTOR_LIVE, 0));
    pad.count_down();
    assert_eq!(pad.status().approach_wait_s, u16::MAX, "armed");
}
