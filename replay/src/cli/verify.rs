//! `replay verify`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use replay::log::LogError;
use replay::print::{JunitCase, JunitOutcome, print_json, print_junit, print_verify, verify_case};
use replay::verify::{Outcome, VerifyReport, verify};

use super::{Answer, answer, say, warn_of_damage};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The logs, MCAP files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Answer in JSON: a report, or of several logs a list of them.
    #[arg(long, conflicts_with = "junit")]
    json: bool,
    /// Answer in JUnit XML.
    #[arg(long)]
    junit: bool,
}

/// What became of one log.
type Verified<'a> = (&'a Path, Result<VerifyReport, LogError>);

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let mut answers: Vec<Verified> = Vec::new();
        for file in &self.files {
            #[expect(clippy::disallowed_methods, reason = "tells the user how fast it was; decides nothing")]
            let started = Instant::now();
            let verified = verify(file);
            let took = started.elapsed();
            match &verified {
                Ok(report) => {
                    warn_of_damage(&report.file, report.damage.as_deref());
                    warn_of_build(report);
                    say_speed(report, took);
                }
                // One log that cannot be read must not hide what the others say.
                Err(error) if self.files.len() > 1 => say(&format!("{error}")),
                Err(_) => {}
            }
            answers.push((file, verified));
        }
        if let [(_, Err(_))] = answers.as_slice()
            && let Some((_, Err(error))) = answers.pop()
        {
            return Err(error.into());
        }
        answer(|output| self.print(&answers, output))?;
        Ok(Answer::Verified(worst(&answers)))
    }

    fn print(&self, answers: &[Verified], output: &mut impl Write) -> std::io::Result<()> {
        if self.junit {
            return print_junit("verify", answers.iter().map(case).collect(), output);
        }
        let reports: Vec<&VerifyReport> =
            answers.iter().filter_map(|(_, verified)| verified.as_ref().ok()).collect();
        match reports.as_slice() {
            [report] if self.json && answers.len() == 1 => print_json(report, output),
            _ if self.json => print_json(&reports, output),
            _ => reports.iter().try_for_each(|report| print_verify(report, output)),
        }
    }
}

fn case((path, verified): &Verified) -> JunitCase {
    match verified {
        Ok(report) => verify_case(report),
        Err(error) => JunitCase {
            name: format!("verify {}", path.display()),
            outcome: JunitOutcome::Error { message: error.to_string() },
        },
    }
}

/// A difference found outweighs a log that gives no answer, and that an identical one.
fn worst(answers: &[Verified]) -> Outcome {
    let outcome = |verified: &Result<VerifyReport, LogError>| {
        verified.as_ref().map_or(Outcome::NotReplayable, |report| report.outcome)
    };
    let rank = |outcome: Outcome| match outcome {
        Outcome::Identical => 0,
        Outcome::IdenticalReadablePart => 1,
        Outcome::NotReplayable => 2,
        Outcome::Diverged => 3,
    };
    let outcomes = answers.iter().map(|(_, verified)| outcome(verified));
    outcomes.max_by_key(|outcome| rank(*outcome)).unwrap_or(Outcome::NotReplayable)
}

fn warn_of_build(report: &VerifyReport) {
    let differences = &report.build.differences;
    if report.outcome == Outcome::Diverged && !differences.is_empty() {
        let facts: Vec<&str> = differences.iter().map(|difference| difference.fact.as_str()).collect();
        say(&format!("note: another build wrote {}; it differs in {}", report.file, facts.join(", ")));
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
