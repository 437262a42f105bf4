//! The command line: what is asked, and how the answer leaves the program.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use clap::{Args, Parser, Subcommand};
use replay::info::{Info, info};
use replay::print::{print_info, print_json, print_verify};
use replay::verify::{Outcome, VerifyReport, verify};

/// The answer is no: the controller decides otherwise than recorded.
pub(crate) const EXIT_DIVERGED: u8 = 1;
/// There is no answer: wrong usage, an unreadable file, not a flight log, or not replayable.
pub(crate) const EXIT_NO_ANSWER: u8 = 2;

/// What is in a flight log, and does the controller decide again what it decided then?
///
/// Answers go to standard output, warnings and errors to standard error.
///
/// Exit codes:
///   0  the question is answered: the log is described, or every tick that could be read is identical
///   1  verify: some tick differs
///   2  no answer: wrong usage, the file cannot be read or is no flight log, or verify cannot re-execute
///      some tick (no ticks, no profile, ticks missing) and none that it could differs
///
/// A damaged log is used up to the damage, with a warning and exit code 0.
#[derive(Debug, Parser)]
#[command(name = "replay", version, about, long_about, verbatim_doc_comment)]
pub(crate) struct Cli {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, Subcommand)]
enum Question {
    /// Says what is in a log: grade, run, build, phases, verdict, ticks, channels, damage.
    Info(Ask),
    /// Re-executes every recorded controller tick and compares what it decides bit for bit.
    ///
    /// The controller is built from the profile in the log and starts before tick 0. All fields of its output and
    /// the digest of what it remembers are compared; measured times are not.
    Verify(Ask),
}

#[derive(Debug, Args)]
struct Ask {
    /// The log, an MCAP file.
    file: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

/// How a question was answered.
pub(crate) enum Answer {
    Described,
    Verified(Outcome),
}

impl Answer {
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Described | Self::Verified(Outcome::Identical | Outcome::IdenticalReadablePart) => 0,
            Self::Verified(Outcome::Diverged) => EXIT_DIVERGED,
            Self::Verified(Outcome::NotReplayable) => EXIT_NO_ANSWER,
        }
    }
}

impl Cli {
    /// Answers the question.
    pub(crate) fn run(self) -> Result<Answer> {
        match self.question {
            Question::Info(Ask { file, json }) => {
                let info = info(&file)?;
                answer(|output| if json { print_json(&info, output) } else { print_info(&info, output) })?;
                warn_about_info(&info);
                Ok(Answer::Described)
            }
            Question::Verify(Ask { file, json }) => {
                #[expect(
                    clippy::disallowed_methods,
                    reason = "tells the user how fast it was; decides nothing"
                )]
                let started = Instant::now();
                let report = verify(&file)?;
                let took = started.elapsed();
                answer(
                    |output| {
                        if json { print_json(&report, output) } else { print_verify(&report, output) }
                    },
                )?;
                warn_about_verify(&report);
                say_speed(&report, took);
                Ok(Answer::Verified(report.outcome))
            }
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

fn warn_about_info(info: &Info) {
    if let Some(damage) = &info.completeness.damage {
        say(&format!("warning: {} is damaged: {damage}", info.file));
    }
}

fn warn_about_verify(report: &VerifyReport) {
    let file = &report.file;
    if let Some(damage) = &report.damage {
        say(&format!("warning: {file} is damaged: {damage}; everything before was used"));
    }
    let differences = &report.build.differences;
    if report.outcome == Outcome::Diverged && !differences.is_empty() {
        let facts: Vec<&str> = differences.iter().map(|difference| difference.fact.as_str()).collect();
        say(&format!("note: another build wrote {file}; it differs in {}", facts.join(", ")));
    }
}

fn say_speed(report: &VerifyReport, took: Duration) {
    let seconds = took.as_secs_f64();
    match report.flight_s {
        Some(flight_s) if flight_s > 0.0 && seconds > 0.0 => {
            say(&format!(
                "{flight_s:.1} s of flight in {seconds:.2} s, {:.0} times real time",
                flight_s / seconds
            ));
        }
        _ => {}
    }
}
