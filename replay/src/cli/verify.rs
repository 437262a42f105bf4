//! `replay verify`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use replay::log::LogError;
use replay::print::{JunitCase, JunitOutcome, print_json, print_junit, print_verify, verify_case};
use replay::verify::{Verification, VerifyReport, verify};

use super::{Answer, answer, say, warn_of_cut, warn_of_damage};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The logs, MCAP files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Answer in JSON: a report, or a list of reports for several logs.
    #[arg(long, conflicts_with = "junit")]
    json: bool,
    /// Answer in JUnit XML; strict unless --strict=false.
    #[arg(long)]
    junit: bool,
    /// Exit code 1 unless the whole of each flight was compared: damaged logs fail, and logs that end before their
    /// flight did.
    #[arg(
        long, value_name = "true|false", num_args = 0..=1, require_equals = true, default_missing_value = "true"
    )]
    strict: Option<bool>,
}

/// The result for one log.
type Verified<'a> = (&'a Path, Result<Vec<VerifyReport>, LogError>);

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let mut answers: Vec<Verified> = Vec::new();
        for file in &self.files {
            #[expect(clippy::disallowed_methods, reason = "tells the user how fast it was; decides nothing")]
            let started = Instant::now();
            let verified = verify(file);
            let took = started.elapsed();
            match &verified {
                Ok(reports) => {
                    for report in reports {
                        warn_of_damage(&report.file, report.damage.as_deref());
                        warn_of_cut(&report.file, report.cut.as_ref());
                        warn_of_build(report);
                    }
                    say_speed(reports, took);
                }
                // One unreadable log must not hide the results of the others.
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
        Ok(Answer::Verified { outcome: worst(&answers), strict: self.is_strict() })
    }

    /// A build server only looks at pass or fail.
    fn is_strict(&self) -> bool {
        self.strict.unwrap_or(self.junit)
    }

    fn print(&self, answers: &[Verified], output: &mut impl Write) -> std::io::Result<()> {
        if self.junit {
            let cases = answers.iter().flat_map(|verified| cases(verified, self.is_strict()));
            return print_junit("verify", cases.collect(), output);
        }
        let reports: Vec<&VerifyReport> =
            answers.iter().filter_map(|(_, verified)| verified.as_ref().ok()).flatten().collect();
        match reports.as_slice() {
            [report] if self.json && answers.len() == 1 => print_json(report, output),
            _ if self.json => print_json(&reports, output),
            _ => reports.iter().try_for_each(|report| print_verify(report, output)),
        }
    }
}

fn cases((path, verified): &Verified, strict: bool) -> Vec<JunitCase> {
    match verified {
        Ok(reports) => reports.iter().map(|report| verify_case(report, strict)).collect(),
        Err(error) => vec![JunitCase {
            name: format!("verify {}", path.display()),
            outcome: JunitOutcome::Error { message: error.to_string() },
        }],
    }
}

/// The worst result decides: a difference, then no answer, then identical.
fn worst(answers: &[Verified]) -> Verification {
    let rank = |outcome: Verification| match outcome {
        Verification::Identical => 0,
        Verification::IdenticalReadablePart => 1,
        Verification::NotReplayable => 2,
        Verification::Diverged => 3,
    };
    let outcomes = answers.iter().flat_map(|(_, verified)| match verified {
        Ok(reports) => reports.iter().map(|report| report.outcome).collect(),
        Err(_) => vec![Verification::NotReplayable],
    });
    outcomes.max_by_key(|outcome| rank(*outcome)).unwrap_or(Verification::NotReplayable)
}

fn warn_of_build(report: &VerifyReport) {
    let differences = &report.build.differences;
    if report.outcome == Verification::Diverged && !differences.is_empty() {
        let facts: Vec<&str> = differences.iter().map(|difference| difference.fact.as_str()).collect();
        say(&format!("note: another build wrote {}; it differs in {}", report.file, facts.join(", ")));
    }
}

fn say_speed(reports: &[VerifyReport], took: Duration) {
    let seconds = took.as_secs_f64();
    let flight_s: f64 = reports.iter().filter_map(|report| report.flight_s).sum();
    if flight_s > 0.0 && seconds > 0.0 {
        say(&format!(
            "{flight_s:.1} s of flight in {seconds:.2} s, {:.0} times real time",
            flight_s / seconds
        ));
    }
}
