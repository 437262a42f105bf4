//! `onboard-sim campaign`: a mission flown many times.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use campaign::order::{Manifest, Order, Shard};
use campaign::scenario::{Expected, Scenario};
use campaign::store::{Store, merge};
use campaign::summary::to_text;
use campaign::{results, run, timing};
use clap::{Args, Subcommand};
use flight::guidance::baseline::Controller;
use flight::vehicle::profile::StartPoint;
use protocol::log::build::build_info;
use sha2::Digest as _;
use sim::dispersion::{self, Dispersion};
use sim::fault::TimedFault;
use sim::recipe::{self, Recipe};

use super::cost::Stopwatch;
use super::single;

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct CampaignArguments {
    #[command(subcommand)]
    command: Option<CampaignCommand>,
    /// Built-in mission or TOML file.
    #[arg(long, default_value = "mk2", value_name = "NAME|FILE")]
    profile: String,
    /// Where the flights begin: pad, apogee or drone, if the mission has that start [default: the mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh) or TOML file.
    #[arg(long, default_value = dispersion::DEFAULT, value_name = "NAME|FILE")]
    dispersion: String,
    /// Sensors deliver and servos get what the messages of hardware in the loop can carry.
    #[arg(long)]
    wire_resolution: bool,
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
    /// Controller of the landing burn: nmpc, open-loop or oscillating.
    #[arg(long, default_value = "nmpc", value_name = "NAME")]
    controller: Controller,
    /// Fall with equally open fins that do not steer.
    #[arg(long)]
    passive: bool,
    /// Break something in every flight: NAME[:VALUE]@WHEN, as in gnss-out@5 or fin-stuck:2@apogee; may be repeated.
    #[arg(long = "fault", value_name = "FAULT")]
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
    let jobs = arguments.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let stopwatch = Stopwatch::start();
    let flown = run::run(&order, &store, jobs, &|progress| stopwatch.show(progress))?;
    let cost = stopwatch.cost(&flown, jobs);
    let summary = results::publish(&order, &store)?;
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
    let (store, order) = merge(parts, out, |manifest, mission_toml, dispersion_toml| {
        order_of(manifest, mission_toml, dispersion_toml).map_err(|error| format!("{error:#}"))
    })?;
    let summary = results::publish(&order, &store)?;
    let mut stdout = std::io::stdout().lock();
    write!(stdout, "{}", to_text(&summary))?;
    writeln!(stdout, "results {}", out.display())?;
    Ok(ExitCode::SUCCESS)
}

/// Rebuilds the order of a campaign from the texts in its directory.
fn order_of(manifest: &Manifest, mission_toml: &str, dispersion_toml: &str) -> anyhow::Result<Order> {
    let mut mission = vehicles::mission::from_toml(mission_toml, "mission.toml")?;
    mission.steered = manifest.steered;
    let faults = manifest.faults.iter().map(|fault| fault.parse()).collect::<Result<_, _>>()?;
    let recipe = Recipe {
        mission,
        mission_toml: mission_toml.to_owned(),
        dispersion: Dispersion::from_toml(dispersion_toml, "dispersion.toml")?,
        dispersion_name: manifest.dispersion.clone(),
        dispersion_toml: dispersion_toml.to_owned(),
        seed: manifest.seed,
        controller: manifest.controller.parse()?,
        faults,
    };
    Ok(Order { recipe, flights: manifest.flights })
}

fn order(arguments: &CampaignArguments) -> anyhow::Result<(Order, Option<Expected>)> {
    let mission_toml = mission_text(&arguments.profile, arguments.start)?;
    let mut mission = vehicles::mission::from_toml(&mission_toml, &arguments.profile)?;
    mission.steered &= !arguments.passive;
    if mission.ignition.fixed_height_m.is_none() {
        mission.ignition.fixed_height_m = timing::fixed_height_m(arguments.controller, &mission)?;
    }
    let mut dispersion_toml = text_of(&arguments.dispersion, dispersion::BUILTIN, "set of dispersions")?;
    if arguments.wire_resolution {
        dispersion_toml = Dispersion::toml_with_wire_resolution(&dispersion_toml, &arguments.dispersion)?;
    }
    let mut faults = arguments.faults.clone();
    let mut expected = None;
    if let Some(path) = &arguments.scenario {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let scenario = Scenario::from_toml(&text, &path.display().to_string())?;
        faults.extend(scenario.faults);
        expected = scenario.expected;
    }
    let recipe = Recipe {
        mission,
        mission_toml,
        dispersion: Dispersion::from_toml(&dispersion_toml, &arguments.dispersion)?,
        dispersion_name: arguments.dispersion.clone(),
        dispersion_toml,
        seed: arguments.seed,
        controller: arguments.controller,
        faults,
    };
    Ok((Order { recipe, flights: arguments.flights }, expected))
}

/// The text of a built-in mission or of a file, with the flights' start if one is given.
pub(super) fn mission_text(profile: &str, start: Option<StartPoint>) -> anyhow::Result<String> {
    let text = text_of(profile, vehicles::mission::BUILTIN, "mission")?;
    Ok(match start {
        Some(start) => recipe::toml_starting_at(&text, profile, start)?,
        None => text,
    })
}

/// The text of a built-in set, or of a file.
pub(super) fn text_of(name: &str, builtin: &[(&str, &str)], what: &str) -> anyhow::Result<String> {
    if let Some((_, text)) = builtin.iter().find(|(known, _)| *known == name) {
        return Ok((*text).to_owned());
    }
    fs::read_to_string(name).with_context(|| {
        let known = builtin.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!("'{name}' is neither a built-in {what} ({known}) nor a readable file")
    })
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
