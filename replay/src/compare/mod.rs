//! Compares two flights: every table that both have.
//!
//! Every number of both logs becomes a signal, named as in [`table`](crate::table)
//! (`computer_frame.output.…`). The second flight is shifted so that the ignition of both
//! coincides, if both have one. It is then read at the times of the first flight: linear between
//! samples, whole numbers held. Planning latencies are not signals. A table with fewer samples in
//! one of the two, in the time that both cover, fails: interpolation would hide a lost record.
//!
//! Two folders of logs are compared as sets of flights ([`compare_sets`]).

mod difference;
mod print;
mod series;
mod sets;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
pub use difference::SignalDifference;
use protocol::program::Exit;
use serde::Serialize;
pub use series::{Align, Flown, Series};
pub(crate) use sets::flips_in_words;
pub use sets::{FlightSet, Flip, SetComparison, compare_sets};

use crate::cli::{give, warn_of_loss};
use crate::log::Verdict;
use crate::print::{counted, messages_lost, word};

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
    /// Why the second is not like the first, in words.
    pub failures: Vec<String>,
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
    failures.extend(lost_samples([a, b], shift_s));
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
        failures,
    }
}

/// Tables that have fewer samples in one flight, in the time that both cover: interpolation hides
/// them.
fn lost_samples([ours, theirs]: [&BTreeMap<String, Series>; 2], shift_s: f64) -> Vec<String> {
    /// Flights begin and end between two samples, and their restarts differ.
    const SLACK: usize = 2;
    const SLACK_SHARE: f64 = 0.01;
    let mut rows: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    for (name, ours) in ours {
        let Some(theirs) = theirs.get(name) else { continue };
        let ends = |series: &Series, shift_s: f64| {
            Some([series.times_s.first()? + shift_s, series.times_s.last()? + shift_s])
        };
        let (Some(first), Some(second)) = (ends(ours, 0.0), ends(theirs, shift_s)) else { continue };
        let span = [first[0].max(second[0]), first[1].min(second[1])];
        let count = |series: &Series, shift_s: f64| {
            let before = |time_s: f64| series.times_s.partition_point(|at_s| at_s + shift_s <= time_s);
            before(span[1]).saturating_sub(before(span[0]))
        };
        // The rows of a table: some columns are empty in some of them.
        let most = rows.entry(name.split('.').next().unwrap_or_default()).or_default();
        *most = [most[0].max(count(ours, 0.0)), most[1].max(count(theirs, shift_s))];
    }
    let lost = rows.into_iter().filter(|(_, [ours, theirs])| {
        ours.abs_diff(*theirs) > SLACK + (SLACK_SHARE * *ours.max(theirs) as f64) as usize
    });
    lost.map(|(table, [ours, theirs])| {
        format!("samples of {table} are missing: {ours} and {theirs} in the time that both cover")
    })
    .collect()
}

/// Parts of the flights that were not compared because of damage or a missing end.
fn incomplete(flights: [&Flown; 2]) -> Vec<String> {
    let mut failures = Vec::new();
    for Flown { name, damage, cut, messages_lost: lost, out_of_order, .. } in flights {
        if *out_of_order > 0 {
            failures.push(format!("{name}: {out_of_order} numbers are out of order and were not compared"));
        }
        let damage = damage.as_ref();
        failures.extend(
            damage.map(|damage| format!("{name} is damaged: {damage}; nothing after that was compared")),
        );
        failures.extend((*lost > 0).then(|| format!("{name}: {}", messages_lost(*lost))));
        failures.extend(cut.as_ref().map(|cut| format!("{name} is of an INCOMPLETE flight: it {cut}")));
    }
    failures.dedup();
    failures
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The flight to compare with, or a folder of logs.
    baseline: PathBuf,
    /// The other flights, or the other folder.
    #[arg(required = true)]
    others: Vec<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        if self.baseline.is_dir() {
            let [other] = self.others.as_slice() else { bail!("two folders are compared, not more") };
            ensure!(
                other.is_dir(),
                "{}: is no folder, and {} is one",
                other.display(),
                self.baseline.display()
            );
            return give(&compare_sets(&self.baseline, other)?, self.json);
        }
        let baseline = open(&self.baseline)?;
        let comparisons = self.others.iter().map(|path| Ok(compare(&baseline, &open(path)?)));
        give(&comparisons.collect::<Result<Vec<_>>>()?, self.json)
    }
}

fn open(path: &Path) -> Result<Flown> {
    let flown = Flown::open(path)?;
    warn_of_loss(&flown.name, flown.damage.as_deref(), flown.cut.as_ref());
    Ok(flown)
}
