//! The command line: what is asked, and how the answer leaves the program. One file a subcommand.

mod bisect;
mod compare;
mod evaluate;
mod export;
mod import;
mod info;
mod recover;
mod refly;
mod report;
mod settings;
mod sweep;
mod tick;
mod verify;

use std::io::{self, Write};

use anyhow::{Context as _, Result};
use clap::{Parser, Subcommand};
use replay::info::Completeness;
use replay::log::{Cut, Gap, Recording};
use replay::verify::Outcome;

/// The answer is no: the controller decides otherwise than recorded, or flights differ by more than is tolerated.
pub(crate) const EXIT_NO: u8 = 1;
/// There is no answer: wrong usage, an unreadable file, not a flight log, or not replayable.
pub(crate) const EXIT_NO_ANSWER: u8 = 2;

/// What is in a flight log, does the controller decide again what it decided then, and what would it have done?
///
/// Answers go to standard output, warnings and errors to standard error.
///
/// Exit codes:
///   0  the question is answered: the log is described, or every tick that could be read is identical
///   1  verify: some tick differs, or with --strict not the whole flight was compared;
///      compare: more is apart or missing than is tolerated, or the verdicts differ
///   2  no answer: wrong usage, the file cannot be read or is no flight log, or verify cannot re-execute
///      some tick (no ticks, no profile, ticks missing) and none that it could differs;
///      or a file would be overwritten and --force is not given
///
/// A damaged log is used up to the damage, with a warning and exit code 0, but for verify --strict (which --junit
/// is by itself) and for compare.
#[derive(Debug, Parser)]
#[command(name = "replay", version, about, long_about, verbatim_doc_comment)]
pub(crate) struct Cli {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, Subcommand)]
enum Question {
    /// Says what is in a log: grade, run, build, phases, verdict, ticks, channels, damage.
    Info(info::Ask),
    /// Re-executes every recorded controller tick and compares what it decides bit for bit.
    ///
    /// The controller is built from the profile in the log and starts before tick 0. All fields of its output and
    /// the digest of what it remembers are compared; measured times are not. Of a divergence it says how it grows,
    /// and whether the landing would end otherwise (flown on in simulation from the first tick that differs).
    Verify(verify::Ask),
    /// Open loop: what the controller alone would have commanded with other settings, on the recorded inputs.
    Evaluate(evaluate::Ask),
    /// Closed loop: flies the flight again in simulation from a chosen moment, with other settings.
    ///
    /// The plant starts in the recorded state of that moment and the controller with what it remembered; nothing of
    /// the record is used afterwards. With nothing changed, a simulated flight comes out the same bit for bit.
    ///
    /// A flight from apogee is flown again from apogee with the recorded draw up to that moment, since a log does not
    /// hold the memory of gusts, servos and sensors; the answer says how many recorded frames came out the same.
    Refly(refly::Ask),
    /// Flies flights again with many settings (closed loop) and ranks them by the worst flight's margin.
    Sweep(sweep::Ask),
    /// Looks for the smallest change of one setting that turns landed into not landed, or back (closed loop).
    Bisect(bisect::Ask),
    /// Compares flights signal by signal: RMS, maximum and when; verdicts side by side; added and missing signals.
    ///
    /// Signals are named as in an export. Exit code 1 if a tolerance is exceeded or the verdicts differ.
    Compare(compare::Ask),
    /// Writes a flight as one HTML page with its pictures inside: no script, no network.
    Report(report::Ask),
    /// Writes a log's content as CSV, Parquet, .tlog or a Rerun recording.
    Export(export::Ask),
    /// Makes a flight log of a ground station's .tlog: telemetry only, nothing can be re-executed.
    Import(import::Ask),
    /// Makes a whole log of a damaged one, and says what was kept and what span is lost.
    Recover(recover::Ask),
    /// Solves one recorded tick again: cost, residuals, active constraints, warm against cold start, predicted path.
    Tick(tick::Ask),
}

/// How a question was answered.
pub(crate) enum Answer {
    /// There is an answer.
    Given,
    /// A comparison by bits. If `strict`, it must be of the whole flight.
    Verified { outcome: Outcome, strict: bool },
    /// A comparison within tolerances.
    Compared { within: bool },
}

impl Answer {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Given | Self::Compared { within: true } => 0,
            Self::Compared { within: false } => EXIT_NO,
            Self::Verified { outcome, strict } => match outcome {
                Outcome::Identical => 0,
                Outcome::IdenticalReadablePart if !strict => 0,
                Outcome::IdenticalReadablePart | Outcome::Diverged => EXIT_NO,
                Outcome::NotReplayable => EXIT_NO_ANSWER,
            },
        }
    }
}

impl Cli {
    /// Answers the question.
    pub(crate) fn run(self) -> Result<Answer> {
        match self.question {
            Question::Info(ask) => ask.run(),
            Question::Verify(ask) => ask.run(),
            Question::Evaluate(ask) => ask.run(),
            Question::Refly(ask) => ask.run(),
            Question::Tick(ask) => ask.run(),
            Question::Sweep(ask) => ask.run(),
            Question::Bisect(ask) => ask.run(),
            Question::Compare(ask) => ask.run(),
            Question::Report(ask) => ask.run(),
            Question::Export(ask) => ask.run(),
            Question::Import(ask) => ask.run(),
            Question::Recover(ask) => ask.run(),
        }
    }
}

/// Writes an answer to standard output. A reader that has heard enough is no failure.
fn answer(write: impl FnOnce(&mut io::BufWriter<io::StdoutLock<'static>>) -> io::Result<()>) -> Result<()> {
    let mut output = io::BufWriter::new(io::stdout().lock());
    match write(&mut output).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error).context("standard output"),
        _ => Ok(()),
    }
}

/// Says something beside the answer; if nobody can hear it, nothing is lost.
fn say(text: &str) {
    let _ = writeln!(io::stderr(), "replay: {text}");
}

/// Warns that a log is used up to its damage only, that its flight's end is missing, or ticks on the way.
fn warn_of_what_is_missing(recording: &Recording) {
    if let Some(Gap { after, before }) = recording.gap() {
        let name = &recording.name;
        say(&format!(
            "warning: {name}: after tick {after} comes tick {before}; nothing behind the gap was run again"
        ));
    }
    warn_of_damage(&recording.name, recording.damage.as_deref());
    warn_of_cut(&recording.name, recording.cut.as_ref());
}

/// The same of a log that was described.
fn warn_of_completeness(name: &str, found: &Completeness) {
    warn_of_damage(name, found.damage.as_deref());
    warn_of_cut(name, found.cut.as_ref());
}

/// Warns that a log is used up to its damage only.
fn warn_of_damage(file: &str, damage: Option<&str>) {
    if let Some(damage) = damage {
        say(&format!("warning: {file} is damaged: {damage}; everything before was used"));
    }
}

/// Warns that a flight was not recorded to its end.
fn warn_of_cut(file: &str, cut: Option<&Cut>) {
    if let Some(cut) = cut {
        say(&format!("warning: {file}: the flight {cut}"));
    }
}
