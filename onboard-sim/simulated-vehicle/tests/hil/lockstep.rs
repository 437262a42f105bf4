//! In lockstep no wire changes a flight; it only takes longer.

use std::time::Duration;

use hil::computer::Answer;
use hil::lockstep::{Counts, Due, Heard, Lockstep, Patience};
use hil::start::Pace;
use protocol::dialect::MavMessage;
use protocol::identity::{GROUND, VEHICLE};
use protocol::mission::MissionHash;
use sim::remote::RemoteFlight;
use sim::sortie::Sortie;
use simulated_vehicle::hil::assembly::AnswerAssembly;
use simulated_vehicle::hil::computer::ComputerEnd;
use simulated_vehicle::hil::messages::{of_frame, of_start};
use simulated_vehicle::hil::world::{decided_the_same, same_truth};

use super::bad_wire::{BadWire, Badness};
use super::{computer, recipe, start};

const PATIENCE: Patience =
    Patience { send_again_after: Duration::from_millis(20), give_up_after: Duration::from_secs(10) };

/// Both ends and the wires between them.
struct Rig {
    computer: ComputerEnd,
    answers: AnswerAssembly,
    down: BadWire,
    up: BadWire,
    now: Duration,
    flight_id: u32,
}

impl Rig {
    fn new(badness: Badness) -> Self {
        Self {
            computer: computer(&recipe()),
            answers: AnswerAssembly::default(),
            down: BadWire::new(badness, 1, GROUND),
            up: BadWire::new(badness, 2, VEHICLE),
            now: Duration::ZERO,
            flight_id: 77,
        }
    }

    /// Waits for an answer; `None` if the world gives up.
    fn answered(&mut self, lockstep: &mut Lockstep, sent: &[MavMessage]) -> Option<Answer> {
        loop {
            for message in self.down.arrived(self.now) {
                let mut out = Vec::new();
                self.computer.take(&message, &mut out);
                self.up.send(&out, self.now);
            }
            for message in self.up.arrived(self.now) {
                let answer = self.answers.take(&message).filter(|answer| answer.flight_id == self.flight_id);
                if let Some(answer) = answer
                    && lockstep.heard(answer.frame) == Heard::Awaited
                {
                    return Some(answer);
                }
            }
            match lockstep.due(self.now) {
                Due::Wait(_) => self.now += Duration::from_millis(1),
                Due::SendAgain => self.down.send(sent, self.now),
                Due::GiveUp => return None,
            }
        }
    }

    /// Flies a flight beside the same one in one process, and compares every frame.
    fn fly(&mut self, number: u64) -> Option<Counts> {
        let recipe = recipe();
        let mut flight = RemoteFlight::new(&recipe, number).unwrap();
        let mut here = Sortie::new(&recipe, number).unwrap();
        let begin = [of_start(
            &start(&flight, self.flight_id, Pace::Lockstep),
            MissionHash::of(&recipe.mission_toml),
        )];
        let mut lockstep = Lockstep::started(PATIENCE, self.now);
        self.down.send(&begin, self.now);
        let first = self.answered(&mut lockstep, &begin)?;
        flight.act(&first.commands.widen(), first.phase);
        while flight.goes_on() {
            let readings = flight.sense();
            let frame = lockstep.sent_next(self.now);
            let messages = of_frame(self.flight_id, frame, &readings);
            self.down.send(&messages, self.now);
            here.step();
            let answer = self.answered(&mut lockstep, &messages)?;
            flight.act(&answer.commands.widen(), answer.phase);
            assert!(decided_the_same(&here, &answer), "the computers differ in frame {frame}");
            assert!(same_truth(&here, &flight), "the worlds differ in frame {frame}");
        }
        assert!(!here.goes_on());
        assert_eq!(here.outcome(), flight.outcome());
        Some(*lockstep.counts())
    }
}

#[test]
fn a_flight_over_a_good_wire_is_the_one_in_one_process_bit_for_bit() {
    let counts = Rig::new(Badness::default()).fly(0).unwrap();
    assert!(counts.answered > 2000);
    assert_eq!((counts.sent_again, counts.old), (0, 0));
}

#[test]
fn a_flight_over_a_bad_wire_is_the_one_in_one_process_bit_for_bit() {
    let badness = Badness { lost: 100, doubled: 100, late_ms: 12, ..Badness::default() };
    let mut rig = Rig::new(badness);
    for (number, flight_id) in [(1, 77), (2, 78)] {
        rig.flight_id = flight_id;
        let counts = rig.fly(number).unwrap();
        assert!(counts.sent_again > 500 && counts.old > 50, "{counts:?}");
    }
}

#[test]
fn a_wire_that_is_unplugged_and_plugged_in_again_changes_nothing() {
    let unplugged = Badness { unplugged_ms: (500, 9_000), late_ms: 1, ..Badness::default() };
    let counts = Rig::new(unplugged).fly(3).unwrap();
    assert!(counts.sent_again > 400, "{counts:?}");
}

#[test]
fn a_wire_that_stays_unplugged_ends_the_flight() {
    let unplugged = Badness { unplugged_ms: (500, 11_000), late_ms: 1, ..Badness::default() };
    assert_eq!(Rig::new(unplugged).fly(3), None);
}

#[test]
fn a_computer_that_is_restarted_in_flight_does_not_answer_and_the_flight_ends() {
    let recipe = recipe();
    let mut flight = RemoteFlight::new(&recipe, 0).unwrap();
    let mut restarted = computer(&recipe);
    let mut out = Vec::new();
    let readings = flight.sense();
    for message in of_frame(77, 1, &readings) {
        restarted.take(&message, &mut out);
    }
    assert!(out.is_empty(), "{out:?}");
}

#[test]
fn a_computer_with_another_mission_does_not_answer() {
    let recipe = recipe();
    let flight = RemoteFlight::new(&recipe, 0).unwrap();
    let begin = of_start(&start(&flight, 77, Pace::Lockstep), MissionHash::of("another mission"));
    let mut out = Vec::new();
    let events = computer(&recipe).take(&begin, &mut out);
    assert!(out.is_empty() && events.len() == 1, "{events:?}");
}
