//! How often GO of `replay fit --flights` means at least the requested landing rate.
//!
//! `cargo run --release -p replay --example clubs -- MISSION FLIGHTS SEED`
//!
//! Each simulated club has a motor lot as the prior has them and five or ten flights behind it,
//! knows its motors as well as fits do, and simulates its next day in `real` or `wild`. Its own
//! world is that one, or `wild` although it simulates `real`. FLIGHTS flights of each world, whose
//! motors scatter more than any lot's, tell how a motor lands there: as the 40 flights with the
//! nearest motors did.

use std::io::Write as _;

use anyhow::Context as _;
use flight::vehicle::lot::Posterior;
use onboard_sim::run::in_parallel;
use replay::fit::day::{Expected, Outcomes};
use replay::fit::lot::{Trial, burnt, draw_lot, draw_next, predict};
use sim::draw::{Chance, Draw, draw};
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::world::truth::Truth;

/// Impulse and burn time over those of the curve, and delay, s.
type Motor = [f64; 3];

/// Scatter of the flown motors: half as much again as the widest lot's.
const FLOWN: Motor = [0.045, 0.065, 0.075];
/// Scatter of the prior's motors: that of `real`.
const PRIOR: Motor = [0.027, 0.04, 0.05];
/// What fits miss these by (rms, `fit_coverage`), in all burns of a club alike.
const MISSED: Motor = [0.0055, 0.0075, 0.0025];
const NEAREST: usize = 40;
const CLUBS: u64 = 500;
/// Simulated flights of a club's day, and flights that its true rate is taken over.
const DAY: usize = 1000;
/// The risk that `replay fit` takes by default.
const RISK: f64 = 0.1;
const LIMITS: [f64; 6] = [0.5, 0.6, 0.7, 0.8, 0.9, 0.95];

fn nominal() -> Motor {
    [1.0, 1.0, Truth::default().ignition_delay_s]
}

/// How motors land in a world.
struct World(Vec<(Motor, bool)>);

impl World {
    fn flown(mission: &str, set: &str, flights: u64, seed: u64) -> anyhow::Result<Self> {
        let recipe = Recipe { seed, ..Recipe::built_in(mission, set)? };
        let mut chance = Chance::of(seed, 0);
        let mut motor = || [0, 1, 2].map(|i: usize| nominal()[i] + FLOWN[i] * chance.normal());
        let motors: Vec<(u64, Motor)> = (0..flights).map(|number| (number, motor())).collect();
        let one = |(number, motor): &(u64, Motor)| -> anyhow::Result<bool> {
            let drawn = draw(&recipe.mission, &recipe.dispersion, seed, *number);
            let [impulse_scale, burn_time_scale, delay_s] = *motor;
            let ignition_delay_s = delay_s.max(0.02);
            let truth = Truth { impulse_scale, burn_time_scale, ignition_delay_s, ..drawn.truth };
            let draw = Draw { truth, ..drawn };
            Ok(Sortie::drawn_as(&recipe.mission, &recipe.dispersion, &draw)?.run().landing.stands)
        };
        let landed = in_parallel(&motors, one, &|_| {});
        let flights = motors.into_iter().zip(landed).map(|((_, motor), landed)| Ok((motor, landed?)));
        Ok(Self(flights.collect::<anyhow::Result<_>>()?))
    }

    fn chance_to_land(&self, motor: &Motor) -> f64 {
        let apart = |(flown, landed): &(Motor, bool)| {
            let squares = (0..3).map(|i| ((flown[i] - motor[i]) / FLOWN[i]).powi(2));
            (squares.sum::<f64>(), *landed)
        };
        let mut nearest: Vec<(f64, bool)> = self.0.iter().map(apart).collect();
        let count = NEAREST.min(nearest.len() - 1);
        nearest.select_nth_unstable_by(count, |one, other| one.0.total_cmp(&other.0));
        nearest[..count].iter().filter(|flight| flight.1).count() as f64 / count as f64
    }
}

/// A club's true rate of the next day, and for each limit whether it has a GO.
fn club(
    number: u64,
    flown: usize,
    simulated: &World,
    own: &World,
) -> anyhow::Result<(f64, [bool; LIMITS.len()])> {
    let mut chance = Chance::of(9_000_000 + number, 0);
    let priors = [0, 1, 2].map(|i: usize| Posterior::prior(nominal()[i], PRIOR[i]));
    let lot = priors.map(|prior| draw_lot(&prior, &mut chance));
    let burn = |chance: &mut Chance| lot.map(|(mean, sigma)| mean + sigma * chance.normal());
    let missed = MISSED.map(|sigma| sigma * chance.normal());
    let burns: Vec<Motor> = (0..flown).map(|_| burn(&mut chance)).collect();
    let landed = burns.iter().filter(|motor| chance.unit() < own.chance_to_land(motor)).count();
    let lots = [0, 1, 2].map(|i: usize| {
        let values: Vec<f64> = burns.iter().map(|burn| burn[i] + missed[i]).collect();
        priors[i].with(flown as u32, &burnt(&values, MISSED[i]))
    });
    // The day's mission expects what was learnt.
    let expected = |motor: &[f64]| {
        [motor[0] / lots[0].mean, motor[1] / lots[1].mean, motor[2] - lots[2].mean + nominal()[2]]
    };
    let mut trial = || {
        let drawn = draw_next(&lots, &mut chance);
        let landed = chance.unit() < simulated.chance_to_land(&expected(&drawn));
        Trial { drawn, landed }
    };
    let trials: Vec<Trial> = (0..DAY).map(|_| trial()).collect();
    let rate = (0..DAY).map(|_| own.chance_to_land(&expected(&burn(&mut chance)))).sum::<f64>() / DAY as f64;
    let found = predict(&lots, &trials, number).context("no flight was simulated")?;
    let outcomes = Outcomes { landed, of: flown, unknown: 0 };
    let go = LIMITS
        .map(|limit| Expected::of(&found, outcomes, limit).is_some_and(|expected| expected.risk <= RISK));
    Ok((rate, go))
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let at = |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let (mission, flights, seed) = (at(0, "mk3"), at(1, "2000").parse()?, at(2, "1").parse()?);
    let real = World::flown(&mission, "real", flights, seed)?;
    let wild = World::flown(&mission, "wild", flights, seed)?;
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "simulated,lives_in,flown,mean_rate,limit,go,right,could")?;
    for (prior, set, simulated, own) in
        [("real", "real", &real, &real), ("wild", "wild", &wild, &wild), ("real", "wild", &real, &wild)]
    {
        for flown in [5, 10] {
            let numbers: Vec<u64> = (0..CLUBS).collect();
            let clubs = in_parallel(&numbers, |number| club(*number, flown, simulated, own), &|_| {});
            let clubs = clubs.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
            let mean = clubs.iter().map(|(rate, _)| rate).sum::<f64>() / CLUBS as f64;
            for (place, limit) in LIMITS.into_iter().enumerate() {
                let go = clubs.iter().filter(|(_, go)| go[place]).count();
                let right = clubs.iter().filter(|(rate, go)| go[place] && *rate >= limit).count();
                let could = clubs.iter().filter(|(rate, _)| *rate >= limit).count();
                writeln!(stdout, "{prior},{set},{flown},{mean:.3},{limit},{go},{right},{could}")?;
            }
        }
    }
    Ok(())
}
