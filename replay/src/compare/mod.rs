//! Compares two flights: every table that both have.
//!
//! Every number of both logs becomes a signal, named as in [`table`](crate::table)
//! (`computer_frame.output.…`). The second flight is shifted so that the ignition of both
//! coincides, if both have one. It is then read at the times of the first flight: linear between
//! samples, whole numbers held. Measured solve times are not signals. A signal with more samples in
//! one of the two differs, because interpolation would hide a lost record.
//!
//! Tables of words (events, limits) are compared row by row, without times.

mod difference;
mod missions;
mod print;
mod series;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Result;
pub use difference::SignalDifference;
pub(crate) use missions::compared;
pub use missions::{MissionComparison, SettingDifference};
use missions::{compare_missions, is_mission};
use protocol::program::Exit;
use serde::Serialize;
pub use series::{Align, Flown, Series};

use crate::cli::{give, warn_of_loss};
use crate::log::Verdict;
use crate::print::{counted, word};

/// One flight against another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    pub baseline: String,
    /// The other flight.
    pub other: String,
    /// The event on which the flights are aligned.
    pub align: Align,
    /// Offset added to the times of the other flight, s.
    pub shift_s: f64,
    /// The two verdicts.
    pub verdicts: (Option<Verdict>, Option<Verdict>),
    /// Signals that both flights have, by name.
    pub signals: Vec<SignalDifference>,
    /// Signals that only the baseline has.
    pub missing: Vec<String>,
    /// Signals that only the other has.
    pub added: Vec<String>,
    /// Rows of words that only one of the two has.
    pub words: Vec<WordsOfOne>,
    /// Why the second is not like the first, in words.
    pub failures: Vec<String>,
}

/// A row of words that only one of two logs has, or has more often.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WordsOfOne {
    pub table: String,
    pub row: String,
    /// Rows of the baseline.
    pub baseline: usize,
    /// Rows of the other.
    pub other: usize,
}

impl Comparison {
    /// Number of signals that are equal in every bit.
    pub fn identical(&self) -> usize {
        self.signals.iter().filter(|signal| signal.is_identical()).count()
    }

    /// Number of tables whose signals both flights have.
    pub fn tables(&self) -> usize {
        self.signals.iter().map(|signal| signal.signal.split('.').next()).collect::<BTreeSet<_>>().len()
    }
}

/// Compares a flight with a baseline.
pub fn compare(baseline: &Flown, other: &Flown) -> Comparison {
    let (align, shift_s) = Align::of(baseline, other);
    let (a, b) = (&baseline.signals, &other.signals);
    let missing: Vec<String> = a.keys().filter(|name| !b.contains_key(*name)).cloned().collect();
    let added: Vec<String> = b.keys().filter(|name| !a.contains_key(*name)).cloned().collect();
    let both = a.iter().filter_map(|(name, ours)| Some((name.as_str(), ours, b.get(name)?)));
    let signals: Vec<_> =
        both.map(|(name, ours, theirs)| SignalDifference::of(name, ours, theirs, shift_s)).collect();
    let mut failures = incomplete([baseline, other]);
    for (signals, what) in [(&missing, "missing"), (&added, "added")] {
        let failure = || format!("{} {what}", counted(signals.len() as u64, "signal"));
        failures.extend((!signals.is_empty()).then(failure));
    }
    if signals.is_empty() {
        // For example two logs with different topics. "No differences" would be misleading here.
        failures.push("the logs have no signal in common: nothing was compared".to_owned());
    }
    let verdicts = (baseline.verdict.clone(), other.verdict.clone());
    let (then, now) = (word(verdicts.0.as_ref()), word(verdicts.1.as_ref()));
    if then != now {
        failures.push(format!("the verdicts differ: {then} and {now}"));
    }
    Comparison {
        baseline: baseline.name.clone(),
        other: other.name.clone(),
        align,
        shift_s,
        verdicts,
        signals,
        missing,
        added,
        words: words_of_one(baseline, other),
        failures,
    }
}

/// Parts of the flights that were not compared because of damage or a missing end.
fn incomplete(flights: [&Flown; 2]) -> Vec<String> {
    let mut failures = Vec::new();
    for Flown { name, damage, cut, out_of_order, .. } in flights {
        if *out_of_order > 0 {
            failures.push(format!("{name}: {out_of_order} numbers are out of order and were not compared"));
        }
        let damage = damage.as_ref();
        failures.extend(
            damage.map(|damage| format!("{name} is damaged: {damage}; nothing after that was compared")),
        );
        failures.extend(cut.as_ref().map(|cut| format!("{name} is of an INCOMPLETE flight: it {cut}")));
    }
    failures.dedup();
    failures
}

/// The rows of words that only one log has, of the tables that both have.
fn words_of_one(baseline: &Flown, other: &Flown) -> Vec<WordsOfOne> {
    let mut found = Vec::new();
    for (table, ours) in &baseline.words {
        let Some(theirs) = other.words.get(table) else { continue };
        let rows: BTreeSet<&String> = ours.keys().chain(theirs.keys()).collect();
        found.extend(rows.into_iter().filter_map(|row| {
            let count = |of: &BTreeMap<String, usize>| of.get(row).copied().unwrap_or(0);
            let (baseline, other) = (count(ours), count(theirs));
            (baseline != other).then(|| WordsOfOne {
                table: table.clone(),
                row: row.clone(),
                baseline,
                other,
            })
        }));
    }
    found
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The flight to compare with, or a mission (built-in or a TOML file).
    baseline: PathBuf,
    /// The other flights, or missions.
    #[arg(required = true)]
    others: Vec<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        if is_mission(&self.baseline) {
            let others: Vec<&Path> = self.others.iter().map(PathBuf::as_path).collect();
            return give(&compare_missions(&self.baseline, &others)?, self.json);
        }
        let baseline = open(&self.baseline)?;
        let mut comparisons = Vec::new();
        for path in &self.others {
            comparisons.push(compare(&baseline, &open(path)?));
        }
        give(&comparisons, self.json)
    }
}

fn open(path: &Path) -> Result<Flown> {
    let flown = Flown::open(path)?;
    warn_of_loss(&flown.name, flown.damage.as_deref(), flown.cut.as_ref());
    Ok(flown)
}
