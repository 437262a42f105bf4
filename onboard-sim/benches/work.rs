//! How much work plans are: the solver's passes over an interval in each planned landing, in the
//! unit of `powered.max_passes`.
//!
//! `cargo bench -p onboard-sim --bench work` flies 200 flights of each kind; `-- 20` flies 20; `--
//! 20 6000 mk2 mk3` flies only these missions, with a bound of 6,000.
#![expect(clippy::unwrap_used, reason = "a built-in mission that cannot be flown ends the program")]
#![expect(clippy::print_stdout, reason = "the table is its output")]

use flight::rules::phase::Phase;
use flight::vehicle::mission::StartPoint;
use onboard_sim::run::in_parallel;
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

#[path = "../flight/tests/missions/mod.rs"]
mod missions;

const SEED: u64 = 3001;
const FLIGHTS: u64 = 200;

fn main() {
    let selected: Vec<String> = std::env::args().skip(1).collect();
    let names: Vec<&str> =
        selected.iter().map(String::as_str).filter(|name| name.starts_with(['m', 'v'])).collect();
    let mut numbers = selected.iter().filter_map(|argument| argument.parse().ok());
    let (flights, bound): (u64, Option<u64>) = (numbers.next().unwrap_or(FLIGHTS), numbers.next());
    println!(
        "{:24} {:>6} {:>7} {:>7} {:>7} {:>7} {:>7}",
        "", "landed", "plans", "median", "p99", "p99.9", "most"
    );
    for (mission, start) in [
        ("mk2", StartPoint::Apogee),
        ("mk2", StartPoint::Pad),
        ("mk2", StartPoint::Drone),
        ("mk3", StartPoint::Apogee),
        ("mk3", StartPoint::Pad),
        ("vlr", StartPoint::Drone),
        ("vlr-f15", StartPoint::Drone),
        ("vlr-f16", StartPoint::Drone),
        ("mini-f10", StartPoint::Apogee),
        ("mk2-h53", StartPoint::Apogee),
    ] {
        if !names.is_empty() && !names.contains(&mission) {
            continue;
        }
        for set in ["field", "real", "wild"] {
            let mut missions = flight::vehicles::mission::BUILTIN.iter().chain(&missions::TEST_MISSIONS);
            let texts = *missions.find(|(name, _)| *name == mission).unwrap();
            let set_texts = (set, Dispersion::builtin_toml(set).unwrap());
            let recipe = Recipe::from_texts(texts, set_texts).unwrap().starting_at(start).unwrap();
            let mut recipe = Recipe { seed: SEED, ..recipe };
            recipe.mission.powered.max_passes =
                bound.map_or(recipe.mission.powered.max_passes, |bound| Some(bound as usize));
            let numbers: Vec<u64> = (0..flights).collect();
            let flown = in_parallel(&numbers, |number| passes(&recipe, *number), &|_| {});
            let landed = flown.iter().filter(|(_, landed)| *landed).count();
            let mut passes: Vec<usize> = flown.into_iter().flat_map(|(passes, _)| passes).collect();
            passes.sort_unstable();
            let at = |share: f64| passes[((passes.len() - 1) as f64 * share) as usize];
            let kind = format!("{mission} {set} {}", start.name());
            let [median, p99, p999, most] = [0.5, 0.99, 0.999, 1.0].map(at);
            println!("{kind:24} {landed:6} {:7} {median:7} {p99:7} {p999:7} {most:7}", passes.len());
        }
    }
}

/// The passes of each plan of one flight, and whether it landed on its legs.
fn passes(recipe: &Recipe, number: u64) -> (Vec<usize>, bool) {
    let mut flight = Sortie::new(recipe, number).unwrap();
    let mut passes = Vec::new();
    loop {
        if flight.step().is_some_and(|output| output.planned)
            && flight.computer().mode().phase == Phase::Powered
        {
            passes.push(flight.pilot().report().passes);
        }
        if !flight.goes_on() {
            return (passes, flight.outcome().landing.stands);
        }
    }
}
