//! Flies simulated flights, fits each from what its log would hold, and counts how often the 95 %
//! intervals hold the truth.
//!
//! `cargo run --release -p replay --example fit_coverage -- MISSION DISPERSION FLIGHTS SEED [pad]`
//!
//! With `--table FILE FLIGHTS SEED` it writes instead what the intervals lack, the table that
//! `replay fit` widens them by.

mod truth;

use std::collections::BTreeMap;
use std::io::Write as _;

use anyhow::Context as _;
use flight::vehicle::mission::StartPoint;
use onboard_sim::run::in_parallel;
use onboard_sim::statistics::{Share, quantile, sorted};
use replay::fit::calibration::{Entry, Table};
use replay::fit::{Fit, Trace, Z_95, fit, uncalibrated};
use sim::recipe::Recipe;
use sim::sortie::Sortie;

use truth::truth;

/// The table is made of these vehicles in these sets.
const VEHICLES: [&str; 2] = ["mk2", "mk3"];
const SETS: [&str; 2] = ["real", "wild"];

/// Flies a flight and keeps what its log would hold.
fn flown(recipe: &Recipe, number: u64) -> anyhow::Result<(Trace, Sortie)> {
    let mut flight = Sortie::new(recipe, number)?;
    let mut trace = Trace::new(&format!("flight {number}"), recipe.mission.clone(), &recipe.mission_toml);
    loop {
        flight.step();
        let computer = flight.computer();
        if let (Some(input), Some(estimate)) = (computer.flown(), flight.pilot().estimate()) {
            trace.push(&input, computer.commands(), computer.mode().phase, estimate);
        }
        if !flight.goes_on() {
            return Ok((trace, flight));
        }
    }
}

/// What was found of one parameter: error and standard deviation, and whether the interval holds
/// the truth.
#[derive(Debug, Clone, Copy)]
struct Found {
    error: f64,
    sigma: f64,
    held: bool,
}

/// By parameter: what was found, and how often it was not.
type Tallies = BTreeMap<String, (Vec<Found>, usize)>;

fn tallied(recipe: &Recipe, flights: u64, fitted: fn(&Trace) -> Fit) -> anyhow::Result<Tallies> {
    let numbers: Vec<u64> = (0..flights).collect();
    let one = |number: &u64| -> anyhow::Result<(Fit, BTreeMap<String, f64>)> {
        let (trace, flight) = flown(recipe, *number)?;
        let fit = fitted(&trace);
        let truth = truth(&flight, &fit);
        Ok((fit, truth))
    };
    let mut tallies = Tallies::new();
    for one in in_parallel(&numbers, one, &|_| {}) {
        let (fit, truth) = one?;
        for (name, true_value) in truth {
            let (found, lacks) = tallies.entry(name.clone()).or_default();
            match fit.get(&name) {
                None => *lacks += 1,
                Some(parameter) => found.push(Found {
                    error: parameter.value - true_value,
                    sigma: parameter.sigma,
                    held: (parameter.low..=parameter.high).contains(&true_value),
                }),
            }
        }
    }
    Ok(tallies)
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let at = |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let number = |place, default| at(place, default).parse::<u64>().context("FLIGHTS SEED");
    if at(0, "") == "--table" {
        return write_table(&at(1, "calibration.toml"), number(2, "200")?, number(3, "9001")?);
    }
    let recipe = Recipe::built_in(&at(0, "mk2"), &at(1, "field"))?;
    let recipe = if at(4, "") == "pad" { recipe.starting_at(StartPoint::Pad)? } else { recipe };
    let recipe = Recipe { seed: number(3, "1")?, ..recipe };
    print_coverage(&tallied(&recipe, number(2, "100")?, fit)?)
}

fn print_coverage(tallies: &Tallies) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "{:<26} {:>5} {:>7} {:>15} {:>10} {:>10} {:>10} {:>6}",
        "parameter", "found", "held %", "95 % interval", "mean err", "rms err", "med sigma", "lacks"
    )?;
    for (name, (found, lacks)) in tallies {
        let count = found.len();
        if count == 0 {
            writeln!(stdout, "{name:<26} {count:>5} {lacks:>71}")?;
            continue;
        }
        let mean = |of: fn(&Found) -> f64| found.iter().map(of).sum::<f64>() / count as f64;
        let (error, rms) = (mean(|one| one.error), mean(|one| one.error * one.error).sqrt());
        let held = found.iter().filter(|one| one.held).count() as u64;
        let Share { share, low, high, .. } = Share::new(held, count as u64);
        let [share, low, high] = [share, low, high].map(|share| 100.0 * share);
        let sigma = quantile(&sorted(found.iter().map(|one| one.sigma)), 0.5).unwrap_or(f64::NAN);
        writeln!(
            stdout,
            "{name:<26} {count:>5} {share:>7.1} {low:>6.1} to {high:>5.1} {error:>10.5} {rms:>10.5} {sigma:>10.5} {lacks:>6}"
        )?;
    }
    Ok(())
}

/// What share of the intervals must hold the truth, in each set: 95 % where the world is not the
/// model's, and nearly as often where the world also has effects without a model.
const HOLD: [f64; 2] = [0.95, 0.9];
/// An interval that holds more often than this is too wide.
const TOO_WIDE: f64 = 0.985;
/// Fewest flights of a set to estimate a share of 95 %.
const FEWEST: usize = 20;

fn write_table(file: &str, flights: u64, seed: u64) -> anyhow::Result<()> {
    let mut vehicles = BTreeMap::new();
    for vehicle in VEHICLES {
        let of = |set: &str| -> anyhow::Result<Tallies> {
            let recipe = Recipe { seed, ..Recipe::built_in(vehicle, set)? };
            let mut tallies = tallied(&recipe, flights, uncalibrated)?;
            // A flight from its pad brings another estimate to its burn.
            for (name, (found, lacks)) in
                tallied(&recipe.starting_at(StartPoint::Pad)?, flights, uncalibrated)?
            {
                let both = tallies.entry(name).or_default();
                both.0.extend(found);
                both.1 += lacks;
            }
            Ok(tallies)
        };
        let (real, mut wild) = (of(SETS[0])?, of(SETS[1])?);
        let mut by_name: BTreeMap<String, [Vec<Found>; 2]> = real
            .into_iter()
            .map(|(name, (real, _))| {
                let (wild, _) = wild.remove(&name).unwrap_or_default();
                (name, [real, wild])
            })
            .collect();
        // The wind comes from anywhere: both axes are one parameter.
        if let [Some(x), Some(y)] = ["wind_x", "wind_y"].map(|name| by_name.remove(name)) {
            let both = [0, 1].map(|set: usize| [x[set].as_slice(), y[set].as_slice()].concat());
            by_name.extend(["wind_x", "wind_y"].map(|name| (name.to_owned(), both.clone())));
        }
        let entries =
            by_name.into_iter().map(|(name, [real, wild])| (name, entry([&real, &wild], 2 * flights)));
        vehicles.insert(vehicle.to_owned(), entries.collect());
    }
    let table = Table { sets: SETS.map(str::to_owned).to_vec(), flights, seed, vehicles };
    let head = format!(
        "# Written by `cargo run --release -p replay --example fit_coverage -- --table replay/src/fit/calibration.toml {flights} {seed}`.\n"
    );
    std::fs::write(file, head + &toml::to_string(&table)?).with_context(|| file.to_owned())
}

/// The deviation that makes the wanted shares of these intervals hold the truth.
fn entry(sets: [&[Found]; 2], flights: u64) -> Entry {
    let [real, wild] = sets;
    if real.len() < FEWEST {
        return Entry::Not(format!("only {} of {flights} simulated flights showed it", real.len()));
    }
    let wide = needed(real, HOLD[0]);
    if wild.len() < FEWEST {
        return Entry::Wider(wide);
    }
    let wider = needed(wild, HOLD[1]);
    if wider > wide && held(real, wider) > TOO_WIDE {
        return Entry::Not(format!(
            "in wild {:.0} % of the intervals of {} flights hold it, and those that would hold it there are too wide in real",
            100.0 * held(wild, wide),
            wild.len()
        ));
    }
    Entry::Wider(wide.max(wider))
}

fn needed(found: &[Found], share: f64) -> f64 {
    let lacks = |one: &Found| ((one.error / Z_95).powi(2) - one.sigma * one.sigma).max(0.0).sqrt();
    let mut needed: Vec<f64> = found.iter().map(lacks).collect();
    needed.sort_by(f64::total_cmp);
    needed[((share * found.len() as f64).ceil() as usize).clamp(1, found.len()) - 1]
}

fn held(found: &[Found], wider: f64) -> f64 {
    let holds = |one: &&Found| one.error.abs() <= Z_95 * one.sigma.hypot(wider);
    found.iter().filter(holds).count() as f64 / found.len() as f64
}
