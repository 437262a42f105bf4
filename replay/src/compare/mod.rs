//! Compares two flights: every table that both have.
//!
//! Every number of both logs becomes a signal, named as in [`table`](crate::table) (`computer_frame.output.…`). The
//! second flight is shifted so that the ignition of both coincides, if both have one. It is then read at the times of the
//! first flight: linear between samples, whole numbers held. Measured solve times are not signals. A signal with more samples
//! in one of the two differs, because interpolation would hide a lost record.
//!
//! Tables of words (events, limits) are compared row by row, without times.
//!
//! The log of a ground station has no frames of the flight computer. It is compared with the vehicle's own log by the MAVLink
//! messages that both have, over the vehicle's time in them, while both recorded.

mod missions;
mod print;
mod series;
mod tolerance;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, ensure};
pub(crate) use missions::compared;
pub use missions::{MissionComparison, SettingDifference};
use missions::{compare_missions, is_mission};
use protocol::program::Exit;
use serde::Serialize;
pub use series::{Align, Flown, Series};
pub use tolerance::SignalDifference;
pub use tolerance::{Tolerance, Tolerances};

use crate::cli::{give, warn_of_loss};
use crate::log::Verdict;
use crate::print::word;

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
    /// If one log is a ground station's: from when to when both recorded, vehicle time of the baseline, s. Only that is
    /// compared.
    pub both_recorded_s: Option<[f64; 2]>,
    /// The two verdicts.
    pub verdicts: (Option<Verdict>, Option<Verdict>),
    /// Signals that both flights have; those that exceed their tolerance first, then by name.
    pub signals: Vec<SignalDifference>,
    /// Signals that only the baseline has.
    pub missing: Vec<String>,
    /// Signals that only the other has.
    pub added: Vec<String>,
    /// Rows of words that only one of the two has.
    pub words: Vec<WordsOfOne>,
    /// Violations of the tolerances, in words.
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
///
/// # Errors
/// A tolerance names a signal that neither flight has.
pub fn compare(baseline: &Flown, other: &Flown, tolerances: &Tolerances) -> Result<Comparison> {
    let (align, shift_s) = Align::of(baseline, other);
    let over_the_air = baseline.only_one_has_frames(other);
    let both_recorded_s = over_the_air
        .then(|| series::common_s(&baseline.over_the_air, &other.over_the_air, shift_s))
        .flatten();
    let parts;
    let (a, b) = match both_recorded_s {
        Some([from_s, to_s]) => {
            parts = [
                series::within(&baseline.over_the_air, [from_s, to_s]),
                series::within(&other.over_the_air, [from_s - shift_s, to_s - shift_s]),
            ];
            (&parts[0], &parts[1])
        }
        None if over_the_air => (&baseline.over_the_air, &other.over_the_air),
        None => (&baseline.signals, &other.signals),
    };
    let (ours, theirs): (Vec<String>, Vec<String>) =
        (a.keys().cloned().collect(), b.keys().cloned().collect());
    tolerances.check_names(&ours.iter().chain(&theirs))?;
    let missing: Vec<String> = ours.iter().filter(|name| !b.contains_key(*name)).cloned().collect();
    let added: Vec<String> = theirs.iter().filter(|name| !a.contains_key(*name)).cloned().collect();
    let both = a.iter().filter_map(|(name, ours)| Some((name.as_str(), ours, b.get(name)?)));
    let of = |(name, ours, theirs)| SignalDifference::of(name, ours, theirs, shift_s, tolerances.of(name));
    let mut signals: Vec<_> = both.map(of).collect();
    let mut failures = tolerances.record_failures([baseline, other]);
    failures.extend(signals.iter().filter_map(SignalDifference::failure));
    signals.sort_by(|a, b| (a.passed, &a.signal).cmp(&(b.passed, &b.signal)));
    failures.extend(tolerances.count_failures(missing.len(), added.len()));
    if signals.is_empty() {
        // For example two logs with different topics. "No differences" would be misleading here.
        failures.push("the logs have no signal in common: nothing was compared".to_owned());
    }
    let verdicts = (baseline.verdict.clone(), other.verdict.clone());
    let (then, now) = (word(verdicts.0.as_ref()), word(verdicts.1.as_ref()));
    if tolerances.verdict_must_agree() && then != now {
        failures.push(format!("the verdicts differ: {then} and {now}"));
    }
    Ok(Comparison {
        baseline: baseline.name.clone(),
        other: other.name.clone(),
        align,
        shift_s,
        both_recorded_s,
        verdicts,
        signals,
        missing,
        added,
        words: words_of_one(baseline, other),
        failures,
    })
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
    /// Tolerances, a TOML file.
    ///
    /// [signals."NAME"] with rms and max in the signal's own unit; a * at the end of NAME matches any rest. Before
    /// that: `verdict = false` lets the verdicts differ; `missing = N` and `added = N` allow this many signals that
    /// only one flight has; `damaged = true` allows logs that are damaged or end before their flight did. Anything left
    /// out is not tolerated.
    #[arg(long, value_name = "FILE")]
    tolerances: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        if is_mission(&self.baseline) {
            return self.missions();
        }
        let tolerances = self.tolerances.as_deref().map(read).transpose()?.unwrap_or_default();
        let baseline = open(&self.baseline)?;
        let mut comparisons = Vec::new();
        for path in &self.others {
            let other = open(path)?;
            comparisons.push(compare(&baseline, &other, &tolerances)?);
        }
        give(&comparisons, self.json)
    }

    fn missions(&self) -> Result<Exit> {
        ensure!(self.tolerances.is_none(), "missions are compared without tolerances");
        let others: Vec<&Path> = self.others.iter().map(PathBuf::as_path).collect();
        give(&compare_missions(&self.baseline, &others)?, self.json)
    }
}

fn open(path: &Path) -> Result<Flown> {
    let flown = Flown::open(path)?;
    warn_of_loss(&flown.name, flown.damage.as_deref(), flown.cut.as_ref());
    Ok(flown)
}

fn read(path: &Path) -> Result<Tolerances> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    Tolerances::from_toml(&text, &name)
}
