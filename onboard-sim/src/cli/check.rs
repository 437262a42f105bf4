//! `onboard-sim check`: whether a vehicle that is not built yet will land, and what to change if not.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use onboard_sim::check::{Verdict, check};
use onboard_sim::motors::source;

use super::{on_threads, recipe, show_flights};

#[derive(Args)]
pub(crate) struct CheckArguments {
    /// Built-in mission or TOML file.
    #[arg(value_name = "NAME|FILE")]
    mission: String,
    /// Motors to propose: an .eng or .rse file, a folder of them, or the .json of the npm package thrustcurve-db; may be repeated. The
    /// built-in motors if not given.
    #[arg(long, value_name = "DIR|FILE")]
    from: Vec<PathBuf>,
    /// Flights that are flown as a check of the other rows; 0 leaves them out.
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = clap::value_parser!(u64).range(..=10_000))]
    flights: u64,
    /// Built-in set of dispersions (none, thrust-only, field, harsh, real, real-harsh, wild) or TOML file.
    #[arg(long, default_value = "field", value_name = "NAME|FILE")]
    dispersion: String,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Flights at the same time; the results do not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
}

pub(crate) fn run(arguments: &CheckArguments) -> anyhow::Result<ExitCode> {
    let recipe = recipe(&arguments.mission, None, &arguments.dispersion, arguments.seed)?;
    let mut motors = if arguments.from.is_empty() { source::built_in() } else { Vec::new() };
    for path in &arguments.from {
        motors.extend(source::read(path)?);
    }
    for broken in motors.iter().filter_map(|found| found.as_ref().err()) {
        let source::Unusable { name, origin, reason } = broken;
        writeln!(std::io::stderr(), "{name} cannot be used: {origin}: {reason}")?;
    }
    let (flights, show) = (arguments.flights, show_flights());
    let told = |done| show(done, flights as usize);
    let page = on_threads(arguments.jobs, || Ok(check(&recipe, &motors, flights, &told)?))?;
    write!(std::io::stdout().lock(), "{page}")?;
    Ok(ExitCode::from(u8::from(page.verdict() == Verdict::No)))
}
