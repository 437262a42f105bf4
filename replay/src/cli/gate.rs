//! `replay gate`.

use std::collections::BTreeMap;
use std::io::{IsTerminal as _, Write as _};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, ensure};
use clap::Args;
use replay::gate::{
    Baseline, Change, Checked, GateError, GateProgress, GateState, Judged, Outcome, Skipped, find, fly_all,
    judge,
};
use replay::output::{Destination, NewFile, Overwrite};
use replay::print::{GateReport, JunitCase, gate_cases, print_gate, print_json, print_junit};

use super::{Answer, answer, say, stop_on_interrupt};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The directory: logs (*.mcap) and campaigns, in subdirectories, too.
    directory: PathBuf,
    /// The outcomes that were accepted, a JSON file.
    #[arg(long, value_name = "FILE")]
    baseline: PathBuf,
    /// Write the outcomes of this build as the new baseline; exit code 0 whatever changed.
    #[arg(long)]
    accept: bool,
    /// Let this build decide differently from the record, as long as no flight gets worse.
    #[arg(long)]
    may_diverge: bool,
    /// A margin that changed by no more than this is the same (1 is from the middle of the limits to their edge).
    #[arg(long, value_name = "MARGIN", default_value_t = 0.02)]
    tolerance: f64,
    /// Flights flown at the same time; the answer does not depend on it [default: all processors].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Keep every finished flight in this file, and continue from it if it exists.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Write JUnit XML to this file, beside the table.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Replace an existing JUnit file.
    #[arg(long)]
    force: bool,
    /// Answer in JSON instead of the table.
    #[arg(long)]
    json: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        ensure!(
            self.tolerance >= 0.0 && self.tolerance.is_finite(),
            "--tolerance {}: must be 0 or more",
            self.tolerance
        );
        let baseline = match Baseline::read(&self.baseline) {
            Ok(baseline) => baseline,
            // The first baseline.
            Err(_) if self.accept && !self.baseline.exists() => Baseline::default(),
            Err(error) => return Err(error.into()),
        };
        let (flights, skipped) = find(&self.directory)?;
        for Skipped { name, reason } in &skipped {
            say(&format!("left out: {name}: {reason}"));
        }
        let junit = self.junit.as_deref().map(|path| junit_file(path, self.force)).transpose()?;
        let mut state = match &self.state {
            None => GateState::in_memory(),
            Some(path) => {
                GateState::open(path).with_context(|| format!("{}: cannot be used", path.display()))?
            }
        };
        let jobs =
            self.jobs.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
        let stop = stop_on_interrupt()?;
        let outcomes = fly_all(&flights, jobs, &mut state, &stop, &mut show)
            .context("the state file cannot be written")?;
        let interrupted = stop.load(Ordering::Relaxed) && outcomes.len() < flights.len();
        let mut judged = judge(&outcomes, &baseline, self.tolerance);
        // Flights of the baseline that are lost are an answer, but not a new baseline.
        if !interrupted && (self.accept || judged.iter().all(|judged| judged.change == Change::NoFlight)) {
            some_flight(&self.directory, &outcomes)?;
        }
        if interrupted {
            // What was not reached is not missing.
            let known = |judged: &Judged| !flights.iter().any(|found| found.name == judged.name);
            judged.retain(|judged| judged.change != Change::Missing || known(judged));
        }
        let passed = !interrupted && !judged.iter().any(|judged| judged.fails(self.may_diverge));
        if let Some(file) = junit {
            write_junit(file, &gate_cases(&judged, self.may_diverge))?;
        }
        let report = GateReport { passed, interrupted, flights: &judged };
        answer(|output| if self.json { print_json(&report, output) } else { print_gate(&report, output) })?;
        if self.accept && !interrupted {
            Baseline::of(outcomes).write(&self.baseline)?;
            say(&format!("accepted: {}", self.baseline.display()));
            return Ok(Answer::Given);
        }
        Ok(if interrupted { Answer::NotAll } else { Answer::Compared { within: passed } })
    }
}

/// Refuses a directory whose logs hold no flight.
fn some_flight(directory: &Path, outcomes: &BTreeMap<String, Outcome>) -> Result<(), GateError> {
    if outcomes.values().any(|outcome| outcome.checked != Checked::NoFlight) {
        return Ok(());
    }
    let (name, first) = outcomes.first_key_value().map_or_else(Default::default, |(name, outcome)| {
        (name.clone(), outcome.problem.clone().unwrap_or_default())
    });
    Err(GateError::NoFlights { path: directory.to_owned(), name, why: first })
}

/// Before the flights, so that nothing is flown for a file that may not be written.
fn junit_file(path: &Path, force: bool) -> Result<NewFile> {
    let overwrite = Overwrite::if_forced(force);
    NewFile::create(Destination { path, overwrite }, Path::new(""))
        .with_context(|| format!("{}: cannot be written", path.display()))
}

fn write_junit(mut file: NewFile, cases: &[JunitCase]) -> Result<()> {
    let path = file.path().to_owned();
    let written = print_junit("gate", cases.to_vec(), &mut file).and_then(|()| file.commit());
    written.with_context(|| format!("{}: cannot be written", path.display()))
}

/// Shows progress about twenty times on a terminal, elsewhere only at the end.
fn show(GateProgress { done, flights }: GateProgress) {
    let mut output = std::io::stderr();
    let ended = done == flights;
    if ended || (output.is_terminal() && done.is_multiple_of((flights / 20).max(1))) {
        let end = if ended { "\n" } else { "" };
        // Progress goes to standard error, which may be closed.
        let _ = write!(output, "\rreplay: {done} of {flights} flights{end}");
    }
}
