//! In real time the world waits for nothing: what is lost is lost, and the flight goes on.

use std::time::Duration;

use hil::real_time::RealTime;
use hil::start::Pace;
use protocol::identity::{GROUND, VEHICLE};
use protocol::mission::MissionHash;
use sim::outcome::Outcome;
use sim::remote::RemoteFlight;
use simulated_vehicle::hil::assembly::AnswerAssembly;
use simulated_vehicle::hil::messages::{of_frame, of_start};

use super::bad_wire::{BadWire, Badness};
use super::{computer, recipe, start};

const FRAME: Duration = Duration::from_millis(5);

/// Flies with a wire that is bad from the first frame on. Returns the outcome and the number of held frames.
fn fly(number: u64, badness: Badness) -> (Outcome, u64) {
    let recipe = recipe();
    let mut computer = computer(&recipe);
    let mut flight = RemoteFlight::new(&recipe, number).unwrap();
    let mut answers = AnswerAssembly::default();
    let begin = of_start(&start(&flight, 5, Pace::RealTime), MissionHash::of(&recipe.mission_toml));
    let mut out = Vec::new();
    computer.take(&begin, &mut out);
    let first = out.iter().find_map(|message| answers.take(message)).unwrap();
    let mut world = RealTime::started(&first);
    let (mut down, mut up) = (BadWire::new(badness, 3, GROUND), BadWire::new(badness, 4, VEHICLE));
    let mut now = Duration::ZERO;
    while flight.goes_on() {
        for message in up.arrived(now) {
            if let Some(answer) = answers.take(&message) {
                world.heard(&answer);
            }
        }
        let commands = world.commands(flight.frame() + 1);
        flight.act(&commands, world.phase());
        let readings = flight.sense();
        down.send(&of_frame(5, flight.frame(), &readings), now);
        for _ in 0..5 {
            now += FRAME / 5;
            for message in down.arrived(now) {
                let mut out = Vec::new();
                computer.take(&message, &mut out);
                up.send(&out, now);
            }
        }
    }
    (flight.outcome(), world.held())
}

fn legs(flights: std::ops::Range<u64>, badness: Badness) -> (usize, u64) {
    let flown: Vec<(Outcome, u64)> = flights.map(|number| fly(number, badness)).collect();
    let landed = flown.iter().filter(|(outcome, _)| outcome.legs).count();
    (landed, flown.iter().map(|(_, held)| held).sum())
}

#[test]
fn over_a_good_wire_they_land() {
    assert_eq!(legs(0..5, Badness::default()), (5, 0));
}

#[test]
fn one_lost_message_of_a_hundred_is_flown_with_the_last_inertial_sample_and_they_land() {
    let (landed, held) = legs(0..5, Badness { lost: 10, doubled: 10, ..Badness::default() });
    assert_eq!(landed, 5);
    assert!(held > 100, "{held}");
}

#[test]
fn a_wire_that_is_unplugged_for_a_quarter_of_a_second_in_the_fall_costs_no_landing() {
    let (landed, held) = legs(0..5, Badness { unplugged_ms: (3_000, 3_250), ..Badness::default() });
    assert_eq!(landed, 5);
    assert_eq!(held, 5 * 50);
}

/// How many landings a bad wire costs in real time, for the page of the builder.
#[test]
#[ignore = "prints a table of 900 flights"]
fn landings_by_the_state_of_the_wire() {
    for (name, badness) in [
        ("good", Badness::default()),
        ("1 of 1000 messages lost", Badness { lost: 1, ..Badness::default() }),
        ("10 of 1000 lost", Badness { lost: 10, ..Badness::default() }),
        ("50 of 1000 lost", Badness { lost: 50, ..Badness::default() }),
        ("up to 4 ms late", Badness { late_ms: 4, ..Badness::default() }),
        ("up to 12 ms late: frames overtake each other", Badness { late_ms: 12, ..Badness::default() }),
        ("unplugged for 0.25 s in the fall", Badness { unplugged_ms: (3_000, 3_250), ..Badness::default() }),
        ("unplugged for 1 s in the fall", Badness { unplugged_ms: (3_000, 4_000), ..Badness::default() }),
        ("unplugged for 0.25 s under power", Badness { unplugged_ms: (9_500, 9_750), ..Badness::default() }),
    ] {
        let (landed, held) = legs(0..100, badness);
        println!("{name}: {landed} of 100 on their legs, {held} frames held");
    }
}
