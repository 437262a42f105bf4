//! `replay verify`.

use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use replay::print::{print_json, print_junit, print_verify, verify_case};
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

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let mut reports = Vec::new();
        for file in &self.files {
            #[expect(clippy::disallowed_methods, reason = "tells the user how fast it was; decides nothing")]
            let started = Instant::now();
            let report = verify(file)?;
            let took = started.elapsed();
            warn_of_damage(&report.file, report.damage.as_deref());
            warn_of_build(&report);
            say_speed(&report, took);
            reports.push(report);
        }
        answer(|output| self.print(&reports, output))?;
        Ok(Answer::Verified(worst(&reports)))
    }

    fn print(&self, reports: &[VerifyReport], output: &mut impl Write) -> std::io::Result<()> {
        match reports {
            _ if self.junit => print_junit("verify", reports.iter().map(verify_case).collect(), output),
            [report] if self.json => print_json(report, output),
            _ if self.json => print_json(&reports, output),
            _ => reports.iter().try_for_each(|report| print_verify(report, output)),
        }
    }
}

/// A difference found outweighs a log that gives no answer, and that an identical one.
fn worst(reports: &[VerifyReport]) -> Outcome {
    let rank = |outcome: Outcome| match outcome {
        Outcome::Identical => 0,
        Outcome::IdenticalReadablePart => 1,
        Outcome::NotReplayable => 2,
        Outcome::Diverged => 3,
    };
    let outcomes = reports.iter().map(|report| report.outcome);
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
