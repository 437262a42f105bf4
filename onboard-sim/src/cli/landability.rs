//! `onboard-sim landability`, and the maps of `paper`: where a landing exists.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use onboard_sim::landability::{self, Axis, Map, MapError, SpaceQuestion};
use sim::dispersion::{self, Dispersion};
use sim::recipe::Recipe;

use super::campaign::{mission_text, text_of};
use super::choices::show;
use super::output::{refuse_loss, write_file};

/// What is mapped over, and where it is written.
#[derive(Args)]
pub(super) struct MapArguments {
    /// Columns of a map: QUANTITY=FROM:TO:COUNT [default: thrust-scale=0.8:1.2:21; of the paper's vehicle
    /// thrust-to-weight=0.9:1.5:41].
    ///
    /// Quantities of a mission: ignition-height (m, of the feet where the thrust begins; without it the guidance chooses),
    /// thrust-scale, wind (m/s), tilt (deg, at the start), height (m, of the start). Of the paper's vehicle:
    /// thrust-to-weight, height (m), speed (m/s), tilt (deg), rate (deg/s), lateral-speed (m/s), thrust-scale.
    #[arg(long, value_name = "AXIS")]
    x: Option<Axis>,
    /// Rows, in the same form [default: wind=0:10:11; of the paper's vehicle height=5:35:31].
    #[arg(long, value_name = "AXIS")]
    y: Option<Axis>,
    /// Write the cells of the map as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the map as a picture.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

impl MapArguments {
    /// Computes a map of cells and writes it; the title says whose it is and what it answers, `how` by what.
    pub(super) fn run(
        &self,
        default: [&str; 2],
        force: bool,
        [title, how]: [&str; 2],
        map: impl FnOnce([Axis; 2], &(dyn Fn(usize) + Sync)) -> Result<Map, MapError>,
    ) -> anyhow::Result<ExitCode> {
        for path in [&self.csv, &self.svg].into_iter().flatten() {
            refuse_loss(path, force)?;
        }
        let axis = |given: Option<Axis>, default: &str| given.map_or_else(|| default.parse(), Ok);
        let axes = [axis(self.x, default[0])?, axis(self.y, default[1])?];
        let cells = axes[0].count * axes[1].count;
        let map = map(axes, &|done| show(done, cells, "cells"))?;
        let mut stdout = std::io::stdout().lock();
        writeln!(stdout, "{title} ({how})").context("standard output")?;
        map.write_table(&mut stdout)?;
        if let Some(path) = &self.csv {
            write_file(path, force, |out| map.write_csv(out))?;
        }
        if let Some(path) = &self.svg {
            let svg = landability::svg(&map, title)?;
            write_file(path, force, |out| out.write_all(svg.as_bytes()))?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

#[derive(Args)]
pub(crate) struct LandabilityArguments {
    /// Built-in mission or TOML file.
    #[arg(long, default_value = "mk2", value_name = "NAME|FILE")]
    profile: String,
    #[command(flatten)]
    map: MapArguments,
    /// What the map asks.
    #[arg(long, default_value = "flown", value_name = "QUESTION")]
    ask: Ask,
    /// Built-in set of dispersions or TOML file, of which the cells all have the same draw; the quantities on the axes
    /// replace what is drawn for them.
    #[arg(long, default_value = "none", value_name = "NAME|FILE")]
    dispersion: String,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
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
    /// Could it be landed with perfect information? An upper bound in vertical motion alone, some forty times cheaper.
    Attainable,
}

pub(crate) fn run(arguments: &LandabilityArguments) -> anyhow::Result<ExitCode> {
    let LandabilityArguments { profile, map, ask, dispersion: set_name, .. } = arguments;
    anyhow::ensure!(
        map.y.is_some() || !matches!(ask, Ask::Attainable),
        "--ask attainable needs --y, as in ignition-height=40:90:26: its bound knows no wind"
    );
    let set = text_of(set_name, dispersion::BUILTIN, "set of dispersions")?;
    // A set that cannot be read is refused by its own name.
    Dispersion::from_toml(&set, set_name)?;
    let recipe = Recipe::from_texts((profile, &mission_text(profile, None)?), (set_name, &set))?;
    let recipe = Recipe { seed: arguments.seed, ..recipe };
    let (question, asked, how) = match ask {
        Ask::Flown => (
            SpaceQuestion::Flown,
            "does its own guidance land on its legs?",
            "one simulated flight for each cell",
        ),
        Ask::Attainable => (
            SpaceQuestion::Attainable,
            "could it be landed with perfect information?",
            "an upper bound: vertical motion, no wind, no attitude",
        ),
    };
    let title = format!("{}: {asked}", recipe.mission.name);
    let default = ["thrust-scale=0.8:1.2:21", "wind=0:10:11"];
    map.run(default, arguments.force, [&title, how], |axes, progress| {
        landability::map_mission(&recipe, question, axes, jobs(arguments.jobs), progress)
    })
}

/// As many as asked for, or as there are processors.
pub(super) fn jobs(asked: Option<usize>) -> usize {
    asked.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
}
