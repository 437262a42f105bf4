//! How often the plans that fly agree with the judge's, and which are better where they do not.
//!
//! `cargo run --release -p judge --example agreement -- FLIGHTS EVERY MISSION/SET...`
//!
//! Flies this many flights of each mission and set of dispersions, and judges every n-th plan of
//! the landing burns. The judge begins from its guesses, and from the flown plan. Prints a table in
//! Markdown.

use std::io::Write as _;

use anyhow::{Context as _, Result};
use flight::guidance::powered::LandingSolved;
use judge::{Judgement, Score};
use onboard_sim::run::in_parallel;
use onboard_sim::statistics::quantile;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

/// Seed of the flights: others than those that numbers were tuned on.
const SEED: u64 = 2001;

/// Costs and merits agree within this share, first gimbal angles within this angle.
const SHARE: f64 = 0.01;
const ANGLE_RAD: f64 = 0.5 / 180.0 * std::f64::consts::PI;

/// A plan that misses nothing by more than this lands (m, m/s, rad or rad/s).
const LANDING_MISS: f64 = 0.02;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |what: &str| -> Result<u64> {
        let text = arguments.next().with_context(|| format!("{what} is missing: a number"))?;
        text.parse().with_context(|| format!("{what} is '{text}', which is no number"))
    };
    let (flights, every) = (number("FLIGHTS")?, number("EVERY")?.max(1));
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "| mission | dispersion | plans | cost within 1 % | first gimbal within 0.5 deg | both | judge's merit better by 1 % \
         | of these both land | flown merit better by 1 % | judge lands alone | flown lands alone | judge not converged \
         | largest defect | judge's subproblems, median |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for name in arguments {
        let (mission, set) =
            name.split_once('/').with_context(|| format!("'{name}' is not MISSION/SET, such as mk3/real"))?;
        let recipe = Recipe { seed: SEED, ..Recipe::built_in(mission, set)? };
        let numbers: Vec<u64> = (0..flights).collect();
        let plans: Result<Vec<_>> =
            in_parallel(&numbers, |number| flown(&recipe, *number, every), &|_| {}).into_iter().collect();
        let plans: Vec<LandingSolved> = plans?.into_iter().flatten().collect();
        let judged = in_parallel(&plans, Pair::of, &|_| {});
        writeln!(stdout, "{}", row(mission, set, &judged))?;
        stdout.flush()?;
    }
    Ok(())
}

/// Every so manyth plan of a flight.
fn flown(recipe: &Recipe, number: u64, every: u64) -> Result<Vec<LandingSolved>> {
    let mut flight = Sortie::new(recipe, number)?;
    // Other flights give other plans of their burns.
    let (mut planned, mut plans) = (number, Vec::new());
    while flight.goes_on() {
        if flight.step().is_some_and(|output| output.planned) {
            planned += 1;
            plans.extend(flight.pilot().landing_solved().filter(|_| planned.is_multiple_of(every)));
        }
    }
    Ok(plans)
}

/// A plan that flew, and the judge's.
struct Pair {
    flown: Score,
    first_rad: [f64; 2],
    judged: Judgement,
}

impl Pair {
    fn of(solved: &LandingSolved) -> Self {
        let LandingSolved { problem, plan, .. } = solved;
        let (states, inputs) = (plan.states(), plan.inputs());
        let [p, r, _] = inputs[0];
        Self {
            flown: judge::score(problem, states, inputs),
            first_rad: [p, r],
            judged: judge::solve(problem, Some((states, inputs))),
        }
    }

    fn cost_agrees(&self) -> bool {
        (self.judged.score.cost - self.flown.cost).abs() <= SHARE * self.flown.cost
    }

    fn input_agrees(&self) -> bool {
        let [p, r, _] = self.judged.inputs[0];
        (p - self.first_rad[0]).abs().max((r - self.first_rad[1]).abs()) <= ANGLE_RAD
    }

    fn judge_is_better(&self) -> bool {
        self.judged.score.merit < (1.0 - SHARE) * self.flown.merit
    }

    fn flown_is_better(&self) -> bool {
        self.flown.merit < (1.0 - SHARE) * self.judged.score.merit
    }

    /// Whether the plan that flew lands, and the judge's.
    fn land(&self) -> (bool, bool) {
        (self.flown.miss <= LANDING_MISS, self.judged.score.miss <= LANDING_MISS)
    }
}

fn row(mission: &str, set: &str, pairs: &[Pair]) -> String {
    let count = |is: &dyn Fn(&Pair) -> bool| pairs.iter().filter(|pair| is(pair)).count();
    let mut iterations: Vec<f64> = pairs.iter().map(|pair| pair.judged.iterations as f64).collect();
    iterations.sort_by(f64::total_cmp);
    let counts = [
        pairs.len(),
        count(&Pair::cost_agrees),
        count(&Pair::input_agrees),
        count(&|pair| pair.cost_agrees() && pair.input_agrees()),
        count(&Pair::judge_is_better),
        count(&|pair| pair.judge_is_better() && pair.land() == (true, true)),
        count(&Pair::flown_is_better),
        count(&|pair| pair.land() == (false, true)),
        count(&|pair| pair.land() == (true, false)),
        count(&|pair| !pair.judged.converged),
    ]
    .map(|count| count.to_string());
    let defect = pairs.iter().map(|pair| pair.flown.defect).fold(0.0, f64::max);
    let median = quantile(&iterations, 0.5).unwrap_or(f64::NAN);
    format!("| {mission} | {set} | {} | {defect:.1e} | {median:.0} |", counts.join(" | "))
}
