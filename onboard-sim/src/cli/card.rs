//! `onboard-sim card`: the page that a team takes to the field.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Args;
use motor_choice::card::{Card, Day, Order};
use motor_choice::flown::Weather;
use motor_choice::source::{self, Candidate, Found};
use sim::dispersion::Dispersion;

use super::choices::{Choices, show};
use super::fly::{WIND_MAX_M_S, with_wind};
use super::output::{refuse_loss, write_folder};

/// More wind than that of the day, m/s.
const WINDIER_M_S: f64 = 3.0;
/// Steady winds in which the certified vehicle is flown, m/s.
const STEADY_M_S: [f64; 6] = [0.0, 3.0, 6.0, 9.0, 12.0, 15.0];
/// The files of a card.
const FILES: [&str; 4] = ["card.html", "card.txt", "mission.toml", "day.toml"];
/// Most flights of a card.
const FLIGHTS_MAX: u64 = 10_000;

/// For the help.
pub(crate) const EXAMPLE: &str =
    "Example: onboard-sim card --mission mini-f10 --motor F10 --mass 0.85 --wind 3 --out card";

#[derive(Args)]
pub(crate) struct CardArguments {
    #[command(flatten)]
    choices: Choices,
    /// The landing motor: an .eng or .rse file, or the name of one of the motors of --from (built in if not given). By default
    /// the mission's own.
    #[arg(long, value_name = "FILE|NAME")]
    motor: Option<String>,
    /// Mass with the motor full, kg. By default the best one within --ballast.
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// Mean wind of the day 10 m above the ground, m/s.
    #[arg(long, default_value_t = 3.0, value_name = "M/S")]
    wind: f64,
    /// Flights in this wind. By default as many as a few seconds allow, 12 to 60.
    #[arg(long, value_name = "N")]
    flights: Option<u64>,
    /// Flights of the way of ending that comes down farthest from the pad. Below 368 its interval has no upper end.
    #[arg(long, default_value_t = 400, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=FLIGHTS_MAX))]
    hazard_flights: u64,
    /// Folder of the card.
    #[arg(long, default_value = "card", value_name = "DIR")]
    out: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &CardArguments) -> anyhow::Result<ExitCode> {
    let choices = &arguments.choices;
    let wind_m_s = arguments.wind;
    let most_m_s = WIND_MAX_M_S - WINDIER_M_S;
    anyhow::ensure!((0.0..=most_m_s).contains(&wind_m_s), "--wind {wind_m_s}: must be 0 to {most_m_s} m/s");
    if let Some(mass_kg) = arguments.mass {
        anyhow::ensure!(
            mass_kg.is_finite() && mass_kg > 0.0,
            "--mass {mass_kg}: a mass in kg above 0 is accepted"
        );
    }
    if let Some(flights) = arguments.flights {
        anyhow::ensure!(
            (1..=FLIGHTS_MAX).contains(&flights),
            "--flights {flights}: must be 1 to {FLIGHTS_MAX}"
        );
    }
    for name in FILES {
        refuse_loss(&arguments.out.join(name), arguments.force)?;
    }
    let loaded = choices.load()?;
    let mission = &loaded.mission;
    let found = choices.motors()?;
    let motor = if let Some(name) = &arguments.motor {
        named(name, &found)?
    } else {
        let motor = mission.airframe.motor.clone();
        let curve = mission.motor_curve.clone();
        Candidate { origin: "the mission".to_owned(), motor, curve, in_production: None }
    };
    let set = choices.weather()?;
    let (today, windier) = (day(&set, wind_m_s)?, day(&set, wind_m_s + WINDIER_M_S)?);
    let steady = STEADY_M_S.into_iter().map(|wind_m_s| Ok((wind_m_s, steady(wind_m_s)?)));
    let order = Order {
        mission,
        mission_toml: &loaded.toml,
        motor: &motor,
        others: &found,
        mass_kg: arguments.mass,
        ballast_kg: choices.ballast_kg(mission),
        ballast_station_m: choices.ballast_station_m(mission)?,
        start: choices.start(mission)?,
        tube_m: choices.tube_m(mission)?,
        set: &set.dispersion_name,
        today: &today,
        windier: &windier,
        steady: &steady.collect::<anyhow::Result<Vec<_>>>()?,
        flights: arguments.flights,
        hazard_flights: arguments.hazard_flights,
        jobs: choices.jobs(),
    };
    let card = Card::new(&order, &|done, of| show(done, of, "flights"))?;
    let [html, text, mission_file, day_file] = FILES;
    let page = card.text();
    let files = [
        (html, card.html()),
        (text, page.clone()),
        (mission_file, card.mission_toml),
        (day_file, today.weather.dispersion_toml),
    ];
    write_folder(&arguments.out, &files, arguments.force)?;
    let mut stdout = std::io::stdout().lock();
    write!(stdout, "{page}")?;
    writeln!(stdout, "card {}", arguments.out.join(html).display())?;
    Ok(ExitCode::SUCCESS)
}

/// The motor of a file, or of this name among others.
fn named(name: &str, found: &[Found]) -> anyhow::Result<Candidate> {
    let path = Path::new(name);
    let is_file = ["eng", "rse", "json"]
        .iter()
        .any(|ending| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending)));
    let of_file = if is_file || path.exists() { source::read(path)? } else { Vec::new() };
    if is_file || path.exists() {
        anyhow::ensure!(
            of_file.len() == 1,
            "--motor {name}: it holds {} motors, and one is accepted; or --from {name} --motor with one of their names",
            of_file.len()
        );
        let only = of_file.into_iter().next().context("no motor")?;
        return only.map_err(|unusable| anyhow::anyhow!("--motor {}: {}", unusable.origin, unusable.reason));
    }
    let is_it =
        |known: &str, alone: &str| known.eq_ignore_ascii_case(name) || alone.eq_ignore_ascii_case(name);
    let matching: Vec<&Candidate> = found
        .iter()
        .filter_map(|found| found.as_ref().ok())
        .filter(|motor| is_it(&motor.name(), motor.curve.name()) || motor.motor == name)
        .collect();
    match matching.as_slice() {
        [motor] => Ok((*motor).clone()),
        [] => {
            let broken = found.iter().filter_map(|found| found.as_ref().err()).find(|broken| {
                broken.name.eq_ignore_ascii_case(name)
                    || broken.name.rsplit(' ').next().is_some_and(|own| own.eq_ignore_ascii_case(name))
            });
            if let Some(broken) = broken {
                anyhow::bail!("--motor {name}: {}: {}", broken.origin, broken.reason);
            }
            let known: Vec<String> =
                found.iter().filter_map(|found| Some(found.as_ref().ok()?.name())).take(12).collect();
            anyhow::bail!(
                "--motor {name}: neither a motor file nor one of the {} motors ({}{})",
                found.len(),
                known.join(", "),
                if found.len() > known.len() { ", ..." } else { "" }
            )
        }
        several => {
            let names: Vec<String> =
                several.iter().map(|motor| format!("{} ({})", motor.name(), motor.origin)).collect();
            anyhow::bail!("--motor {name}: {} motors have this name: {}", several.len(), names.join(", "))
        }
    }
}

/// A set of dispersions in a mean wind.
fn day(set: &Weather, wind_m_s: f64) -> anyhow::Result<Day> {
    let name = format!("{} with {wind_m_s} m/s of wind", set.dispersion_name);
    let toml = with_wind(&set.dispersion_toml, wind_m_s);
    let dispersion = Dispersion::from_toml(&toml, &name)?;
    Ok(Day {
        wind_m_s,
        weather: Weather { dispersion, dispersion_name: name, dispersion_toml: toml, seed: set.seed },
    })
}

/// The certified vehicle in a steady wind.
fn steady(wind_m_s: f64) -> anyhow::Result<Weather> {
    let name = "none";
    let toml = with_wind(Dispersion::builtin_toml(name)?, wind_m_s);
    Ok(Weather {
        dispersion: Dispersion::from_toml(&toml, name)?,
        dispersion_name: name.to_owned(),
        dispersion_toml: toml,
        seed: 1,
    })
}
