//! Two people at a vehicle's endpoint, with frames that are really signed: who may arm and start,
//! and who may not.

use flight::computer::crew::People;
use protocol::command::StationHold;
use protocol::dialect::{TD_CREW_DATA, TdAct, TdHold};
use protocol::hub::{Hub, LinkEvent, Received};
use protocol::signing::{Memory, Signing};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::*;

/// 2026-11-21, in the units of signatures.
const CLOCK: u64 = 37_500_000_000_000;

/// The places of the stations.
const RANGE: usize = 0;
const FLIGHT: usize = 1;
const FLIGHT_TOO: usize = 2;
const PAD: usize = 3;
/// Has the key that all share.
const OBSERVER: usize = 4;
/// Has no key of this launch.
const STRANGER: usize = 5;

struct Station {
    encoder: Encoder,
    signing: Signing,
}

/// A vehicle with a crew, and all stations.
struct Launch {
    vehicle: Vehicle,
    endpoint: VehicleEndpoint,
    hub: Hub,
    stations: Vec<Station>,
    /// Stations that send heartbeats, ten a second.
    speaking: Vec<usize>,
    sent: Vec<Frame>,
    /// The last TD_CREW.
    crew: Option<TD_CREW_DATA>,
    frames: u64,
}

impl Launch {
    fn new(people: People) -> Self {
        let operators = operators();
        let numbers = operators.iter().map(|operator| operator.number);
        let keys = numbers.map(|number| (number, key(number))).collect();
        let signing = Signing::new(key(100), Memory::default()).with_operators(keys);
        let station = |place: usize| {
            let with = |key| Signing::new(key, Memory::default());
            let signing = match place {
                STRANGER => with(key(200)),
                OBSERVER => with(key(100)),
                _ => with(key(place as u8 + 1)).as_operator(place as u8 + 1, key(100)),
            };
            let address = Address { system_id: 255 - place as u8, component_id: 190 };
            Station { encoder: Encoder::new(address), signing }
        };
        let mut launch = Self {
            vehicle: rocket().with_crew(people, operators),
            endpoint: VehicleEndpoint::sending_to_crew(VehicleKind::Simulated),
            hub: Hub::new(1, Some(signing)),
            stations: (0..6).map(station).collect(),
            speaking: vec![RANGE, FLIGHT, PAD],
            sent: Vec::new(),
            crew: None,
            frames: 0,
        };
        launch.run(4.0);
        launch
    }

    fn two() -> Self {
        Self::new(People::Two { first: FIRST_PROPOSAL })
    }

    fn clock(&self) -> u64 {
        CLOCK + (1e5 * self.vehicle.time_s()) as u64
    }

    fn run(&mut self, duration_s: f64) {
        let end_s = self.vehicle.time_s() + duration_s;
        while self.vehicle.time_s() < end_s {
            self.frame();
        }
    }

    fn frame(&mut self) {
        if self.frames.is_multiple_of(20) {
            for station in self.speaking.clone() {
                let beat = self.signed(station, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
                self.deliver(&beat);
            }
        }
        self.frames += 1;
        let (_, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
        for Outgoing { frame, .. } in leaving {
            if let Ok(MavMessage::TD_CREW(crew)) = frame.decode() {
                self.crew = Some(crew);
            }
            self.sent.push(frame);
        }
    }

    fn signed(&mut self, station: usize, message: &MavMessage) -> Frame {
        let frame = self.stations[station].encoder.encode(message);
        self.signed_for(station, &frame)
    }

    fn signed_for(&mut self, station: usize, frame: &Frame) -> Frame {
        let clock = self.clock();
        let signing = &mut self.stations[station].signing;
        let link_id = signing.link_id(0);
        signing.sign(frame, link_id, clock)
    }

    /// Through the hub, which checks the signature.
    fn deliver(&mut self, frame: &Frame) {
        let clock = self.clock();
        let received = Received::Stream(0, frame.as_bytes().to_vec());
        for event in self.hub.take(0, received, Duration::ZERO, clock) {
            match event {
                LinkEvent::Frame(frame) => self.endpoint.on_frame(0, &frame, &self.vehicle.state()),
                LinkEvent::Rejected(frame, why) => self.endpoint.on_rejected(&frame, why),
                _ => {}
            }
        }
    }

    fn command(&mut self, station: usize, command: u16, param1: f32, param3: f32) -> Frame {
        let frame = any_command(&mut self.stations[station].encoder, command, [param1, 0.0, param3]);
        self.signed_for(station, &frame)
    }

    /// Sends a command; returns the answer to this station, if any, and the vehicle's texts.
    fn send(&mut self, station: usize, command: u16, param1: f32, param3: f32) -> (Option<u8>, String) {
        let frame = self.command(station, command, param1, param3);
        self.sent.clear();
        self.deliver(&frame);
        self.run(0.4);
        let to = frame.source();
        let mut answers = self.sent.iter().filter_map(CommandAnswer::from_frame);
        let answer = answers.rfind(|answer| answer.target == to);
        (answer.map(|answer| answer.result), texts(&self.sent).join("; "))
    }

    fn propose(&mut self, station: usize, command: u16) -> (Option<u8>, String) {
        self.send(station, command, 1.0, 0.0)
    }

    fn confirms(&mut self, station: usize, command: u16) -> (Option<u8>, String) {
        let number = self.crew.as_ref().map_or(0, |crew| crew.ask_number);
        self.send(station, command, 1.0, f32::from(number))
    }

    fn armed(&self) -> bool {
        self.vehicle.mode().interlocks.armed
    }

    fn counts_down(&self) -> bool {
        self.vehicle.mode().countdown_end_s.is_some()
    }

    /// Ready to be started.
    fn armed_by_two() -> Self {
        let mut launch = Self::two();
        launch.propose(FLIGHT, ARM);
        assert_eq!(launch.confirms(RANGE, ARM).0, ACCEPTED);
        launch
    }
}

const ACCEPTED: Option<u8> = Some(super::ACCEPTED);
const NOT_NOW: Option<u8> = Some(super::NOT_NOW);
const DENIED: Option<u8> = Some(super::DENIED);

#[test]
fn one_proposes_another_confirms_and_both_are_named() {
    let mut launch = Launch::two();
    launch.speaking.push(FLIGHT_TOO);
    launch.run(0.2);
    // A command of any other client with one of the keys is a proposal, and is refused with its
    // reason.
    let (answer, words) = launch.propose(FLIGHT, ARM);
    assert_eq!(answer, NOT_NOW);
    assert!(
        words.contains("FLIGHT Bob requests to arm: RANGE SAFETY or PAD must confirm within 10 s"),
        "{words}"
    );
    let crew = launch.crew.clone().unwrap();
    assert_eq!((crew.people, crew.act, crew.asked_by), (2, TdAct::TD_ACT_ARM, 2));
    assert_eq!(crew.ask_number, FIRST_PROPOSAL + 1);
    for (station, reason) in [
        (FLIGHT, "FLIGHT Bob requested it: another role must confirm"),
        (FLIGHT_TOO, "another role than FLIGHT must confirm"),
        (OBSERVER, "only an operator with a key of their own commands"),
    ] {
        let (answer, words) = launch.confirms(station, ARM);
        assert_eq!(answer, DENIED);
        assert!(words.contains(reason), "{words}");
    }
    assert!(!launch.armed());
    let (answer, words) = launch.confirms(RANGE, ARM);
    assert_eq!(answer, ACCEPTED);
    assert!(words.contains("arm: requested by FLIGHT Bob, confirmed by RANGE SAFETY Ann"), "{words}");
    assert!(launch.armed());
    // The proposer is in command.
    let crew = launch.crew.clone().unwrap();
    assert_eq!((crew.commanded_by, crew.commanding_system), (2, 254));
}

#[test]
fn the_start_goes_on_while_the_confirmer_taps() {
    let mut launch = Launch::armed_by_two();
    launch.propose(FLIGHT, START);
    assert!(!launch.counts_down());
    assert_eq!(launch.confirms(PAD, START).0, ACCEPTED);
    assert!(launch.counts_down());
    assert_eq!(launch.send(FLIGHT, TAP, 0.0, 0.0).0, DENIED);
    for _ in 0..2 {
        assert_eq!(launch.send(PAD, TAP, 0.0, 0.0).0, ACCEPTED);
        launch.run(0.4);
    }
    assert_eq!(launch.crew.clone().unwrap().tapped_by, 4);
    launch.sent.clear();
    launch.run(0.5);
    assert!(launch.armed() && !launch.counts_down(), "held");
    let held = decoded!(launch.sent, TD_FLIGHT_STATUS).last();
    assert_eq!(held.unwrap().hold, TdHold::TD_HOLD_TAP_OVERDUE);
    assert_eq!(launch.crew.clone().unwrap().held_by, 4);
}

/// Its screen or its log has failed: its operator has requested nothing.
#[test]
fn a_hold_that_a_station_decides_names_the_station_and_no_person() {
    let mut launch = Launch::armed_by_two();
    launch.propose(FLIGHT, START);
    assert_eq!(launch.confirms(PAD, START).0, ACCEPTED);
    let params = [0.0, StationHold::NoScreen.parameter(), 0.0];
    let hold = any_command(&mut launch.stations[FLIGHT].encoder, HOLD, params);
    let hold = launch.signed_for(FLIGHT, &hold);
    launch.sent.clear();
    launch.deliver(&hold);
    launch.run(2.0);
    assert!(!launch.counts_down());
    let words = texts(&launch.sent).join("; ");
    assert!(words.contains("holds by itself: no commanding screen") && !words.contains("Bob"), "{words}");
    assert_eq!(launch.crew.clone().unwrap().held_by, 0);
}

/// The silence of the station that commands is watched already.
#[test]
fn of_the_two_who_start_the_one_who_does_not_command_taps() {
    // Bob proposed the arming, and commands.
    let mut launch = Launch::armed_by_two();
    launch.propose(RANGE, START);
    assert_eq!(launch.confirms(FLIGHT, START).0, ACCEPTED);
    assert_eq!(launch.send(FLIGHT, TAP, 0.0, 0.0).0, DENIED);
    assert_eq!(launch.send(RANGE, TAP, 0.0, 0.0).0, ACCEPTED);
    let crew = launch.crew.clone().unwrap();
    assert_eq!((crew.commanded_by, crew.tapped_by), (2, 1));
    // Nor does she take command while she taps: in the last moment nothing holds, and he may be
    // silent.
    while launch.vehicle.mode().countdown_remaining_s(launch.vehicle.time_s()).unwrap() > 3.0 {
        launch.send(RANGE, TAP, 0.0, 0.0);
    }
    launch.speaking = vec![RANGE];
    for _ in 0..5 {
        launch.send(RANGE, TAP, 0.0, 0.0);
    }
    launch.run(0.15);
    assert!(launch.counts_down());
    assert_eq!(launch.send(RANGE, TAKE_COMMAND, 0.0, 0.0).0, DENIED);
}

/// A loss before T-3 s holds; in the last 2 s none does.
#[test]
fn taps_that_end_before_t_minus_three_seconds_hold_the_countdown() {
    for tenths in 15..=60 {
        let mut launch = Launch::armed_by_two();
        launch.propose(FLIGHT, START);
        launch.confirms(RANGE, START);
        let left_s = |launch: &Launch| launch.vehicle.mode().countdown_remaining_s(launch.vehicle.time_s());
        while left_s(&launch).is_some_and(|left_s| left_s > 0.1 * f64::from(tenths)) {
            let tap = launch.command(RANGE, TAP, 0.0, 0.0);
            launch.deliver(&tap);
            launch.run(0.1);
        }
        launch.run(6.5);
        let flies = !launch.vehicle.phase().on_pad();
        match tenths {
            31.. => assert!(!flies, "taps end at T-{tenths} tenths"),
            ..=20 => assert!(flies, "taps end at T-{tenths} tenths"),
            _ => {}
        }
    }
}

#[test]
fn whoever_holds_a_key_of_this_crew_holds_and_aborts_and_nobody_else() {
    let mut launch = Launch::armed_by_two();
    launch.propose(FLIGHT, START);
    launch.confirms(RANGE, START);
    assert_ne!(launch.send(STRANGER, HOLD, 0.0, 0.0).0, ACCEPTED);
    assert_ne!(launch.send(STRANGER, ABORT, 1.0, 0.0).0, ACCEPTED);
    launch.send(RANGE, TAP, 0.0, 0.0);
    // An observer has the key that all share.
    assert_eq!(launch.send(OBSERVER, ARM, 0.0, 0.0).0, DENIED, "a disarm");
    assert!(launch.counts_down() && !launch.vehicle.aborted());
    assert_eq!(launch.send(OBSERVER, HOLD, 0.0, 0.0).0, ACCEPTED);
    assert!(!launch.counts_down());
    let mut aborted = Launch::armed_by_two();
    let (answer, words) = aborted.send(OBSERVER, ABORT, 1.0, 0.0);
    assert_eq!(answer, ACCEPTED);
    assert!(words.contains("station 251/190, with the key that all share, aborts"), "{words}");
    assert!(aborted.vehicle.aborted());
    launch.propose(FLIGHT, START);
    assert_eq!(launch.confirms(RANGE, START).0, ACCEPTED);
    assert_eq!(launch.send(FLIGHT_TOO, HOLD, 0.0, 0.0).0, ACCEPTED);
    assert!(!launch.counts_down());
    assert_eq!(launch.crew.clone().unwrap().held_by, 3);
    assert_eq!(launch.send(PAD, ABORT, 1.0, 0.0).0, ACCEPTED);
    assert!(launch.vehicle.aborted());
}

/// From the frame that arrives to the latch: one frame of the vehicle, with a crew as without.
#[test]
fn an_abort_takes_as_many_frames_with_a_crew_as_without() {
    let frames_to_latch = |people: Option<People>| {
        let mut launch = Launch::two();
        if people.is_none() {
            (launch.vehicle, launch.endpoint) =
                (rocket(), VehicleEndpoint::sending_signed(VehicleKind::Simulated));
            launch.hub = Hub::new(1, Some(Signing::new(key(1), Memory::default())));
            launch.run(4.0);
        }
        let abort = launch.command(RANGE, ABORT, 1.0, 0.0);
        launch.deliver(&abort);
        let mut frames = 0;
        while !launch.vehicle.aborted() {
            launch.frame();
            frames += 1;
        }
        frames
    };
    assert_eq!(frames_to_latch(Some(People::Two { first: 1 })), 1);
    assert_eq!(frames_to_latch(None), 1);
}

/// Every operator who may command may check, alone; others may not.
#[test]
fn a_check_takes_one_operator_with_a_key() {
    let mut launch = Launch::two();
    for (station, answer) in [(OBSERVER, DENIED), (PAD, ACCEPTED)] {
        assert_eq!(launch.send(station, CHECK, 1.0, 0.0).0, answer);
    }
}

#[test]
fn one_person_mode_needs_one_key() {
    let mut launch = Launch::new(People::One);
    assert_eq!(launch.propose(OBSERVER, ARM).0, DENIED);
    assert_eq!(launch.propose(PAD, ARM).0, ACCEPTED);
    assert!(launch.armed());
    launch.run(1.0);
    let crew = launch.crew.clone().unwrap();
    assert_eq!((crew.people, crew.commanded_by), (1, 4));
    assert_eq!(launch.propose(PAD, START).0, ACCEPTED);
    launch.run(3.0);
    assert!(launch.counts_down(), "no taps");
}

#[test]
fn the_command_passes_only_from_a_silent_station_to_the_same_role_or_range_safety() {
    let mut launch = Launch::armed_by_two();
    launch.speaking = vec![RANGE, FLIGHT, FLIGHT_TOO, PAD];
    assert_eq!(launch.send(FLIGHT_TOO, TAKE_COMMAND, 0.0, 0.0).0, DENIED);
    launch.speaking = vec![RANGE, FLIGHT_TOO, PAD];
    launch.run(3.0);
    let (answer, words) = launch.send(PAD, TAKE_COMMAND, 0.0, 0.0);
    assert_eq!(answer, DENIED);
    assert!(words.contains("only FLIGHT or RANGE SAFETY takes over from FLIGHT Bob"), "{words}");
    assert_eq!(launch.send(OBSERVER, TAKE_COMMAND, 0.0, 0.0).0, DENIED);
    let (answer, words) = launch.send(FLIGHT_TOO, TAKE_COMMAND, 0.0, 0.0);
    assert_eq!(answer, ACCEPTED);
    assert!(
        words.contains("FLIGHT Cat (253/190) takes command from FLIGHT Bob (254/190), silent for"),
        "{words}"
    );
    let crew = launch.crew.clone().unwrap();
    assert_eq!((crew.commanded_by, crew.commanding_system), (3, 253));
    assert!(launch.armed());
    // A start needs two people again, and the new commander's silence holds it.
    launch.propose(FLIGHT_TOO, START);
    launch.confirms(RANGE, START);
    assert!(launch.counts_down());
    launch.speaking = vec![RANGE, PAD];
    for _ in 0..3 {
        launch.send(RANGE, TAP, 0.0, 0.0);
        launch.run(0.5);
    }
    assert!(!launch.counts_down());
}

/// Random frames of all stations, with replays, wrong keys, forged numbers and races, at a vehicle
/// that is disarmed again whenever it was armed. It is armed only in a frame in which the
/// confirmation of another role arrived, of a proposal from the ten seconds before.
#[test]
fn random_signed_frames_arm_nothing_without_two_keys() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut launch = Launch::two();
    let mut recorded: Vec<Frame> = Vec::new();
    let (mut armed, mut sent) = (0, 0);
    // The station that disarms it keeps the others from arming for three seconds.
    for _ in 0..40_000 {
        let dice = random.next_u32();
        let waits = launch.vehicle.computer().crew().two_person.waiting(launch.vehicle.time_s());
        let mut confirmed_by = None;
        for _ in 0..(dice & 3) {
            sent += 1;
            let dice = random.next_u32();
            let station = (dice & 0xFF) as usize % 6;
            let number = match dice >> 8 & 3 {
                0 => 0,
                1 | 2 => waits.map_or(FIRST_PROPOSAL, |proposal| proposal.number),
                _ => (dice >> 16) as u16,
            };
            if (dice >> 10).is_multiple_of(8) && !recorded.is_empty() {
                // Used before, or stolen and never used.
                let old = recorded[(dice >> 13) as usize % recorded.len()].clone();
                launch.deliver(&old);
                continue;
            }
            let frame = launch.command(station, ARM, 1.0, f32::from(number));
            if (dice >> 13).is_multiple_of(8) {
                // Signed with one key in the name of another.
                let forger = &mut launch.stations[station].signing;
                let forged =
                    forger.sign(&frame.without_signature(), (dice >> 16 & 15) as u8, CLOCK + u64::from(dice));
                recorded.push(forged.clone());
                if forged.key_number() != launch.stations[station].signing.link_id(0) {
                    launch.deliver(&forged);
                }
                continue;
            }
            recorded.push(frame.clone());
            if waits.is_some_and(|proposal| proposal.number == number) && station <= PAD {
                confirmed_by = confirmed_by.or(Some(()));
            }
            launch.deliver(&frame);
        }
        launch.frame();
        if launch.armed() {
            armed += 1;
            let proposal = waits.expect("a proposal was waiting before this frame");
            assert!(confirmed_by.is_some(), "armed without a confirmation of proposal {}", proposal.number);
            let disarm = launch.command(RANGE, ARM, 0.0, 0.0);
            launch.deliver(&disarm);
            launch.frame();
            assert!(!launch.armed());
        }
    }
    assert!(armed > 50 && sent > 20_000, "{armed} times armed by {sent} frames: too few to show anything");
    assert_eq!(launch.hub.signing().map(|counters| counters.wrong > 1_000), Some(true));
}

/// A log that is fetched thins the telemetry, so only an operator fetches it.
#[test]
fn the_log_is_for_operators() {
    use protocol::ftp::packet::Refusal;
    use protocol::ftp::{Opcode, Packet};
    use protocol::identity::VEHICLE;

    let mut launch = Launch::two();
    launch.endpoint.offer(Box::new(super::questions::log(1000)));
    let fetches = |launch: &mut Launch, station: usize, packet: &Packet| {
        let frame = launch.signed(station, &packet.message(VEHICLE));
        launch.sent.clear();
        launch.deliver(&frame);
        launch.run(0.5);
        launch.sent.iter().find_map(Packet::answer_in).map(|(_, answer)| answer)
    };
    let open = Packet::request(1, 0, Opcode::OPEN_FILE_RO, 0, "/log/flight.mcap");
    let read = Packet { size: 239, ..Packet::request(2, 0, Opcode::READ_FILE, 0, "") };
    assert_eq!(fetches(&mut launch, FLIGHT, &open).unwrap().number(), Some(1000));
    assert_eq!(fetches(&mut launch, OBSERVER, &open).unwrap().refusal(), Some(Refusal::Busy));
    assert_eq!(fetches(&mut launch, STRANGER, &open), None, "not signed with a known key");
    // The operator's file is still open.
    assert_eq!(fetches(&mut launch, FLIGHT, &read).unwrap().data.len(), 239);
}
