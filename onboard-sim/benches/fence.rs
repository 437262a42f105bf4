//! Hashes of flight decisions: what every frame commands, and how the vehicle meets the ground. A
//! change that must not change a decision prints the same lines before and after, on any machine.
//!
//! `cargo bench -p onboard-sim --bench fence` flies 200 flights of each kind; `-- 20` flies 20.
#![expect(clippy::unwrap_used, reason = "a built-in mission that cannot be flown ends the program")]
#![expect(clippy::print_stdout, reason = "the hashes are its output")]

use flight::rules::outputs::PyroOutput;
use flight::vehicle::mission::StartPoint;
use onboard_sim::run::in_parallel;
use sha2::{Digest as _, Sha256};
use sim::recipe::Recipe;
use sim::sortie::Sortie;

const FAULTS: &str = include_str!("../tests/onboard/expected-faults.csv");
const SEED: u64 = 78;
const FLIGHTS: u64 = 200;
/// Flights of each fault: it happens in all of them.
const FLIGHTS_WITH_FAULT: u64 = 4;

fn main() {
    let argument = std::env::args().skip(1).find_map(|argument| argument.parse().ok());
    let flights = argument.unwrap_or(FLIGHTS);
    for (mission, start) in [
        ("mk2", StartPoint::Apogee),
        ("mk2", StartPoint::Pad),
        ("mk3", StartPoint::Apogee),
        ("mk3", StartPoint::Pad),
        ("vlr", StartPoint::Drone),
    ] {
        for set in ["field", "real"] {
            let recipe = Recipe::built_in(mission, set).unwrap().starting_at(start).unwrap();
            fly(&format!("{mission} {set} {}", start.name()), &Recipe { seed: SEED, ..recipe }, flights);
        }
    }
    let faults = csv::Reader::from_reader(FAULTS.as_bytes()).into_records();
    for fault in faults.map(|record| record.unwrap()[0].to_owned()) {
        let faults = vec![fault.parse().unwrap()];
        for mission in ["mk2", "mk3"] {
            let recipe = Recipe::built_in(mission, "field").unwrap();
            let recipe = Recipe { seed: SEED, faults: faults.clone(), ..recipe };
            fly(&format!("{mission} {fault}"), &recipe, FLIGHTS_WITH_FAULT.min(flights));
        }
    }
}

fn fly(name: &str, recipe: &Recipe, flights: u64) {
    let numbers: Vec<u64> = (0..flights).collect();
    let flown = in_parallel(&numbers, |number| decisions(recipe, *number), &|_| {});
    let landed = flown.iter().filter(|(_, landed)| *landed).count();
    let all = flown.iter().fold(Sha256::new(), |all, (hash, _)| all.chain_update(hash)).finalize();
    let digits = all.first_chunk().map_or(0, |bytes| u64::from_be_bytes(*bytes));
    println!("{name:40} {landed:4} of {flights:4}  {digits:016x}");
}

/// The hash of one flight, and whether it landed on its legs.
fn decisions(recipe: &Recipe, number: u64) -> ([u8; 32], bool) {
    let mut flight = Sortie::new(recipe, number).unwrap();
    let mut hash = Sha256::new();
    loop {
        if let Some(output) = flight.step() {
            let commands = output.commands;
            for angle_rad in commands.gimbal_rad.iter().chain(&commands.fins_rad) {
                hash.update(angle_rad.to_le_bytes());
            }
            let lines = [
                PyroOutput::LandingIgniter,
                PyroOutput::Parachute,
                PyroOutput::AscentIgniter,
                PyroOutput::Separation,
            ];
            hash.update(lines.map(|line| u8::from(commands.outputs.is_on(line))));
        }
        if !flight.goes_on() {
            break;
        }
    }
    if let Some(touchdown) = flight.world().touchdown() {
        let state = &touchdown.state;
        for value in [touchdown.time_s, touchdown.over_ground.tilt_rad, touchdown.over_ground.rate_rad_s]
            .iter()
            .chain(state.position_m.iter())
            .chain(state.velocity_m_s.iter())
        {
            hash.update(value.to_le_bytes());
        }
    }
    let outcome = flight.outcome();
    hash.update(outcome.phase.name());
    (hash.finalize().into(), outcome.landing.stands)
}
