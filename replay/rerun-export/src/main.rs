//! The `replay-rerun` command.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use replay_rerun::{ExportError, Exported, export};

/// Turns a flight log into a recording for the Rerun viewer.
///
/// Rerun opens a log by itself (`rerun FLIGHT.mcap`), with every field, the events and the pose.
/// The recording adds the shape of the rocket, the pad, the path that was flown, and the layout to
/// show them. Open it with `rerun FLIGHT.rrd`, Rerun 0.36 or newer.
///
/// Exit codes: 0 written, also from the readable part of a damaged log; 1 not written: no flight
/// log, or the recording cannot be written; 2 the command line was not understood.
#[derive(Debug, Parser)]
#[command(name = "replay-rerun", version, about, long_about, after_help = EXAMPLES)]
struct Cli {
    /// The log, an MCAP file.
    log: PathBuf,
    /// The recording [default: the log's name with .rrd].
    #[arg(short, long = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// Another log, whose flight is drawn into the same space and plots.
    #[arg(long, value_name = "LOG")]
    with: Option<PathBuf>,
}

const EXAMPLES: &str = "Examples:
  replay-rerun flight.mcap
  replay-rerun flight.mcap --with other.mcap";

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_note(&format!("{:#}", anyhow::Error::from(error)));
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> Result<(), ExportError> {
    let requested = cli.output.clone().unwrap_or_else(|| cli.log.with_extension("rrd"));
    let (output, exported) = export(&cli.log, cli.with.as_deref(), &requested)?;
    let logs = [Some(&cli.log), cli.with.as_ref()].into_iter().flatten();
    logs.zip(&exported).for_each(|(log, exported)| warn(log, exported));
    let (poses, events) = exported.first().map_or((0, 0), |own| (own.poses, own.events));
    print_note(&format!("{}: {poses} poses, {events} events", output.display()));
    Ok(())
}

fn warn(log: &Path, exported: &Exported) {
    let log = log.display();
    if let Some(damage) = &exported.damage {
        print_note(&format!("warning: {log} is damaged: {damage}; everything before was exported"));
    }
    if let Some(problem) = &exported.mission_problem {
        print_note(&format!(
            "warning: {log}: its mission cannot be used, so its measures are missing: {problem}"
        ));
    }
    if exported.poses == 0 {
        print_note(&format!("warning: {log} has no pose of the rocket: the space stays empty"));
    }
}

/// Writes a line to standard error; a closed standard error is ignored.
fn print_note(text: &str) {
    let _ = writeln!(std::io::stderr(), "replay-rerun: {text}");
}
