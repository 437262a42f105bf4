//! Whether a flight could have been landed with perfect information: the measure for the landing
//! rate of a controller.
//!
//! The vehicle falls with open fins from the drawn apogee and gets its ignition command at one
//! height that is the same for all flights of the campaign. From the first thrust on the true
//! motor, mass and drag are known, and at every instant fins are chosen between closed and fully
//! open and the tilt between upright and the planner's limit (`powered.tilt_max_deg`). It lands if
//! its feet reach the ground within the vertical speed limit of the legs and after the thrust has
//! fallen through the weight for the last time, because before that the vehicle would lift off
//! again.
//!
//! It is a bound, so it errs on the generous side. Motion is vertical: wind, gusts, place, attitude
//! dynamics and the slope of the ground are left out. Tilt and fins change at once, so the vehicle
//! may lean until touchdown: upright last moments would cost only what the servos and the inertia
//! cost. Injected faults do not happen.
//!
//! [`window::window`] is the interval of command heights from which a flight lands,
//! [`window::best_height_m`] the height inside most of them. A landing from a height exists if the
//! height lies between two bang-bang landings.
//!
//! At every instant the acceleration lies between a soft and a hard one: the extremes over tilt and
//! fins at that speed. (At high speed a lean brakes harder than an upright vehicle: the body across
//! the air gives more drag than the thrust loses.) So the velocity over time lies between bang-bang
//! paths. The least fall brakes hard from the first thrust on; a vehicle that stops before the
//! thrust has fallen through the weight hovers there, just above the ground, or climbs if even the
//! softest braking is more than its weight. The greatest fall brakes softly first and hard later,
//! and touches down at the limit of the legs, some time after the thrust has fallen through the
//! weight: a later touchdown falls farther at the end, but has to be slower before. In between any
//! fall is possible.
//!
//! ```text
//! cd onboard-sim/lab
//! cargo run --release -p paper --example attainable -- --mission mk2 --dispersion real \
//!     --seed 2002 --flights 100
//! ```

#[cfg(test)]
mod tests;
mod vertical;
mod window;

use std::io::Write as _;

use clap::Parser;
use flight::vehicles::mission;
use onboard_sim::files::text_of;
use onboard_sim::run::in_parallel;
use onboard_sim::statistics::Share;
use onboard_sim::tally::Tally;
use sim::dispersion;
use sim::recipe::Recipe;

use crate::window::{Window, best_height_m, window};

/// How many flights perfect information lands, and how many of them the flight computer does.
#[derive(Parser)]
struct Arguments {
    /// Built-in mission or TOML file.
    #[arg(long, default_value = mission::DEFAULT, value_name = "NAME|FILE")]
    mission: String,
    /// Built-in set of dispersions or TOML file.
    #[arg(long, default_value = dispersion::DEFAULT, value_name = "NAME|FILE")]
    dispersion: String,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[arg(long, default_value_t = 100, value_name = "N")]
    flights: u64,
    /// Print each flight's window, too, as CSV.
    #[arg(long)]
    each: bool,
}

fn main() -> anyhow::Result<()> {
    let Arguments { mission, dispersion: set, seed, flights, each } = Arguments::parse();
    let mission_toml = text_of(&mission, mission::BUILTIN, "mission")?;
    let set_toml = text_of(&set, dispersion::BUILTIN, "set of dispersions")?;
    let recipe = Recipe { seed, ..Recipe::from_texts((&mission, &mission_toml), (&set, &set_toml))? };
    let numbers: Vec<u64> = (0..flights).collect();
    let flown: Vec<(bool, Option<Window>)> = in_parallel(&numbers, |number| flown(&recipe, *number), &|_| ())
        .into_iter()
        .collect::<Result<_, _>>()?;
    let mut out = std::io::stdout().lock();
    if each {
        writeln!(out, "number,stands,attainable_low_m,attainable_high_m")?;
        for (number, (stands, window)) in numbers.iter().zip(&flown) {
            let ends =
                window.map_or_else(|| ",".to_owned(), |Window { low_m, high_m }| format!("{low_m},{high_m}"));
            writeln!(out, "{number},{stands},{ends}")?;
        }
    }
    let windows: Vec<Window> = flown.iter().filter_map(|(_, window)| *window).collect();
    let Some((command_height_m, attainable)) = best_height_m(&windows) else {
        writeln!(out, "perfect information lands none of {flights} flights")?;
        return Ok(());
    };
    let count = |is: &dyn Fn(Option<bool>) -> bool| {
        let inside = |window: &Option<Window>| window.map(|window| window.contains(command_height_m));
        flown.iter().filter(|(stands, window)| *stands && is(inside(window))).count() as u64
    };
    writeln!(
        out,
        "attainable, ignition command at {command_height_m:.1} m  {}\nlanded of attainable  {}\nbesides, {} landed from another \
         height, and {} beyond what is attainable",
        Share::new(attainable, flights),
        Share::new(count(&|inside| inside == Some(true)), attainable),
        count(&|inside| inside == Some(false)),
        count(&|inside| inside.is_none())
    )?;
    Ok(())
}

/// Whether a flight stands undamaged, and its window.
fn flown(recipe: &Recipe, number: u64) -> anyhow::Result<(bool, Option<Window>)> {
    let mut tally = Tally::new(recipe, number)?;
    while tally.step() {}
    let flight = tally.flight();
    Ok((tally.row().stands, window(flight.mission(), flight.drawn(), flight.fell_from())))
}
