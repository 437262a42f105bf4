//! `onboard-sim motors`: which motor an airframe lands on best.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use motor_choice::ranking::{Progress, Ranked, Request, rank};
use motor_choice::{picture, table};

use super::choices::{Choices, show};
use super::output::{refuse_loss, write_file};

/// Most flights of a motor.
const FLIGHTS_MAX: u64 = 100_000;

/// For the help.
pub(crate) const EXAMPLE: &str = "Example: onboard-sim motors --mission mini-f10 --from \
    thrustcurve-db.json --csv motors.csv";

#[derive(Args)]
pub(crate) struct MotorsArguments {
    #[command(flatten)]
    choices: Choices,
    /// Number of motors that are flown, beginning with the best.
    #[arg(long, default_value_t = 5, value_name = "N")]
    best: usize,
    /// Flights of each of them.
    #[arg(long, default_value_t = 60, value_name = "N")]
    flights: u64,
    /// List every motor that cannot be landed on, with its reason.
    #[arg(long)]
    all: bool,
    /// Write every motor as CSV, those that cannot be landed on with their reason.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the best motors as a picture (SVG).
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &MotorsArguments) -> anyhow::Result<ExitCode> {
    let choices = &arguments.choices;
    anyhow::ensure!(
        arguments.flights <= FLIGHTS_MAX,
        "--flights {}: must be 0 to {FLIGHTS_MAX}",
        arguments.flights
    );
    for path in [&arguments.csv, &arguments.picture].into_iter().flatten() {
        refuse_loss(path, arguments.force)?;
    }
    let loaded = choices.load()?;
    let mission = &loaded.mission;
    let weather = choices.weather()?;
    let request = Request {
        mission,
        mission_toml: &loaded.toml,
        ballast_kg: choices.ballast_kg(mission),
        ballast_station_m: choices.ballast_station_m(mission)?,
        start: choices.start(mission)?,
        tube_m: choices.tube_m(mission)?,
        best: arguments.best,
        flights: arguments.flights,
        weather: &weather,
        jobs: choices.jobs(),
    };
    let ranking = rank(&request, choices.motors()?, &|progress| match progress {
        Progress::Motors(done, of) => show(done, of, "motors"),
        Progress::Flights(done, of) => show(done, of, "flights"),
    })?;
    std::io::stdout().lock().write_all(table::text(&ranking, arguments.all).as_bytes())?;
    if let Some(path) = &arguments.csv {
        write_file(path, arguments.force, |out| table::write_csv(&ranking, out))?;
    }
    if let Some(path) = &arguments.picture {
        write_file(path, arguments.force, |out| {
            out.write_all(picture::svg(&ranking, &mission.name).as_bytes())
        })?;
    }
    let lands = ranking.iter().any(|ranked| matches!(ranked, Ranked::Lands(_)));
    anyhow::ensure!(lands, "{} lands on none of these motors", mission.name);
    Ok(ExitCode::SUCCESS)
}
