//! Who commands which vehicle: the boot that a command names, programs that share their ids, and a
//! million random requests of a crew of two people.
#![expect(clippy::verbose_bit_mask, reason = "bits of a random number are its dice")]
#![expect(clippy::float_cmp, reason = "times of the same frame are the same number")]

use flight::computer::crew::People;
use flight::rules::operator::{Operator, Role};
use flight::rules::phase::{LAST_HOLD_S, UPLINK_PROVEN_S, UPLINK_SILENT_S};
use flight::rules::two_person::{CONFIRM_WITHIN_S, TAP_WITHIN_S};
use protocol::dialect::MavType;
use protocol::hub::Origin;
use protocol::signing::{Memory, Signing};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::super::Path;
use super::*;

/// Commands that can move something, with their parameter 1.
const MOVING: [(u16, f32); 6] =
    [(ARM, 1.0), (START, 0.0), (TAP, 0.0), (TAKE_COMMAND, 0.0), (CHECK, 1.0), (CHECK, 2.0)];

const BOOT: u32 = 7_654_321;

/// A program connected to the vehicle.
#[derive(Clone)]
struct Program {
    address: Address,
    path: Path,
    by: Option<Operator>,
    /// Its heartbeat, signed if it has an operator.
    beat: Frame,
    speaks: bool,
    /// Time of its last heartbeat, s.
    received_at_s: f64,
}

impl Program {
    fn new(system_id: u8, session: u32, stream: u64, by: Option<Operator>) -> Self {
        let address = Address { system_id, component_id: 190 };
        let beat = Encoder::new(address).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: session,
            mavtype: MavType::MAV_TYPE_GCS,
            ..HEARTBEAT_DATA::default()
        }));
        // The endpoint does not check the signature itself.
        let number = by.map_or(0, |by: Operator| by.number);
        let mut signing = Signing::new(key(number), Memory::default()).as_operator(number, key(100));
        let link_id = signing.link_id(0);
        let beat = if by.is_some() { signing.sign(&beat, link_id, 37_500_000_000_000) } else { beat };
        let path = Path { link: 0, origin: Some(Origin::Stream(stream)) };
        Self { address, path, by, beat, speaks: true, received_at_s: f64::NEG_INFINITY }
    }

    fn request(&self, command: u16, param1: f32, confirms: u16, boot: f32) -> CommandRequest {
        let params = [param1, 0.0, f32::from(confirms), 0.0, 0.0, 0.0, boot];
        CommandRequest { source: self.address, target: VEHICLE, command, params, confirmation: 0 }
    }
}

struct Range {
    vehicle: Vehicle,
    endpoint: VehicleEndpoint,
    programs: Vec<Program>,
    frames: u64,
    sent: Vec<Frame>,
}

impl Range {
    fn of(vehicle: Vehicle, endpoint: VehicleEndpoint, programs: Vec<Program>) -> Self {
        let endpoint = endpoint.booted(BOOT);
        let mut range = Self { vehicle, endpoint, programs, frames: 0, sent: Vec::new() };
        range.run(6.0);
        range
    }

    fn without_operators(programs: Vec<Program>) -> Self {
        Self::of(rocket(), VehicleEndpoint::new(VehicleKind::Simulated), programs)
    }

    fn frame(&mut self) {
        if self.frames.is_multiple_of(20) {
            let time_s = self.vehicle.time_s();
            for program in self.programs.iter_mut().filter(|program| program.speaks) {
                self.endpoint.on_frame(program.path, &program.beat, &self.vehicle.state());
                program.received_at_s = time_s;
            }
        }
        self.frames += 1;
        let (_, leaving) = frame(&mut self.vehicle, &mut self.endpoint, &[]);
        self.sent.extend(leaving.into_iter().map(|leaving| leaving.frame));
    }

    fn run(&mut self, duration_s: f64) {
        let end_s = self.vehicle.time_s() + duration_s - 1e-9;
        while self.vehicle.time_s() < end_s {
            self.frame();
        }
    }

    fn put(&mut self, program: usize, request: &CommandRequest) {
        let Program { path, by, .. } = self.programs[program];
        self.endpoint.on_command(path, (request, by), &self.vehicle.state());
    }

    /// The answer to a request.
    fn request_answer(&mut self, program: usize, request: &CommandRequest) -> u8 {
        self.sent.clear();
        self.put(program, request);
        self.run(0.3);
        let answers: Vec<u8> =
            self.sent.iter().filter_map(CommandAnswer::from_frame).map(|answer| answer.result).collect();
        assert_eq!(answers.len(), 1, "{answers:?}");
        // Answers have a share of each second.
        self.run(6.0);
        answers[0]
    }

    fn counts_down(&self) -> bool {
        self.vehicle.mode().countdown_end_s.is_some()
    }
}

#[test]
fn what_moves_something_names_the_boot_it_is_for_and_what_stops_it_need_not() {
    let mut range = Range::without_operators(vec![Program::new(255, 7, 1, None)]);
    let other = (BOOT + 1) as f32;
    for (command, param1) in MOVING {
        let request = range.programs[0].request(command, param1, 0, other);
        assert_eq!(range.request_answer(0, &request), DENIED, "{command}");
        for nonsense in [0.75, -1.0, 16_777_216.0, f32::INFINITY, 0.0, f32::NAN] {
            let request = range.programs[0].request(command, param1, 0, nonsense);
            assert_eq!(range.request_answer(0, &request), DENIED, "{nonsense}");
        }
    }
    let arm = range.programs[0].request(ARM, 1.0, 0, BOOT as f32);
    let start = range.programs[0].request(START, 0.0, 0, BOOT as f32);
    for (command, param1) in [(HOLD, 0.0), (ARM, 0.0), (ABORT, 1.0)] {
        for request in [&arm, &start] {
            range.put(0, request);
            range.frame();
        }
        assert!(range.counts_down());
        range.run(0.5);
        let request = range.programs[0].request(command, param1, 0, other);
        assert_eq!(range.request_answer(0, &request), ACCEPTED, "{command}");
        assert!(!range.counts_down());
    }
    assert!(range.vehicle.aborted());
}

#[test]
fn with_another_vehicle_under_our_ids_a_command_must_name_its_boot() {
    let mut range = Range::without_operators(vec![Program::new(255, 0, 1, None)]);
    let twin = Encoder::new(VEHICLE).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    range.endpoint.on_frame(0, &twin, &range.vehicle.state());
    let [unnamed, named] = [0.0, BOOT as f32].map(|boot| range.programs[0].request(ARM, 1.0, 0, boot));
    let disarm = range.programs[0].request(ARM, 0.0, 0, 0.0);
    assert_eq!(range.request_answer(0, &unnamed), NOT_NOW);
    assert!(!range.vehicle.mode().interlocks.armed);
    range.endpoint.on_frame(0, &twin, &range.vehicle.state());
    assert_eq!(range.request_answer(0, &named), ACCEPTED);
    assert_eq!(range.request_answer(0, &disarm), ACCEPTED);
    assert_eq!(range.request_answer(0, &unnamed), ACCEPTED, "some seconds later");
}

/// Only a Touchdown station has a session in its heartbeats.
#[test]
fn a_program_without_a_session_arms_only_the_boot_that_it_names() {
    let ours = || Program::new(255, 7, 1, None);
    let theirs = || Program::new(254, 0, 2, None);
    let real = VehicleEndpoint::new(VehicleKind::Real);
    let without_operators = Range::without_operators(vec![theirs(), ours()]);
    let of_real = Range::of(rocket(), real, vec![theirs()]);
    for mut range in std::iter::once(without_operators).chain(std::iter::once(of_real)) {
        for (command, param1) in MOVING {
            let unnamed = range.programs[0].request(command, param1, 0, 0.0);
            assert_eq!(range.request_answer(0, &unnamed), DENIED, "{command}");
        }
        // Also when our station has left.
        range.programs[1..].iter_mut().for_each(|ours| ours.speaks = false);
        range.run(15.0);
        let [unnamed, named] =
            [f32::NAN, BOOT as f32].map(|boot| range.programs[0].request(ARM, 1.0, 0, boot));
        assert_eq!(range.request_answer(0, &unnamed), DENIED);
        assert!(!range.vehicle.mode().interlocks.armed);
        assert_eq!(range.request_answer(0, &named), ACCEPTED);
    }
    let mut range = Range::without_operators(vec![theirs()]);
    for boot in [BOOT as f32, 0.0, f32::NAN] {
        let [arm, disarm] = [1.0, 0.0].map(|param1| range.programs[0].request(ARM, param1, 0, boot));
        assert_eq!(range.request_answer(0, &arm), ACCEPTED, "{boot}");
        assert_eq!(range.request_answer(0, &disarm), ACCEPTED);
    }
}

#[test]
fn the_sender_of_an_arming_a_start_or_an_abort_beside_another_station_is_reported() {
    let mut theirs = Program::new(254, 0, 2, None);
    theirs.path.origin = Some(Origin::Datagram(([192, 0, 2, 7], 14_550).into()));
    let mut range = Range::without_operators(vec![Program::new(255, 7, 1, None), theirs]);
    for (command, param1, name) in [(ARM, 1.0, "arm"), (START, 0.0, "start"), (ABORT, 1.0, "abort")] {
        range.sent.clear();
        let request = range.programs[1].request(command, param1, 0, BOOT as f32);
        range.put(1, &request);
        range.run(1.0);
        let wanted = format!("254/190 at 192.0.2.7:14550: {name}");
        let texts = texts(&range.sent);
        assert!(texts.contains(&wanted), "{wanted}: {texts:?}");
    }
}

#[test]
fn a_command_for_every_vehicle_stops_and_moves_nothing() {
    let mut range = Range::without_operators(vec![Program::new(255, 7, 1, None)]);
    let everybody = Address { system_id: 0, component_id: 0 };
    for (command, param1) in MOVING {
        let request = CommandRequest {
            target: everybody,
            ..range.programs[0].request(command, param1, 0, BOOT as f32)
        };
        assert_eq!(range.request_answer(0, &request), DENIED, "{command}");
    }
    assert!(!range.vehicle.mode().interlocks.armed);
    // Some clients name the system and every component of it.
    let whole = |request| CommandRequest { target: Address { system_id: 1, component_id: 0 }, ..request };
    for (command, param1) in [(HOLD, 0.0), (ARM, 0.0), (ABORT, 1.0)] {
        for (command, param1) in [(ARM, 1.0), (START, 0.0)] {
            let request = whole(range.programs[0].request(command, param1, 0, BOOT as f32));
            range.put(0, &request);
            range.frame();
        }
        assert!(range.counts_down());
        range.run(0.5);
        let request =
            CommandRequest { target: everybody, ..range.programs[0].request(command, param1, 0, 0.0) };
        assert_eq!(range.request_answer(0, &request), ACCEPTED, "{command}");
        assert!(!range.counts_down());
    }
    assert!(range.vehicle.aborted());
}

/// Two stations each of Ann and Bob, one each of Cat and Dan, one with the shared key, and two that
/// share ids with another.
fn crowd() -> Vec<Program> {
    let people = operators();
    let by = |number: usize| Some(people[number - 1]);
    vec![
        Program::new(255, 11, 1, by(1)),
        Program::new(254, 12, 2, by(2)),
        Program::new(253, 13, 3, by(3)),
        Program::new(252, 14, 4, by(4)),
        Program::new(251, 15, 5, by(1)),
        Program::new(250, 16, 6, None),
        Program::new(254, 17, 7, by(2)),
        Program::new(255, 18, 8, by(4)),
    ]
}

/// Independent record of accepted commands: from a station with an uplink, alone under its ids, for
/// this vehicle.
struct Accepted {
    program: usize,
    command: u16,
    confirms: u16,
    at_s: f64,
}

/// The rule, stated independently and checked in every frame: a vehicle is armed, and a countdown
/// begins, only by a proposal and the confirmation of another person in another role. Both come
/// from stations with an uplink, alone under their ids, for this boot of this vehicle. In the
/// countdown one person commands and another one taps; without the heartbeats of the one or the
/// taps of the other it is held, except in its last moment.
#[test]
#[expect(clippy::too_many_lines, reason = "one loop: what is drawn, what is sent, and the rule that is held")]
fn a_million_random_requests_move_nothing_but_by_the_rule() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let two = People::Two { first: FIRST_PROPOSAL };
    let fresh = || {
        let vehicle = rocket().with_crew(two, operators());
        let mut range = Range::of(vehicle, VehicleEndpoint::sending_to_crew(VehicleKind::Simulated), crowd());
        for program in [6, 7] {
            range.programs[program].speaks = false;
        }
        range.run(6.0);
        range
    };
    let mut range = fresh();
    let mut accepted: Vec<Accepted> = Vec::new();
    let (mut requests, mut armed, mut started, mut released, mut taken) = (0_u32, 0, 0, 0, 0);
    while requests < 1_000_000 {
        let time_s = range.vehicle.time_s();
        let before = *range.vehicle.mode();
        let crew = range.vehicle.computer().crew().two_person;
        let commander_before = range.endpoint.uplink_state(time_s).commander;
        accepted.retain(|one| time_s - one.at_s <= CONFIRM_WITHIN_S + 1.0);
        // Stations fall silent and return; most of the time the twins are silent.
        let dice = random.next_u32();
        if dice.is_multiple_of(256) {
            let place = (dice >> 8) as usize % range.programs.len();
            range.programs[place].speaks =
                if place < 6 { !(dice >> 16).is_multiple_of(8) } else { (dice >> 16).is_multiple_of(8) };
        }
        for _ in 0..6 {
            requests += 1;
            let dice = random.next_u32();
            let program = (dice & 0xFF) as usize % range.programs.len();
            let (command, param1) = match dice >> 8 & 31 {
                0..=9 => (ARM, 1.0),
                10..=19 => (START, 0.0),
                27..=29 => (TAKE_COMMAND, 0.0),
                // Rarely, or nothing would ever fly.
                30 if dice >> 13 & 127 == 0 => (HOLD, 0.0),
                31 if dice >> 13 & 255 == 0 => (ARM, 0.0),
                _ => (TAP, 0.0),
            };
            let confirms = match dice >> 21 & 3 {
                0 => 0,
                1 | 2 => crew.waiting(time_s).map_or(0, |proposal| proposal.number),
                _ => FIRST_PROPOSAL.wrapping_add((dice >> 23 & 63) as u16),
            };
            let boot = [BOOT as f32, BOOT as f32, 0.0, (BOOT - 1) as f32][(dice >> 29 & 3) as usize];
            let request = range.programs[program].request(command, param1, confirms, boot);
            let to_all = dice >> 23 & 15 == 0;
            let target = if to_all { Address { system_id: 0, component_id: 0 } } else { VEHICLE };
            range.put(program, &CommandRequest { target, ..request });
            let of = &range.programs[program];
            let alone = range.programs.iter().enumerate().all(|(other, twin)| {
                other == program || twin.address != of.address || time_s - twin.received_at_s > 5.0
            });
            let is_received = time_s - of.received_at_s <= UPLINK_PROVEN_S;
            let ours = boot as u32 == BOOT && !to_all;
            if alone && ours && (is_received || command != ARM) && of.by.is_some() {
                accepted.push(Accepted { program, command, confirms, at_s: time_s });
            }
        }
        range.frame();
        let now_s = range.vehicle.time_s();
        let mode = *range.vehicle.mode();
        let crew_after = range.vehicle.computer().crew().two_person;
        // Two people of two roles have agreed in this frame: the confirmation arrived now, the
        // proposal some time before.
        let agreed = |command: u16| {
            accepted
                .iter()
                .filter(|one| one.command == command && one.at_s == time_s && one.confirms != 0)
                .any(|confirmation| {
                    let by = range.programs[confirmation.program].by.unwrap();
                    accepted.iter().any(|proposal| {
                        let proposer = range.programs[proposal.program].by.unwrap();
                        proposal.command == command
                            && proposal.confirms == 0
                            && (time_s - proposal.at_s) <= CONFIRM_WITHIN_S + 0.05
                            && proposer.number != by.number
                            && proposer.role != by.role
                    })
                })
        };
        if mode.interlocks.armed && !before.interlocks.armed {
            armed += 1;
            assert!(agreed(ARM), "armed at {now_s} s without two people");
        }
        if mode.countdown_end_s.is_some() && before.countdown_end_s.is_none() {
            started += 1;
            assert!(agreed(START), "started at {now_s} s without two people");
        }
        let commander = range.endpoint.uplink_state(now_s).commander;
        if let (Some(old), Some(new)) = (commander_before, commander)
            && before.interlocks.armed
            && mode.interlocks.armed
            && old.station != new.station
            && !accepted.iter().any(|one| one.command == ARM && one.at_s == time_s && one.confirms != 0)
        {
            taken += 1;
            let (old_by, new_by) = (old.by.unwrap(), new.by.unwrap());
            assert!(old.age_s > UPLINK_PROVEN_S, "taken from a station with an uplink");
            assert!(new_by.role == old_by.role || new_by.role == Role::RangeSafety);
        }
        if let Some(end_s) = mode.countdown_end_s {
            let tapping = crew_after.tapping.expect("somebody taps");
            let commander = commander.expect("somebody commands");
            assert_ne!(tapping.by.number, commander.by.unwrap().number, "one person does the work of two");
            if end_s - now_s > LAST_HOLD_S {
                assert!(commander.age_s <= UPLINK_SILENT_S + 0.05, "{} s", commander.age_s);
                assert!(now_s - tapping.at_s <= TAP_WITHIN_S + 0.05);
            }
        }
        if !mode.phase.on_pad() {
            released += 1;
            assert!(before.countdown_end_s.is_some_and(|end_s| now_s >= end_s - 1e-9));
            range = fresh();
            accepted.clear();
        }
    }
    assert!(armed > 20 && started > 20 && released > 2 && taken > 2, "{armed} {started} {released} {taken}");
}
