//! `onboard-sim campaign`: a mission flown many times.

use std::io::Write as _;
use std::path::PathBuf;
use std::{fmt, fs};

use anyhow::Context as _;
use clap::Args;
use flight::vehicle::mission::StartPoint;
use onboard_sim::files::write_folder;
use onboard_sim::run::{self, Counts};
use onboard_sim::store::{Manifest, Store, sha256};
use onboard_sim::summary::to_text;
use protocol::log::build::build_info;
use protocol::program::{Exit, in_range};
use serde::Serialize;
use sim::fault::{TimedFault, how_to_write};

use super::{Progress, Selection, on_threads, single};

#[derive(Args)]
pub(crate) struct CampaignArguments {
    #[command(flatten)]
    selection: Selection,
    /// Where the flights begin: pad, apogee or drone, if the mission has that start [default: the
    /// mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    /// Number of flights; they are numbered from 0.
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = in_range(1..=1_000_000_000_u64))]
    flights: u64,
    /// Break something in every flight; may be repeated.
    #[arg(long = "fault", value_name = "FAULT", long_help = format!("Break something in every flight; may be given more than once. Write {}", how_to_write()))]
    faults: Vec<TimedFault>,
    /// Directory of the results. If it holds part of the same campaign, the campaign is continued.
    /// With --only: the flight's log (MCAP); a file that exists is kept, and the log gets the next
    /// free name.
    #[arg(long, alias = "log", value_name = "PATH", required_unless_present = "only")]
    out: Option<PathBuf>,
    /// Fly only this flight, and print its row.
    #[arg(long, value_name = "NUMBER", conflicts_with = "jobs", value_parser = in_range(0..=u64::MAX))]
    only: Option<u64>,
}

pub(crate) fn run(arguments: &CampaignArguments) -> anyhow::Result<Exit> {
    let mut stdout = std::io::stdout().lock();
    let mut recipe = arguments.selection.recipe(arguments.start)?;
    recipe.faults.clone_from(&arguments.faults);
    if let Some(number) = arguments.only {
        return single::fly(&recipe, number, arguments.out.as_deref());
    }
    let out = arguments.out.as_deref().context("--out is missing")?;
    let manifest = Manifest::of(&recipe, arguments.flights, &program()?);
    let store = Store::open(out, &recipe, manifest)?;
    let progress = Progress::start();
    let cost = on_threads(arguments.selection.jobs, || {
        let flown = run::run(&recipe, &store, &|flown| show(&progress, flown))?;
        Ok(Cost::of(&flown, progress.elapsed_s()))
    })?;
    let summary = store.publish()?;
    write!(stdout, "{}", to_text(&summary))?;
    if cost.flights > 0 {
        write_folder(out, &[("cost.json", serde_json::to_vec_pretty(&cost)?)])?;
        writeln!(stdout, "\n{cost}")?;
    }
    writeln!(stdout, "results {}", out.display())?;
    Ok(Exit::Yes)
}

/// The build and a digest of the running program, so that results of different programs are not
/// mixed.
fn program() -> anyhow::Result<String> {
    let path = std::env::current_exe().context("which program this is")?;
    let bytes = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let build = build_info();
    let commit = build.get("git_commit").map_or("unknown", String::as_str);
    Ok(format!("{} {commit} {:.16}", env!("CARGO_PKG_VERSION"), sha256(bytes)))
}

/// Shows how far a campaign is.
fn show(progress: &Progress, Counts { flown, of, stands, envelope, .. }: &Counts) {
    let rate = *flown as f64 / progress.elapsed_s().max(1e-3);
    let words =
        format!("flights, {rate:.1} a second, {stands} stand undamaged, {envelope} inside the envelope");
    progress.show(*flown as usize, *of as usize, words);
}

/// Cost of a run.
#[derive(Serialize)]
struct Cost {
    flights: u64,
    flights_per_s: f64,
    jobs: usize,
    times_real_time_per_job: f64,
    wall_s: f64,
}

impl Cost {
    fn of(flown: &Counts, wall_s: f64) -> Self {
        let jobs = rayon::current_num_threads();
        Self {
            flights: flown.flown,
            flights_per_s: flown.flown as f64 / wall_s,
            jobs,
            times_real_time_per_job: flown.flight_time_ms as f64 * 1e-3 / wall_s / jobs as f64,
            wall_s,
        }
    }
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { flights, flights_per_s, jobs, times_real_time_per_job, wall_s } = self;
        write!(
            f,
            "{flights} flights in {wall_s:.1} s on {jobs} jobs: {flights_per_s:.1} a second, each job {times_real_time_per_job:.0} times \
             real time"
        )
    }
}
