//! The `replay-rerun` command.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use replay_rerun::{Exported, Overwrite, export_file};

/// Turns a flight log into a recording for the Rerun viewer.
///
/// The recording has the flight in space, the path planned at every controller tick, plots with their limits, the
/// events and the verdict, on the timelines `flight_time` and `tick`, and the layout to show them. Open it with
/// `rerun FLIGHT.rrd`, Rerun 0.36 or newer.
///
/// Exit codes: 0 written, also from the readable part of a damaged log; 2 not written: wrong usage, no flight log,
/// or the recording cannot be written.
#[derive(Debug, Parser)]
#[command(name = "replay-rerun", version, about, long_about)]
struct Cli {
    /// The log, an MCAP file.
    log: PathBuf,
    /// The recording [default: the log's name with .rrd].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing recording.
    #[arg(long)]
    force: bool,
}

/// Nothing was written.
const EXIT_NOT_WRITTEN: u8 = 2;

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            say(&format!("{error:#}"));
            ExitCode::from(EXIT_NOT_WRITTEN)
        }
    }
}

fn run(cli: &Cli) -> Result<()> {
    let output = cli.output.clone().unwrap_or_else(|| cli.log.with_extension("rrd"));
    let overwrite = if cli.force { Overwrite::Always } else { Overwrite::Never };
    let exported = export_file(&cli.log, &output, overwrite)?;
    warn(&cli.log.display().to_string(), &exported);
    let Exported { ticks, poses, events, .. } = exported;
    say(&format!("{}: {poses} poses, {ticks} controller ticks, {events} events", output.display()));
    Ok(())
}

fn warn(log: &str, exported: &Exported) {
    if let Some(damage) = &exported.damage {
        say(&format!("warning: {log} is damaged: {damage}; everything before was exported"));
    }
    if let Some(reason) = &exported.first_unreadable {
        let count = exported.unreadable;
        say(&format!(
            "warning: {log}: {count} records cannot be read and were left out; the first: {reason}"
        ));
    }
    if exported.events_left_out > 0 {
        let count = exported.events_left_out;
        say(&format!("warning: {log}: {count} events were left out: unreadable, or too many"));
    }
    if let Some(problem) = &exported.profile_problem {
        say(&format!(
            "warning: {log}: its profile cannot be used, so limits and measures are missing: {problem}"
        ));
    }
    if exported.poses == 0 {
        say(&format!("warning: {log} has no pose of the rocket: the space stays empty"));
    }
}

/// Writes a line to standard error; a closed standard error is ignored.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "replay-rerun: {text}");
}
