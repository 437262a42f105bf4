//! The `replay-rerun` command.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context as _, Result};
use clap::Parser;
use replay_rerun::{
    DEFAULT_ADDRESS, Exported, Overwrite, Towards, export_file, export_file_with, follow_file, send_file,
};

/// Turns a flight log into a recording for the Rerun viewer.
///
/// The recording has the flight in space, the planned paths, plots with their limits, the
/// events and the verdict, on the timelines `flight_time` and `tick`, and the layout to show them. Open it with
/// `rerun FLIGHT.rrd`, Rerun 0.36 or newer.
///
/// During a flight, `--follow` reads the log that `onboard-sim` or `ground` is writing; `--connect` shows it in a viewer
/// that is running (`rerun`).
///
/// Exit codes: 0 written, also from the readable part of a damaged log; 2 not written: wrong usage, no flight log,
/// or the recording cannot be written.
#[derive(Debug, Parser)]
#[command(name = "replay-rerun", version, about, long_about, after_help = EXAMPLES)]
struct Cli {
    /// The log, an MCAP file.
    log: PathBuf,
    /// The recording [default: the log's name with .rrd].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Another log, whose flight is drawn into the same space and plots, in other colours.
    #[arg(long, value_name = "LOG", conflicts_with_all = ["follow", "connect"])]
    with: Option<PathBuf>,
    /// Follow a log that is being written, until its end, Ctrl-C, or --idle; the recording grows with it.
    #[arg(long)]
    follow: bool,
    /// With --follow: end when nothing was written for so long, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 60, requires = "follow")]
    idle: u16,
    /// Send the recording to a running viewer instead of a file.
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        default_missing_value = DEFAULT_ADDRESS,
        conflicts_with = "output"
    )]
    connect: Option<String>,
    /// Overwrite an existing recording.
    #[arg(long)]
    force: bool,
}

const EXAMPLES: &str = "Examples:
  replay-rerun flight.mcap
  replay-rerun flight.mcap --with other.mcap
  replay-rerun flight.mcap --follow --connect";

/// How often a followed log is looked at again at its end.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

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
    let exported = if cli.follow {
        let towards = cli.connect.as_deref().map_or(Towards::File(&output, overwrite), Towards::Viewer);
        follow_file(&cli.log, towards, patience(&cli.log, Duration::from_secs(cli.idle.into()))?)?
    } else if let Some(address) = &cli.connect {
        send_file(&cli.log, address)?
    } else if let Some(other) = &cli.with {
        let (exported, of_other) = export_file_with(&cli.log, other, &output, overwrite)?;
        warn(&other.display().to_string(), &of_other);
        exported
    } else {
        export_file(&cli.log, &output, overwrite)?
    };
    warn(&cli.log.display().to_string(), &exported);
    let Exported { ticks, poses, events, .. } = exported;
    let output = cli.connect.clone().unwrap_or_else(|| output.display().to_string());
    say(&format!("{output}: {poses} poses, {ticks} frames, {events} events"));
    Ok(())
}

/// Waits at the end of a growing log; `false` after Ctrl-C, or if the file did not grow for so long.
fn patience(log: &std::path::Path, idle: Duration) -> Result<impl FnMut() -> bool> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop)).context("cannot listen for Ctrl-C")?;
    }
    let log = log.to_owned();
    let length = move || std::fs::metadata(&log).map_or(0, |file| file.len());
    let (mut seen_bytes, mut waited) = (length(), Duration::ZERO);
    Ok(move || {
        if stop.load(Ordering::Relaxed) || waited >= idle {
            return false;
        }
        std::thread::sleep(LOOK_AGAIN);
        waited += LOOK_AGAIN;
        let bytes = length();
        if bytes != seen_bytes {
            (seen_bytes, waited) = (bytes, Duration::ZERO);
        }
        true
    })
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
