//! Holds a directory of flights against a baseline: did this build make any of them worse?
//!
//! Each flight is verified (the recorded decisions, made again) and flown again closed loop. A flight is a log, or one
//! flight of a campaign's directory, which is flown again from its order and held against its row. The outcomes are
//! compared with those of a baseline file that an earlier run wrote. Flights are independent, so the answer does not
//! depend on how many are flown at the same time.

mod find;
mod fly;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail, ensure};
use campaign::stopwatch::Stopwatch;
use clap::Args;
pub use find::{Found, Skipped, SuiteError, find};
pub use fly::{SuiteState, fly_all};
use protocol::log::build::build_info;
use serde::{Deserialize, Serialize};

use super::Printed;
use crate::cli::{Outcome, answer, in_pool, say, stop_on_interrupt};
use crate::output::{Destination, NewFile, Overwrite, WriteError, write_whole};
use crate::print::{JunitCase, JunitOutcome, counted, print_json, print_junit, shown, write_junit};

/// Whether the recorded decisions are made again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Checked {
    /// All of them, bit for bit; of a campaign's flight, its row.
    Identical,
    /// Some differ.
    Diverged,
    /// The log is damaged, or not all of it can be made again.
    Unverified,
    /// The file holds no flight: no frames and no frames, as an empty log or that of a ground station.
    NoFlight,
}

impl Checked {
    /// The word in the table.
    pub fn word(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Diverged => "DIVERGED",
            Self::Unverified => "unverified",
            Self::NoFlight => "-",
        }
    }
}

/// How a flight ended when it was flown again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Flown {
    pub landed: bool,
    /// In one sentence.
    pub ending: String,
    /// The smallest distance to a limit as a fraction of it; see [`margin`](crate::refly::margin). Text, because every
    /// reader reads text back as the same number.
    pub margin: Option<String>,
}

impl Flown {
    /// The margin as a number.
    pub fn margin(&self) -> Option<f64> {
        self.margin.as_ref()?.parse().ok()
    }
}

/// What this build makes of a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightResult {
    /// Which flight it is, by its content; `None` if the file has none.
    pub flight: Option<String>,
    pub checked: Checked,
    /// `None` if it did not come down, or cannot be flown again.
    pub flown: Option<Flown>,
    /// Why it was not verified or not flown again.
    pub problem: Option<String>,
}

const FORMAT: u32 = 1;

/// Why a baseline cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BaselineError {
    /// It cannot be read.
    #[error("{}: cannot be read; --accept writes a first baseline", path.display())]
    Read {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// It is no baseline.
    #[error("{}: is no baseline of `replay verify`: {reason}", path.display())]
    Content { path: PathBuf, reason: String },
}

/// The accepted outcomes, by flight.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    format: u32,
    /// The build whose outcomes they are.
    build: BTreeMap<String, String>,
    pub flights: BTreeMap<String, FlightResult>,
}

impl Baseline {
    /// The outcomes of this build, without the files that hold no flight.
    pub fn of(mut flights: BTreeMap<String, FlightResult>) -> Self {
        flights.retain(|_, outcome| outcome.checked != Checked::NoFlight);
        Self { format: FORMAT, build: build_info(), flights }
    }

    /// Reads a baseline.
    ///
    /// # Errors
    /// See [`BaselineError`].
    pub fn read(path: &Path) -> Result<Self, BaselineError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| BaselineError::Read { path: path.to_owned(), source })?;
        let wrong = |reason: String| BaselineError::Content { path: path.to_owned(), reason };
        let baseline: Self = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        if baseline.format != FORMAT {
            return Err(wrong(format!("format {}; this build reads {FORMAT}", baseline.format)));
        }
        Ok(baseline)
    }

    /// Writes the baseline, complete or not at all; replaces an earlier one.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        let destination = Destination { path, overwrite: Overwrite::Always };
        write_whole(destination, Path::new(""), |file| {
            let text = serde_json::to_string_pretty(self)?;
            writeln!(file, "{text}")
        })
    }
}

/// What became of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// Within the tolerance of the margin.
    Same,
    /// It has more margin.
    Better,
    /// It landed neither then nor before, or has less margin.
    Worse,
    /// It lands now and did not before.
    NowLands,
    /// It does not land any more.
    NoLongerLands,
    /// Its recorded decisions are not made any more, and it has the same margin.
    Diverged,
    /// It can no longer be verified or flown again, or is no flight any more.
    Lost,
    /// The baseline does not have it.
    New,
    /// The same flight is here under another name.
    Copy,
    /// It is no flight, and none that the baseline knows.
    NoFlight,
    /// The baseline has it, and the directory does not.
    Missing,
}

impl Change {
    /// The word in the table.
    pub fn word(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Better => "better",
            Self::Worse => "WORSE",
            Self::NowLands => "FLIPPED: lands now",
            Self::NoLongerLands => "FLIPPED: lands no longer",
            Self::Diverged => "DIVERGED",
            Self::Lost => "LOST",
            Self::New => "new",
            Self::Copy => "copy",
            Self::NoFlight => "no flight",
            Self::Missing => "MISSING",
        }
    }

    /// Whether it fails the gate.
    fn fails(self) -> bool {
        matches!(self, Self::Worse | Self::NoLongerLands | Self::Diverged | Self::Lost | Self::Missing)
    }
}

/// A flight and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    pub name: String,
    pub change: Change,
    /// The recorded decisions were made again and are not any more, whatever the margin.
    pub newly_diverged: bool,
    /// Accepted earlier.
    pub before: Option<FlightResult>,
    /// Now.
    pub now: Option<FlightResult>,
}

impl Judged {
    /// Whether it fails the gate; `may_diverge`: another build may decide differently as long as nothing gets worse. A log
    /// that cannot be verified always fails.
    pub fn fails(&self, may_diverge: bool) -> bool {
        if self.now.as_ref().is_some_and(|now| now.checked == Checked::Unverified) {
            return true;
        }
        match self.change {
            Change::Diverged => !may_diverge,
            change => change.fails() || (self.newly_diverged && !may_diverge),
        }
    }
}

/// Whether both are the same flight, by their content.
fn is_same_flight(a: &FlightResult, b: &FlightResult) -> bool {
    a.flight.is_some() && a.flight == b.flight
}

/// Holds outcomes against a baseline. A margin that changed by no more than `tolerance` is the same. A flight is known by its
/// content, whatever its name is.
pub fn judge(outcomes: &BTreeMap<String, FlightResult>, baseline: &Baseline, tolerance: f64) -> Vec<Judged> {
    // Another flight under the name of one is no change of that one.
    let keeps_its_name = |name: &str, before: &FlightResult| {
        outcomes
            .get(name)
            .is_some_and(|now| before.flight.is_none() || now.flight.is_none() || is_same_flight(before, now))
    };
    let before = |name: &str, now: &FlightResult| {
        let of_its_name = baseline.flights.get(name).filter(|before| keeps_its_name(name, before));
        of_its_name.or_else(|| {
            let renamed = |(name, before): &(&String, &FlightResult)| {
                is_same_flight(before, now) && !keeps_its_name(name, before)
            };
            baseline.flights.iter().find(renamed).map(|(_, before)| before)
        })
    };
    // The first of equal flights is judged; one that the baseline has by its name comes before all others.
    let is_copy = |name: &str, now: &FlightResult| {
        let place = |name: &String| (!baseline.flights.contains_key(name), name.clone());
        let own = place(&name.to_owned());
        outcomes.iter().any(|(other, found)| is_same_flight(found, now) && found == now && place(other) < own)
            && !baseline.flights.get(name).is_some_and(|before| keeps_its_name(name, before))
    };
    let of_now = outcomes.iter().map(|(name, now)| {
        let copy = is_copy(name, now);
        let before = before(name, now).filter(|_| !copy);
        let change = match before {
            _ if copy => Change::Copy,
            Some(before) => change(before, now, tolerance),
            None if now.checked == Checked::NoFlight => Change::NoFlight,
            None => Change::New,
        };
        let newly_diverged = now.checked == Checked::Diverged
            && before.is_some_and(|before| before.checked == Checked::Identical);
        Judged { name: name.clone(), change, newly_diverged, before: before.cloned(), now: Some(now.clone()) }
    });
    let is_here = |name: &str, before: &FlightResult| {
        keeps_its_name(name, before) || outcomes.values().any(|now| is_same_flight(before, now))
    };
    let missing = baseline.flights.iter().filter(|(name, before)| !is_here(name, before));
    let missing = missing.map(|(name, before)| Judged {
        name: name.clone(),
        change: Change::Missing,
        newly_diverged: false,
        before: Some(before.clone()),
        now: None,
    });
    let mut judged: Vec<Judged> = of_now.chain(missing).collect();
    judged.sort_by(|a, b| in_order(&a.name).cmp(&in_order(&b.name)));
    judged
}

/// Flight 10 of a campaign comes after flight 9.
fn in_order(name: &str) -> (&str, u64) {
    let numbered =
        name.rsplit_once('#').and_then(|(campaign, number)| Some((campaign, number.parse().ok()?)));
    numbered.unwrap_or((name, 0))
}

fn change(before: &FlightResult, now: &FlightResult, tolerance: f64) -> Change {
    // What was neither verified nor flown again did not land differently.
    let unknown = |outcome: &FlightResult| {
        outcome.flown.is_none() && matches!(outcome.checked, Checked::Unverified | Checked::NoFlight)
    };
    if unknown(now) && !unknown(before) {
        return Change::Lost;
    }
    let landed = |outcome: &FlightResult| outcome.flown.as_ref().is_some_and(|flown| flown.landed);
    match (landed(before), landed(now)) {
        (true, false) => return Change::NoLongerLands,
        (false, true) => return Change::NowLands,
        _ => {}
    }
    if before.checked == Checked::Identical && now.checked == Checked::Unverified {
        return Change::Lost;
    }
    let margin = |outcome: &FlightResult| outcome.flown.as_ref().and_then(Flown::margin);
    match (margin(before), margin(now)) {
        (Some(_), None) => Change::Lost,
        (None, Some(_)) => Change::Better,
        (Some(then), Some(now)) if now < then - tolerance => Change::Worse,
        (Some(then), Some(now)) if now > then + tolerance => Change::Better,
        _ if before.checked == Checked::Identical && now.checked == Checked::Diverged => Change::Diverged,
        _ => Change::Same,
    }
}

/// Most flights without news that the table lists.
const SAME_SHOWN: usize = 20;

/// A gate as JSON has it.
#[derive(Debug, Serialize)]
pub struct SuiteReport<'a> {
    /// No flight fails.
    pub passed: bool,
    pub interrupted: bool,
    pub flights: &'a [Judged],
}

/// Writes the table: the flights that changed, then those that did not.
///
/// # Errors
/// The output failed.
pub fn print_suite(report: &SuiteReport, output: &mut impl Write) -> io::Result<()> {
    let width =
        report.flights.iter().map(|judged| judged.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
    writeln!(
        output,
        "{:<width$}  {:<10} {:>8} {:>8}  {:<24} ending",
        "flight", "verified", "before", "margin", "change"
    )?;
    let (same, changed): (Vec<&Judged>, Vec<&Judged>) =
        report.flights.iter().partition(|judged| judged.change == Change::Same);
    for judged in changed.iter().chain(same.iter().take(SAME_SHOWN)) {
        let now = judged.now.as_ref();
        writeln!(
            output,
            "{:<width$}  {:<10} {:>8} {:>8}  {:<24} {}",
            shown(&judged.name),
            now.map_or("-", |now| now.checked.word()),
            margin(judged.before.as_ref()),
            margin(now),
            judged.change.word(),
            shown(&ending(judged))
        )?;
    }
    if same.len() > SAME_SHOWN {
        writeln!(output, "and {} more without a change", same.len() - SAME_SHOWN)?;
    }
    writeln!(output, "{}", summary(report))
}

/// One line: how many of which change.
fn summary(report: &SuiteReport) -> String {
    let all = [
        Change::Same,
        Change::Better,
        Change::NowLands,
        Change::New,
        Change::Copy,
        Change::NoFlight,
        Change::Worse,
        Change::NoLongerLands,
        Change::Diverged,
        Change::Lost,
        Change::Missing,
    ];
    let counts: Vec<String> = all
        .into_iter()
        .filter_map(|change| {
            let count = report.flights.iter().filter(|judged| judged.change == change).count();
            (count > 0).then(|| format!("{count} {}", change.word()))
        })
        .collect();
    let word = match report {
        SuiteReport { interrupted: true, .. } => "INTERRUPTED",
        SuiteReport { passed: true, .. } => "PASSED",
        SuiteReport { passed: false, .. } => "FAILED",
    };
    let flights = report.flights.iter().filter(|judged| judged.change != Change::NoFlight).count();
    format!("{word}: {}: {}", counted(flights as u64, "flight"), counts.join(", "))
}

/// Every flight as a case.
pub fn suite_cases(flights: &[Judged], may_diverge: bool) -> Vec<JunitCase> {
    let case = |judged: &Judged| {
        let words = format!(
            "{}; margin {} -> {}",
            ending(judged),
            margin(judged.before.as_ref()),
            margin(judged.now.as_ref())
        );
        let outcome = match (judged.fails(may_diverge), &judged.now) {
            (false, _) => JunitOutcome::Passed { said: format!("{}: {words}", judged.change.word()) },
            (true, Some(FlightResult { checked: Checked::Unverified, problem: Some(problem), .. })) => {
                JunitOutcome::Error { message: problem.clone() }
            }
            (true, _) => JunitOutcome::Failed { message: judged.change.word().to_owned(), details: words },
        };
        JunitCase { name: judged.name.clone(), outcome }
    };
    flights.iter().map(case).collect()
}

fn ending(judged: &Judged) -> String {
    let of = |outcome: &FlightResult| outcome.flown.as_ref().map(|flown| flown.ending.clone());
    let now = judged.now.as_ref();
    let problem = now.and_then(|now| now.problem.clone());
    let ending = now
        .and_then(of)
        .or_else(|| judged.before.as_ref().and_then(of).map(|before| format!("was {before}")));
    match (ending, problem) {
        (Some(ending), Some(problem)) => format!("{ending} ({problem})"),
        (Some(words), None) | (None, Some(words)) => words,
        (None, None) => "did not come down".to_owned(),
    }
}

fn margin(outcome: Option<&FlightResult>) -> String {
    let margin = outcome.and_then(|outcome| outcome.flown.as_ref()).and_then(Flown::margin);
    margin.map_or_else(|| "-".to_owned(), |margin| format!("{margin:.3}"))
}

/// How a directory of flights is held against a baseline.
#[derive(Debug, Args)]
#[group(id = "held")]
pub(super) struct Arguments {
    /// Hold the directory of logs (*.mcap) and campaigns, in subdirectories, too, against the outcomes that were
    /// accepted, a JSON file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["explain", "strict"])]
    baseline: Option<PathBuf>,
    /// Write the outcomes of this build as the new baseline; exit code 0 whatever changed. A log that cannot be verified
    /// is not accepted.
    #[arg(long, requires = "baseline")]
    accept: bool,
    /// Let this build decide differently from the record, as long as no flight gets worse.
    #[arg(long, requires = "baseline")]
    may_diverge: bool,
    /// A margin that changed by no more than this is the same (1 is from the middle of the limits to their edge).
    #[arg(long, value_name = "MARGIN", default_value_t = 0.02, requires = "baseline")]
    tolerance: f64,
    /// Flights flown at the same time; the answer does not depend on it [default: all processors].
    #[arg(long, value_name = "N", requires = "baseline")]
    jobs: Option<NonZeroUsize>,
    /// Keep every finished flight in this file, and continue from it if it exists.
    #[arg(long, value_name = "FILE", requires = "baseline")]
    state: Option<PathBuf>,
}

impl Arguments {
    pub(super) fn is_asked(&self) -> bool {
        self.baseline.is_some()
    }

    pub(super) fn run(&self, directory: &Path, kind: Printed, junit: Option<NewFile>) -> Result<Outcome> {
        let baseline_path = self.baseline.as_deref().context("--baseline is missing")?;
        ensure!(
            self.tolerance >= 0.0 && self.tolerance.is_finite(),
            "--tolerance {}: must be 0 or more",
            self.tolerance
        );
        let baseline = match Baseline::read(baseline_path) {
            Ok(baseline) => baseline,
            // The first baseline.
            Err(_) if self.accept && !baseline_path.exists() => Baseline::default(),
            Err(error) => return Err(error.into()),
        };
        let (flights, skipped) = find(directory)?;
        for Skipped { name, reason } in &skipped {
            say(&format!("left out: {name}: {reason}"));
        }
        let mut state = match &self.state {
            None => SuiteState::in_memory(),
            Some(path) => {
                SuiteState::open(path).with_context(|| format!("{}: cannot be used", path.display()))?
            }
        };
        let stop = stop_on_interrupt()?;
        let stopwatch = Stopwatch::start();
        let told = |done, of| stopwatch.show(done, of, "flights");
        let outcomes = in_pool(self.jobs, || fly_all(&flights, &mut state, &stop, &told))?
            .context("the state file cannot be written")?;
        let interrupted = stop.load(Ordering::Relaxed) && outcomes.len() < flights.len();
        let mut judged = judge(&outcomes, &baseline, self.tolerance);
        // Flights of the baseline that are lost are an answer, but not a new baseline.
        if !interrupted && (self.accept || judged.iter().all(|judged| judged.change == Change::NoFlight)) {
            some_flight(directory, &outcomes)?;
        }
        if interrupted {
            // What was not reached is not missing.
            let known = |judged: &Judged| !flights.iter().any(|found| found.name == judged.name);
            judged.retain(|judged| judged.change != Change::Missing || known(judged));
        }
        let passed = !interrupted && !judged.iter().any(|judged| judged.fails(self.may_diverge));
        if let Some(file) = junit {
            write_junit("suite", suite_cases(&judged, self.may_diverge), file)?;
        }
        let report = SuiteReport { passed, interrupted, flights: &judged };
        answer(|output| match kind {
            Printed::Text => print_suite(&report, output),
            Printed::Json => print_json(&report, output),
            Printed::Junit => print_junit("suite", suite_cases(&judged, self.may_diverge), output),
        })?;
        if self.accept && !interrupted {
            accepted(&outcomes)?;
            let copies = judged.iter().filter(|judged| judged.change == Change::Copy);
            let copies: Vec<String> = copies.map(|judged| judged.name.clone()).collect();
            let mut outcomes = outcomes;
            outcomes.retain(|name, _| !copies.contains(name));
            Baseline::of(outcomes).write(baseline_path)?;
            say(&format!("accepted: {}", baseline_path.display()));
            return Ok(Outcome::Given);
        }
        Ok(if interrupted { Outcome::NotAll } else { Outcome::Decided { yes: passed } })
    }
}

/// Refuses outcomes of which some were not verified: accepted, they would pass for ever.
fn accepted(outcomes: &BTreeMap<String, FlightResult>) -> Result<()> {
    let unverified = outcomes.iter().find(|(_, outcome)| outcome.checked == Checked::Unverified);
    if let Some((name, FlightResult { problem, .. })) = unverified {
        let why = problem.as_deref().unwrap_or("it was not verified");
        bail!("nothing is accepted: {name}: {why}; mend it or take it out of the directory");
    }
    Ok(())
}

/// Refuses a directory whose logs hold no flight.
fn some_flight(directory: &Path, outcomes: &BTreeMap<String, FlightResult>) -> Result<(), SuiteError> {
    if outcomes.values().any(|outcome| outcome.checked != Checked::NoFlight) {
        return Ok(());
    }
    let (name, first) = outcomes.first_key_value().map_or_else(Default::default, |(name, outcome)| {
        (name.clone(), outcome.problem.clone().unwrap_or_default())
    });
    Err(SuiteError::NoFlights { path: directory.to_owned(), name, why: first })
}

/// The logs of a directory.
pub(super) fn logs_of(directory: &Path) -> Result<Vec<PathBuf>> {
    let (flights, skipped) = find(directory)?;
    for Skipped { name, reason } in &skipped {
        say(&format!("left out: {name}: {reason}"));
    }
    Ok(flights.into_iter().filter(|found| found.number.is_none()).map(|found| found.path).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(checked: Checked, landed: bool, margin: f64) -> FlightResult {
        let flown = Flown { landed, ending: String::new(), margin: Some(format!("{margin:?}")) };
        FlightResult { flight: None, checked, flown: Some(flown), problem: None }
    }

    fn judged(before: FlightResult, now: FlightResult) -> Judged {
        let named = |outcome| BTreeMap::from([("a".to_owned(), outcome)]);
        judge(&named(now), &Baseline::of(named(before)), 0.02).remove(0)
    }

    #[test]
    fn every_change_has_its_name_and_the_bad_ones_fail() {
        use Checked::{Diverged, Identical, Unverified};
        let before = outcome(Identical, true, 0.5);
        // Whether it fails, and whether it does if the decisions may differ.
        for (now, expected, fails) in [
            (outcome(Identical, true, 0.51), Change::Same, [false, false]),
            (outcome(Identical, true, 0.6), Change::Better, [false, false]),
            (outcome(Identical, true, 0.4), Change::Worse, [true, true]),
            (outcome(Diverged, true, 0.51), Change::Diverged, [true, false]),
            (outcome(Diverged, true, 0.6), Change::Better, [true, false]),
            (outcome(Diverged, true, 0.4), Change::Worse, [true, true]),
            (outcome(Unverified, true, 0.6), Change::Lost, [true, true]),
            (outcome(Identical, false, -0.1), Change::NoLongerLands, [true, true]),
        ] {
            let judged = judged(before.clone(), now);
            assert_eq!((judged.change, [false, true].map(|may| judged.fails(may))), (expected, fails));
        }
        let crashed = outcome(Diverged, false, -2.0);
        assert_eq!(judged(crashed.clone(), outcome(Diverged, true, 0.1)).change, Change::NowLands);
        // What cannot be read did not land differently.
        for checked in [Unverified, Checked::NoFlight] {
            let gone = FlightResult { flight: None, checked, flown: None, problem: Some("empty".to_owned()) };
            for before in [&before, &crashed] {
                let judged = judged(before.clone(), gone.clone());
                assert_eq!((judged.change, judged.fails(true)), (Change::Lost, true), "{checked:?}");
            }
        }
        // A divergence that was accepted is no news.
        let same = judged(crashed.clone(), crashed);
        assert_eq!((same.change, same.fails(false)), (Change::Same, false));
    }

    #[test]
    fn flights_of_a_campaign_are_listed_by_their_number() {
        let flights =
            ["a#10", "a#9", "a.mcap"].map(|name| (name.to_owned(), outcome(Checked::Identical, true, 0.5)));
        let judged = judge(&BTreeMap::from(flights), &Baseline::default(), 0.0);
        let names: Vec<&str> = judged.iter().map(|judged| judged.name.as_str()).collect();
        assert_eq!(names, ["a#9", "a#10", "a.mcap"]);
    }

    #[test]
    fn a_file_without_a_flight_is_called_that_and_does_not_fail() {
        let none = FlightResult { flight: None, checked: Checked::NoFlight, flown: None, problem: None };
        let without = BTreeMap::from([("ground.mcap".to_owned(), none)]);
        let judged = judge(&without, &Baseline::default(), 0.02).remove(0);
        assert_eq!((judged.change, judged.fails(false)), (Change::NoFlight, false));
        assert_eq!(Baseline::of(without).flights, BTreeMap::new());
    }

    #[test]
    fn another_flight_under_the_name_of_one_is_new_and_that_one_is_missing() {
        let named = |flight: &str, landed| {
            let outcome = outcome(Checked::Identical, landed, 0.5);
            BTreeMap::from([("a".to_owned(), FlightResult { flight: Some(flight.to_owned()), ..outcome })])
        };
        let judged = judge(&named("landed", true), &Baseline::of(named("crashed", false)), 0.02);
        let mut changes: Vec<_> = judged.iter().map(|judged| judged.change.word()).collect();
        changes.sort_unstable();
        assert_eq!(changes, ["MISSING", "new"]);
        assert!(judged.iter().any(|judged| judged.fails(true)));
        let same = judge(&named("landed", true), &Baseline::of(named("landed", false)), 0.02);
        assert_eq!(same[0].change, Change::NowLands);
    }

    #[test]
    fn a_renamed_flight_is_the_same_and_a_copy_is_not_new() {
        let flight = |name: &str| {
            let outcome = outcome(Checked::Identical, true, 0.5);
            (name.to_owned(), FlightResult { flight: Some("content".to_owned()), ..outcome })
        };
        let changes = |now: &[&str]| {
            let now = now.iter().map(|name| flight(name)).collect();
            let judged = judge(&now, &Baseline::of(BTreeMap::from([flight("b")])), 0.02);
            assert!(!judged.iter().any(|judged| judged.fails(false)), "{judged:?}");
            judged.into_iter().map(|judged| (judged.name, judged.change.word())).collect::<Vec<_>>()
        };
        let told = |pairs: &[(&str, &'static str)]| {
            pairs.iter().map(|(name, word)| ((*name).to_owned(), *word)).collect::<Vec<_>>()
        };
        assert_eq!(changes(&["c"]), told(&[("c", "same")]));
        assert_eq!(changes(&["a", "b", "c"]), told(&[("a", "copy"), ("b", "same"), ("c", "copy")]));
        assert_eq!(changes(&["c", "d"]), told(&[("c", "same"), ("d", "copy")]));
    }

    /// Whether the baseline has it or not.
    #[test]
    fn a_log_that_cannot_be_verified_fails() {
        let named = |outcome| BTreeMap::from([("a".to_owned(), outcome)]);
        let unverified = named(outcome(Checked::Unverified, true, 0.5));
        for before in [BTreeMap::new(), unverified.clone()] {
            assert!(judge(&unverified, &Baseline::of(before), 0.02).remove(0).fails(true));
        }
        assert!(accepted(&unverified).is_err());
    }

    #[test]
    fn a_flight_that_only_one_of_them_has_is_named() {
        let flights =
            |name: &str| BTreeMap::from([(name.to_owned(), outcome(Checked::Identical, true, 0.5))]);
        let judged = judge(&flights("a"), &Baseline::of(flights("b")), 0.0);
        let changes: Vec<_> = judged.iter().map(|judged| (judged.name.as_str(), judged.change)).collect();
        assert_eq!(changes, [("a", Change::New), ("b", Change::Missing)]);
    }
}
