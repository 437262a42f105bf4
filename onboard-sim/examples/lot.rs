//! Value of stating the motor's lot in a mission: landing rates of the same vehicles with and
//! without it.
//!
//! `cargo run --release -p onboard-sim --example lot -- MISSION SET FLIGHTS SEED ROWS`
//!
//! The motors of a row are those of a lot, drawn with its measured scatter. Each flight is flown by
//! a mission with this lot, and by one with less information (ROWS is part of the names of rows;
//! default: all): motor, vehicle, weather and seed are the same.

use std::io::Write as _;

use flight::vehicle::mission::Mission;
use flight::vehicles::mission::BUILTIN;
use onboard_sim::run::in_parallel;
use onboard_sim::statistics::Share;
use sim::dispersion::Dispersion;
use sim::draw::{Draw, draw};
use sim::sortie::Sortie;
use sim::world::truth::Truth;

/// So many burns that their scatter is the lot's.
const FORTY: &str =
    "burns = 40\nimpulse = { mean = 1.0, scatter = 0.01 }\nburn_time = { mean = 1.0, scatter = 0.015 }";
/// A club's lot.
const FOUR: &str =
    "burns = 4\nimpulse = { mean = 1.0, scatter = 0.01 }\nburn_time = { mean = 1.0, scatter = 0.015 }";
const WEAK: &str =
    "burns = 40\nimpulse = { mean = 0.97, scatter = 0.01 }\nburn_time = { mean = 1.04, scatter = 0.015 }";
const STRONG: &str =
    "burns = 40\nimpulse = { mean = 1.03, scatter = 0.01 }\nburn_time = { mean = 0.96, scatter = 0.015 }";
const COLD: &str = "\ntemperature = { burns_c = 20.0, pad_c = 5.0 }";
const WARM: &str = "\ntemperature = { burns_c = 20.0, pad_c = 35.0 }";

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let at = |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let (name, set, flights, seed) =
        (at(0, "mk3"), at(1, "real"), at(2, "1000").parse()?, at(3, "2002").parse()?);
    let rows = at(4, "");
    let set = Dispersion::from_toml(Dispersion::builtin_toml(&set)?, &set)?;
    let mission = |lot: &str| -> anyhow::Result<Mission> {
        let known = BUILTIN.iter().find(|(known, _)| *known == name);
        let (_, text) = known.ok_or_else(|| anyhow::anyhow!("no mission is named {name}"))?;
        let lot = if lot.is_empty() { String::new() } else { format!("\n[lot]\nname = \"lot\"\n{lot}\n") };
        Ok(flight::vehicles::mission::from_toml(&format!("{text}{lot}"), &name)?)
    };
    let (cold, warm) = (format!("{FORTY}{COLD}"), format!("{FORTY}{WARM}"));
    let mut stdout = std::io::stdout().lock();
    for (row, lot, less) in [
        ("lot known to 1 and 1.5 %; certified", FORTY, ""),
        ("lot of four burns with this scatter; certified", FOUR, ""),
        ("lot of 0.97 and 1.04; certified", WEAK, ""),
        ("lot of 1.03 and 0.96; certified", STRONG, ""),
        ("15 K colder; not told", &cold, FORTY),
        ("15 K warmer; not told", &warm, FORTY),
    ] {
        if !row.contains(&rows) {
            continue;
        }
        let (world, less) = (mission(lot)?, mission(less)?);
        let stand = |pilot: &Mission| -> anyhow::Result<Vec<bool>> {
            let numbers: Vec<u64> = (0..flights).collect();
            let one = |number: &u64| -> anyhow::Result<bool> {
                let drawn = seen_by(pilot, &world, &draw(&world, &set, seed, *number));
                Ok(Sortie::drawn_as(pilot, &set, &drawn)?.run().landing.stands)
            };
            in_parallel(&numbers, one, &|_| {}).into_iter().collect()
        };
        let (given, not_given) = (stand(&world)?, stand(&less)?);
        let count = |is: fn(bool, bool) -> bool| {
            given.iter().zip(&not_given).filter(|(given, not_given)| is(**given, **not_given)).count() as u64
        };
        let share = |count| {
            let Share { share, low, high, .. } = Share::new(count, flights);
            format!("{:.1} % ({:.1} to {:.1})", 100.0 * share, 100.0 * low, 100.0 * high)
        };
        let [only_told, only_untold] =
            [count(|given, not_given| given && !not_given), count(|given, not_given| not_given && !given)];
        let (given, not_given) = (share(count(|given, _| given)), share(count(|_, not_given| not_given)));
        writeln!(
            stdout,
            "{row}: told {given}, not told {not_given}, only told {only_told}, only not {only_untold}"
        )?;
    }
    Ok(())
}

/// The draw of a world whose motor another mission expects to be another: its scales are over that
/// mission's curve.
fn seen_by(pilot: &Mission, world: &Mission, drawn: &Draw) -> Draw {
    let (curve, expected) = (&world.motor_curve, &pilot.motor_curve);
    let impulse = curve.total_impulse_n_s() / expected.total_impulse_n_s();
    let burn_time = curve.burn_time_s() / expected.burn_time_s();
    let Truth { impulse_scale, burn_time_scale, .. } = drawn.truth;
    let truth = Truth {
        impulse_scale: impulse_scale * impulse,
        burn_time_scale: burn_time_scale * burn_time,
        ..drawn.truth
    };
    Draw { truth, ..drawn.clone() }
}
