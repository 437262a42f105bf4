//! `onboard-sim landability`: where a landing exists.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use onboard_sim::landability::{self, Axis, Map, SpaceQuestion};
use sim::dispersion::{self, Dispersion};
use sim::recipe::Recipe;
use simulated_vehicle::fly::{LoadedFlight, load_flight};

use super::campaign::text_of;
use super::choices::show;
use super::output::{refuse_loss, write_file};

/// Default columns and rows: of profiles, and of missions.
const PLANE: [&str; 2] = ["thrust-to-weight=0.9:1.5:41", "height=5:35:31"];
const SPACE: [&str; 2] = ["thrust-scale=0.8:1.2:21", "wind=0:10:11"];

#[derive(Args)]
pub(crate) struct LandabilityArguments {
    /// Built-in profile or mission, or TOML file.
    #[arg(long, default_value = "paper-calibrated", value_name = "NAME|FILE")]
    profile: String,
    /// Columns: QUANTITY=FROM:TO:COUNT [default: thrust-to-weight=0.9:1.5:41; missions: thrust-scale=0.8:1.2:21].
    ///
    /// Quantities of profiles: thrust-to-weight, height (m), speed (m/s), tilt (deg), rate (deg/s), lateral-speed (m/s),
    /// thrust-scale. Of missions: ignition-height (m, of the feet where the thrust begins; without it the guidance chooses),
    /// thrust-scale, wind (m/s), tilt (deg, at the start), height (m, of the start).
    #[arg(long, value_name = "AXIS")]
    x: Option<Axis>,
    /// Rows, in the same form [default: height=5:35:31; missions: wind=0:10:11].
    #[arg(long, value_name = "AXIS")]
    y: Option<Axis>,
    /// What a map of a mission asks.
    #[arg(long, default_value = "flown", value_name = "QUESTION")]
    ask: Ask,
    /// Built-in set of dispersions or TOML file, of which a mission's cells all have the same draw; the quantities on the
    /// axes replace what is drawn for them.
    #[arg(long, default_value = "none", value_name = "NAME|FILE")]
    dispersion: String,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the cells as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the map as a picture.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
    /// Cells computed at the same time; the map does not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Ask {
    /// Does the mission's own guidance land, inside the limits of the legs? One simulated flight for each cell.
    Flown,
    /// Could a clairvoyant land? An upper bound in vertical motion alone, some forty times cheaper.
    Attainable,
}

pub(crate) fn run(arguments: &LandabilityArguments) -> anyhow::Result<ExitCode> {
    for path in [&arguments.csv, &arguments.svg].into_iter().flatten() {
        refuse_loss(path, arguments.force)?;
    }
    let loaded = load_flight(&arguments.profile)?;
    let jobs =
        arguments.jobs.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let map = match &loaded {
        LoadedFlight::AtIgnition(loaded) => {
            let axes = axes(arguments, PLANE)?;
            landability::map(&loaded.profile, axes, jobs, &|done| show(done, cells(axes), "cells"))?
        }
        LoadedFlight::InSpace(flight) => {
            anyhow::ensure!(
                arguments.y.is_some() || !matches!(arguments.ask, Ask::Attainable),
                "--ask attainable needs --y, as in ignition-height=40:90:26: its bound knows no wind"
            );
            let axes = axes(arguments, SPACE)?;
            let recipe = recipe(arguments, &flight.recipe)?;
            let question = match arguments.ask {
                Ask::Flown => SpaceQuestion::Flown,
                Ask::Attainable => SpaceQuestion::Attainable,
            };
            landability::map_mission(&recipe, question, axes, jobs, &|done| show(done, cells(axes), "cells"))?
        }
    };
    finish(arguments, &map, loaded.name(), asked(arguments, &loaded))
}

fn axes(arguments: &LandabilityArguments, default: [&str; 2]) -> anyhow::Result<[Axis; 2]> {
    let [x, y] = default;
    Ok([arguments.x.map_or_else(|| x.parse(), Ok)?, arguments.y.map_or_else(|| y.parse(), Ok)?])
}

fn cells([x, y]: [Axis; 2]) -> usize {
    x.count * y.count
}

/// The mission under the chosen dispersions.
fn recipe(arguments: &LandabilityArguments, mission: &Recipe) -> anyhow::Result<Recipe> {
    let toml = text_of(&arguments.dispersion, dispersion::BUILTIN, "set of dispersions")?;
    Ok(Recipe {
        dispersion: Dispersion::from_toml(&toml, &arguments.dispersion)?,
        dispersion_name: arguments.dispersion.clone(),
        dispersion_toml: toml,
        seed: arguments.seed,
        ..mission.clone()
    })
}

/// What the map answers, and how.
fn asked(arguments: &LandabilityArguments, loaded: &LoadedFlight) -> [&'static str; 2] {
    match (loaded, arguments.ask) {
        (LoadedFlight::AtIgnition(_), _) => {
            ["does a plan end inside the touchdown limits?", "one solve for each cell"]
        }
        (LoadedFlight::InSpace(_), Ask::Flown) => {
            ["does its own guidance land on its legs?", "one simulated flight for each cell"]
        }
        (LoadedFlight::InSpace(_), Ask::Attainable) => {
            ["could a clairvoyant land?", "an upper bound: vertical motion, no wind, no attitude"]
        }
    }
}

fn finish(
    arguments: &LandabilityArguments,
    map: &Map,
    name: &str,
    [asked, how]: [&str; 2],
) -> anyhow::Result<ExitCode> {
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{name}: {asked} ({how})").context("standard output")?;
    map.write_table(&mut stdout)?;
    if let Some(path) = &arguments.csv {
        write_file(path, arguments.force, |out| map.write_csv(out))?;
    }
    if let Some(path) = &arguments.svg {
        let svg = landability::svg(map, &format!("{name}: {asked}"))?;
        write_file(path, arguments.force, |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(ExitCode::SUCCESS)
}
