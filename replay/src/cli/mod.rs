//! The command line: parses the question and prints the answer. One file for each subcommand.

mod audit;
mod bisect;
mod compare;
mod evaluate;
mod export;
mod fit;
mod frames;
mod gate;
mod import;
mod info;
mod learn;
mod manual;
mod recover;
mod refly;
mod report;
mod settings;
mod sweep;
mod tick;
mod verify;

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result, ensure};
use clap::{Parser, Subcommand};
use replay::info::Completeness;
use replay::log::{Cut, Gap, Recording};
use replay::output::{Destination, NewFile, Overwrite};
use replay::verify::Verification;

/// The answer is no: the controller decides differently from the record, or flights differ by more than is tolerated.
pub(crate) const EXIT_NO: u8 = 1;
/// There is no answer: wrong usage, an unreadable file, not a flight log, or not replayable.
pub(crate) const EXIT_NO_ANSWER: u8 = 2;

/// Describes flight logs, runs their flights again, and compares them.
///
/// Answers go to standard output, warnings and errors to standard error.
///
/// Exit codes:
///   0  success: the log is described, or every tick that could be read is identical
///   1  verify: some tick differs, or with --strict not the whole flight was compared;
///      compare: more differs or is missing than is tolerated, or the verdicts differ;
///      gate: some flight got worse, lands no longer, diverged or is missing;
///      learn: NO-GO;
///      audit: a book is broken, or its end is not proven
///   2  no answer: wrong usage, the file cannot be read or is no flight log, or verify cannot re-execute
///      some tick (no ticks, no profile, ticks missing) and all others are identical;
///      or a file would be overwritten and --force is not given
///
/// A damaged log is used up to the damage, with a warning and exit code 0, except by verify --strict (implied by
/// --junit) and by compare.
#[derive(Debug, Parser)]
#[command(
    name = "replay",
    version,
    about,
    long_about,
    verbatim_doc_comment,
    after_help = "Example: replay verify flight.mcap"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, Subcommand)]
enum Question {
    /// Describes a log: grade, run, build, phases, verdict, ticks, channels, damage.
    #[command(after_help = "Example: replay info flight.mcap")]
    Info(info::Ask),
    /// Runs the flight computer of a log again and compares its decisions bit for bit.
    ///
    /// The flight computer is built from the profile in the log and run on the recorded inputs from power-up on. If the
    /// log has no frames from power-up, only the controller ticks are compared. All fields of the output and the digest
    /// of the memory are compared; measured times are not. For a divergence the report says how it grows, and whether
    /// the landing would end differently (simulated from the first tick that differs).
    #[command(after_help = "Example: replay verify flight.mcap")]
    Verify(verify::Ask),
    /// Open loop: what the controller alone would have commanded with other settings, on the recorded inputs.
    #[command(after_help = "Example: replay evaluate flight.mcap --set powered.weights.theta=90@6.5")]
    Evaluate(evaluate::Ask),
    /// Closed loop: flies the flight again in simulation from a chosen moment, with other settings.
    ///
    /// The flight is flown again from its start with the recorded draw up to that moment, because a log does not hold the
    /// internal states of gusts, servos and sensors; the record is not used afterwards. The answer says how many recorded
    /// frames were reproduced: with nothing changed, all of a simulated flight, bit for bit.
    #[command(
        after_help = "Examples:\n  replay refly flight.mcap --plant truth.impulse_scale=0.99\n  replay refly flight.mcap --without-fault gnss-out"
    )]
    Refly(refly::Ask),
    /// Flies flights again with many settings (closed loop) and ranks them by the worst flight's margin.
    #[command(after_help = "Example: replay sweep a.mcap b.mcap --vary powered.weights.theta=50:110:7")]
    Sweep(sweep::Ask),
    /// Looks for the smallest change of one setting that turns landed into not landed, or back (closed loop).
    #[command(
        after_help = "Example: replay bisect a.mcap truth.impulse_scale --of-plant --lowest 0.9 --highest 1.1"
    )]
    Bisect(bisect::Ask),
    /// Holds a directory of flights against a baseline: every flight verified, flown again, and compared.
    ///
    /// One table (and one JUnit file) says which flights got better, worse, flipped between landed and not landed,
    /// diverged, are lost or missing, and which logs hold no flight. Exit code 0 if none got worse, 1 if some did, 2 without
    /// an answer.
    #[command(
        after_help = "Examples:\n  replay gate logs --baseline baseline.json --accept\n  replay gate logs --baseline baseline.json --junit gate.xml"
    )]
    Gate(gate::Ask),
    /// Compares flights signal by signal: RMS, maximum and when; verdicts side by side; added and missing signals.
    ///
    /// Signals are named as in an export. Exit code 1 if a tolerance is exceeded or the verdicts differ.
    #[command(after_help = "Example: replay compare old.mcap new.mcap")]
    Compare(compare::Ask),
    /// Writes a flight as one HTML page with its pictures inside: no script, no network.
    #[command(after_help = "Example: replay report flight.mcap")]
    Report(report::Ask),
    /// Writes a log's content as CSV, Parquet, .tlog or a Rerun recording.
    #[command(after_help = "Example: replay export flight.mcap --to parquet --output tables")]
    Export(export::Ask),
    /// Writes a flight as the frames that `board fly` reads, and the answers that it should give.
    #[command(after_help = "Example: replay frames flight.mcap frames recorded")]
    Frames(frames::Ask),
    /// Converts a ground station's .tlog to a flight log: telemetry only, nothing can be re-executed.
    #[command(after_help = "Example: replay import flight.tlog")]
    Import(import::Ask),
    /// Proves the books of ground stations (who did what when), or names the first broken link.
    ///
    /// Exit code 0 if every book is whole and its end is vouched for (by its signed last entry, a vehicle's log or --head), 1 if
    /// not, 2 if there is no book.
    #[command(after_help = "Example: replay audit ground.mcap vehicle.mcap")]
    Audit(audit::Ask),
    /// Recovers a whole log from a damaged one, and says what was kept and what time span is lost.
    #[command(after_help = "Example: replay recover cut.mcap whole.mcap")]
    Recover(recover::Ask),
    /// Finds drag, thrust, delays, gimbal, wind and sensor errors of flights, with 95 % intervals, and says what it cannot find.
    ///
    /// Only sensor samples, commands, feedback and the flight computer's estimates are used. Scales are over the data of the
    /// mission in the log, per mass: weigh the vehicle. Several logs are also put together. A burn on a test stand (CSV) is
    /// compared with its motor's certified curve.
    #[command(
        after_help = "Examples:\n  replay fit flight.mcap --write-mission better.toml\n  replay fit stand.csv --motor H45W"
    )]
    Fit(fit::Ask),
    /// Learns a motor lot, an airframe and a site from all flights so far, and says GO or NO-GO for the next one.
    ///
    /// The prior is a set of dispersions; each burn moves it. The day's flights are simulated with motors that the lot may
    /// have, and the landing rate gets an interval. GO (exit code 0) if the probability of a rate below the limit is at most
    /// the risk that is taken, NO-GO (exit code 1) if not.
    #[command(after_help = "Example: replay learn fits.json --mission mk2 --limit 0.95 --risk 0.1 --out day")]
    Learn(learn::Ask),
    /// Solves one recorded tick again: cost, residuals, active constraints, warm against cold start, predicted path.
    #[command(after_help = "Example: replay tick flight.mcap 2040")]
    Tick(tick::Ask),
    /// Prints a shell's completions.
    #[command(after_help = "Example: replay completions bash")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Prints the manual page (roff).
    #[command(after_help = "Example: replay man")]
    Man,
}

pub(crate) enum Answer {
    /// There is an answer.
    Given,
    /// Some of the logs could not be read.
    NotAll,
    /// A bit-for-bit comparison. If `strict`, it must cover the whole flight.
    Verified { outcome: Verification, strict: bool },
    /// Whether every book is proven.
    Audited { proven: bool },
    /// A comparison within tolerances.
    Compared { within: bool },
}

impl Answer {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Given | Self::Compared { within: true } | Self::Audited { proven: true } => 0,
            Self::Compared { within: false } | Self::Audited { proven: false } => EXIT_NO,
            Self::NotAll => EXIT_NO_ANSWER,
            Self::Verified { outcome, strict } => match outcome {
                Verification::Identical => 0,
                Verification::IdenticalReadablePart if !strict => 0,
                Verification::IdenticalReadablePart | Verification::Diverged => EXIT_NO,
                Verification::NotReplayable => EXIT_NO_ANSWER,
            },
        }
    }
}

impl Cli {
    /// Answers the question.
    pub(crate) fn run(self) -> Result<Answer> {
        match self.question {
            Question::Info(ask) => ask.run(),
            Question::Audit(ask) => ask.run(),
            Question::Verify(ask) => ask.run(),
            Question::Evaluate(ask) => ask.run(),
            Question::Refly(ask) => ask.run(),
            Question::Fit(ask) => ask.run(),
            Question::Learn(ask) => ask.run(),
            Question::Tick(ask) => ask.run(),
            Question::Sweep(ask) => ask.run(),
            Question::Bisect(ask) => ask.run(),
            Question::Gate(ask) => ask.run(),
            Question::Compare(ask) => ask.run(),
            Question::Report(ask) => ask.run(),
            Question::Export(ask) => ask.run(),
            Question::Frames(ask) => ask.run(),
            Question::Import(ask) => ask.run(),
            Question::Recover(ask) => ask.run(),
            Question::Completions { shell } => manual::completions(shell),
            Question::Man => manual::page(),
        }
    }
}

/// Writes an answer to standard output. A reader that closes the pipe early is not an error.
fn answer(write: impl FnOnce(&mut io::BufWriter<io::StdoutLock<'static>>) -> io::Result<()>) -> Result<()> {
    let mut output = io::BufWriter::new(io::stdout().lock());
    match write(&mut output).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error).context("standard output"),
        _ => Ok(()),
    }
}

/// Writes a new file; an existing one is kept.
fn write_new(path: &Path, text: &str) -> Result<()> {
    refuse_existing(path)?;
    NewFile::create(Destination { path, overwrite: Overwrite::Never }, Path::new(""))
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.commit()
        })
        .with_context(|| format!("{}: cannot be written", path.display()))
}

/// Refuses a path where a file is, before the work for it is done.
fn refuse_existing(path: &Path) -> Result<()> {
    ensure!(
        path.symlink_metadata().is_err(),
        "{}: exists already, and nothing is overwritten",
        path.display()
    );
    Ok(())
}

/// The text of a built-in, or of a file.
fn text_of(name: &str, builtin: &[(&str, &str)], what: &str) -> Result<String> {
    if let Some((_, text)) = builtin.iter().find(|(known, _)| *known == name) {
        return Ok((*text).to_owned());
    }
    std::fs::read_to_string(name).with_context(|| {
        let known = builtin.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!("'{name}' is neither a built-in {what} ({known}) nor a readable file")
    })
}

/// A flag that the first Ctrl-C (or a request to terminate) sets, so that what was found is still printed. The second
/// one ends the program.
fn stop_on_interrupt() -> Result<Arc<AtomicBool>> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, i32::from(EXIT_NO_ANSWER), Arc::clone(&stop))
            .and_then(|_| flag::register(signal, Arc::clone(&stop)))
            .context("cannot wait for Ctrl-C")?;
    }
    Ok(stop)
}

/// Writes a line to standard error; a closed standard error is ignored.
fn say(text: &str) {
    let _ = writeln!(io::stderr(), "replay: {text}");
}

/// Warns about damage, a missing end of the flight and missing ticks.
fn warn_of_what_is_missing(recording: &Recording) {
    if let Some(Gap { after, before }) = recording.gap() {
        let name = &recording.name;
        say(&format!(
            "warning: {name}: after tick {after} comes tick {before}; nothing after the gap was run again"
        ));
    }
    warn_of_damage(&recording.name, recording.damage.as_deref());
    warn_of_cut(&recording.name, recording.cut.as_ref());
}

/// Warns about the damage and the missing end of a log that was described.
fn warn_of_completeness(name: &str, found: &Completeness) {
    warn_of_damage(name, found.damage.as_deref());
    warn_of_cut(name, found.cut.as_ref());
}

/// Warns that only the part of a log before its damage is used.
fn warn_of_damage(file: &str, damage: Option<&str>) {
    if let Some(damage) = damage {
        say(&format!("warning: {file} is damaged: {damage}; what can be read was used"));
    }
}

/// Warns that a flight was not recorded to its end.
fn warn_of_cut(file: &str, cut: Option<&Cut>) {
    if let Some(cut) = cut {
        say(&format!("warning: {file}: the flight {cut}"));
    }
}
