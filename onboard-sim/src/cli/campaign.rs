//! `onboard-sim campaign`: a mission flown many times.

use std::fmt;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, Subcommand};
use flight::vehicle::mission::StartPoint;
use onboard_sim::run::{self, Progress};
use onboard_sim::scenario::{Expected, Scenario};
use onboard_sim::store::{Order, Shard, Store, merge};
use onboard_sim::summary::to_text;
use protocol::log::build::build_info;
use serde_json::json;
use sha2::Digest as _;
use sim::dispersion;
use sim::fault::{TimedFault, how_to_write};

use super::{Stopwatch, on_threads, recipe, single};

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct CampaignArguments {
    #[command(subcommand)]
    command: Option<CampaignCommand>,
    /// Built-in mission or TOML file.
    #[arg(long, default_value = flight::vehicles::mission::DEFAULT, value_name = "NAME|FILE")]
    profile: String,
    /// Where the flights begin: pad, apogee or drone, if the mission has that start [default: the mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild) or TOML file.
    #[arg(long, default_value = dispersion::DEFAULT, value_name = "NAME|FILE")]
    dispersion: String,
    /// Number of flights; they are numbered from 0.
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    flights: u64,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Flights at the same time; the results do not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Fly only this part of the chunks of flights, counted from 1.
    #[arg(long, default_value = "1/1", value_name = "I/N")]
    shard: Shard,
    /// Break something in every flight; may be repeated.
    #[arg(long = "fault", value_name = "FAULT", long_help = format!("Break something in every flight; may be given more than once. Write {}", how_to_write()))]
    faults: Vec<TimedFault>,
    /// Inject the faults of a scenario file.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Directory of the results. If it holds part of the same campaign, the campaign is continued.
    #[arg(long, value_name = "DIR", required_unless_present = "only")]
    out: Option<PathBuf>,
    /// Fly only this flight, and print its row.
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["out", "shard", "jobs"])]
    only: Option<u64>,
    /// Log of that flight (MCAP). An existing file is not overwritten.
    #[arg(long, value_name = "FILE", requires = "only")]
    log: Option<PathBuf>,
}

#[derive(Subcommand)]
enum CampaignCommand {
    /// Merge the parts of a campaign that was flown in shards.
    #[command(after_help = "Example: onboard-sim campaign merge part-1 part-2 --out whole")]
    Merge {
        /// Directories of the parts.
        #[arg(required = true, value_name = "DIR")]
        parts: Vec<PathBuf>,
        /// Directory of the whole.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

pub(crate) fn run(arguments: &CampaignArguments) -> anyhow::Result<ExitCode> {
    if let Some(CampaignCommand::Merge { parts, out }) = &arguments.command {
        return gather(parts, out);
    }
    let (order, expected) = order(arguments)?;
    if let Some(number) = arguments.only {
        return single::fly(&order.recipe, number, expected, arguments.log.as_deref());
    }
    let out = arguments.out.as_deref().context("--out is missing")?;
    let store = Store::open(out, &order, &order.manifest(&program()?, arguments.shard))?;
    let stopwatch = Stopwatch::start();
    let flown = on_threads(arguments.jobs, || {
        Ok((run::run(&order, &store, &|progress| show(&stopwatch, progress))?, rayon::current_num_threads()))
    });
    let (flown, jobs) = flown?;
    let cost = Cost::of(&flown, stopwatch.elapsed_s(), jobs);
    let summary = run::publish(&order, &store)?;
    let mut stdout = std::io::stdout().lock();
    write!(stdout, "{}", to_text(&summary))?;
    if let Some(cost) = cost {
        store.publish("cost.json", cost.to_json().as_bytes())?;
        writeln!(stdout, "\n{cost}")?;
    }
    writeln!(stdout, "results {}", out.display())?;
    Ok(ExitCode::SUCCESS)
}

fn gather(parts: &[PathBuf], out: &Path) -> anyhow::Result<ExitCode> {
    let (store, order) = merge(parts, out)?;
    let summary = run::publish(&order, &store)?;
    let mut stdout = std::io::stdout().lock();
    write!(stdout, "{}", to_text(&summary))?;
    writeln!(stdout, "results {}", out.display())?;
    Ok(ExitCode::SUCCESS)
}

fn order(arguments: &CampaignArguments) -> anyhow::Result<(Order, Option<Expected>)> {
    let CampaignArguments { profile, dispersion, .. } = arguments;
    let mut recipe = recipe(profile, arguments.start, dispersion, arguments.seed)?;
    recipe.faults.clone_from(&arguments.faults);
    let mut expected = None;
    if let Some(path) = &arguments.scenario {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let scenario = Scenario::from_toml(&text, &path.display().to_string())?;
        recipe.faults.extend(scenario.faults);
        expected = scenario.expected;
    }
    Ok((Order { recipe, flights: arguments.flights }, expected))
}

/// The build and a digest of the running program, so that results of different programs are not mixed.
fn program() -> anyhow::Result<String> {
    let path = std::env::current_exe().context("which program this is")?;
    let bytes = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let digest = sha2::Sha256::digest(&bytes);
    let short = digest.iter().take(8).fold(String::new(), |mut short, byte| {
        short.extend(
            [byte >> 4, byte & 15].map(|digit| char::from_digit(u32::from(digit), 16).unwrap_or('?')),
        );
        short
    });
    let build = build_info();
    let commit = build.get("git_commit").map_or("unknown", String::as_str);
    Ok(format!("{} {commit} {short}", env!("CARGO_PKG_VERSION")))
}

/// Cost of a run.
struct Cost {
    flights: u64,
    wall_s: f64,
    flights_per_s: f64,
    times_real_time_per_job: f64,
    jobs: usize,
}

/// Shows how far a campaign is.
fn show(stopwatch: &Stopwatch, progress: &Progress) {
    let Progress { flown, of, stands, envelope, .. } = progress;
    let rate = *flown as f64 / stopwatch.elapsed_s().max(1e-3);
    let words =
        format!("flights, {rate:.1} a second, {stands} stand undamaged, {envelope} inside the envelope");
    stopwatch.show(*flown as usize, *of as usize, words);
}

impl Cost {
    /// `None` if nothing was flown.
    fn of(flown: &Progress, wall_s: f64, jobs: usize) -> Option<Self> {
        let flight_s = flown.flight_time_ms as f64 * 1e-3;
        (flown.flown > 0).then(|| Self {
            flights: flown.flown,
            wall_s,
            flights_per_s: flown.flown as f64 / wall_s,
            times_real_time_per_job: flight_s / wall_s / jobs.max(1) as f64,
            jobs,
        })
    }

    fn to_json(&self) -> String {
        format!(
            "{:#}\n",
            json!({
                "flights": self.flights,
                "jobs": self.jobs,
                "wall_s": self.wall_s,
                "flights_per_s": self.flights_per_s,
                "times_real_time_per_job": self.times_real_time_per_job,
            })
        )
    }
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} flights in {:.1} s on {} jobs: {:.1} a second, each job {:.0} times real time",
            self.flights, self.wall_s, self.jobs, self.flights_per_s, self.times_real_time_per_job
        )
    }
}
