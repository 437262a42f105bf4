//! Compares two flights signal by signal.
//!
//! Every number of both logs becomes a signal, named as in [`table`](crate::table) (`pilot_tick.output.…`). The
//! second flight is shifted so that the chosen event of both flights coincides. It is then read at the times of the
//! first flight: linear between samples, whole numbers held. Measured solve times are not signals. Samples that only
//! one flight has are counted separately, because interpolation would hide a lost record.
//!
//! The log of a ground station has no ticks. It is compared with the vehicle's own log by the MAVLink messages that
//! both have, over the vehicle's time in them and while both recorded.

mod align;
mod difference;
mod heard;
mod samples;
mod series;
mod tolerance;

pub use align::{Align, Anchors};
pub use difference::SignalDifference;
pub use samples::Samples;
pub use series::{Flown, Series};
pub use tolerance::{Tolerance, ToleranceError, Tolerances};

use std::collections::BTreeMap;

use serde::Serialize;

use crate::info::VerdictFacts;
use crate::log::RecordingError;

/// Why flights cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A log cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A log has no event to align on.
    #[error("{name}: has no {event} to align on; --align time needs none")]
    NoAnchor {
        /// The log.
        name: String,
        /// What is missing.
        event: &'static str,
    },
    /// The tolerances are wrong.
    #[error(transparent)]
    Tolerance(#[from] ToleranceError),
}

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
    pub verdicts: (Option<VerdictFacts>, Option<VerdictFacts>),
    /// Signals that both flights have; those that exceed their tolerance first, then by name.
    pub signals: Vec<SignalDifference>,
    /// Signals that only the baseline has.
    pub missing: Vec<String>,
    /// Signals that only the other has.
    pub added: Vec<String>,
    /// Violations of the tolerances, in words.
    pub failures: Vec<String>,
}

impl Comparison {
    /// Number of signals that are equal in every bit.
    pub fn identical(&self) -> usize {
        self.signals.iter().filter(|signal| signal.max == 0.0 && !signal.not_comparable).count()
    }
}

/// Compares a flight with a baseline.
///
/// # Errors
/// There is no event to align on, or a tolerance names a signal that neither flight has.
pub fn compare(
    baseline: &Flown,
    other: &Flown,
    align: Align,
    tolerances: &Tolerances,
) -> Result<Comparison, CompareError> {
    let shift_s = align.shift_s(baseline, other)?;
    let over_the_air = baseline.only_one_has_ticks(other);
    let both_recorded_s =
        over_the_air.then(|| heard::common_s(&baseline.over_the_air, &other.over_the_air, shift_s)).flatten();
    let parts;
    let (a, b) = match both_recorded_s {
        Some([from_s, to_s]) => {
            parts = [
                heard::within(&baseline.over_the_air, [from_s, to_s]),
                heard::within(&other.over_the_air, [from_s - shift_s, to_s - shift_s]),
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
    let mut signals = Vec::new();
    for (name, ours) in a {
        if let Some(theirs) = b.get(name) {
            signals.push(SignalDifference::of(name, ours, theirs, shift_s, tolerances.of(name)));
        }
    }
    let mut failures = tolerances.record_failures([baseline, other]);
    failures.extend(samples_failures(&signals, tolerances));
    failures.extend(signals.iter().filter_map(SignalDifference::failure));
    signals.sort_by(|a, b| (a.passed, &a.signal).cmp(&(b.passed, &b.signal)));
    failures.extend(tolerances.count_failures(missing.len(), added.len()));
    if signals.is_empty() {
        // For example two logs with different topics. "No differences" would be misleading here.
        failures.push("the logs have no signal in common: nothing was compared".to_owned());
    }
    let verdicts = (baseline.verdict.clone(), other.verdict.clone());
    let landed = |verdict: &Option<VerdictFacts>| verdict.as_ref().map(|verdict| verdict.landed);
    if tolerances.verdict_must_agree() && landed(&verdicts.0) != landed(&verdicts.1) {
        let word = |landed: Option<bool>| match landed {
            Some(true) => "landed",
            Some(false) => "not landed",
            None => "no verdict",
        };
        let (then, now) = (word(landed(&verdicts.0)), word(landed(&verdicts.1)));
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
        failures,
    })
}

/// Samples missing or added beyond the tolerance: one line for each table, for the signal with the most of them.
fn samples_failures(signals: &[SignalDifference], tolerances: &Tolerances) -> Vec<String> {
    let mut worst: BTreeMap<(&str, bool), (usize, String)> = BTreeMap::new();
    for signal in signals {
        let (table, samples) = (signal.signal.split('.').next().unwrap_or_default(), signal.samples_of_both);
        let (missing, added) = tolerances.samples_of(&signal.signal);
        let all = samples.expected - samples.missing + samples.added;
        for (word, share, limit, count, of) in [
            ("missing", samples.missing_share(), missing, samples.missing, samples.expected),
            ("added", samples.added_share(), added, samples.added, all),
        ] {
            let known = worst.get(&(table, word == "added")).map_or(0, |(count, _)| *count);
            if share > limit && count > known {
                let words = format!(
                    "{table}: {count} of {of} samples are {word} (tolerated {} %)",
                    libm::round(1e6 * limit) / 1e4
                );
                worst.insert((table, word == "added"), (count, words));
            }
        }
    }
    worst.into_values().map(|(_, words)| words).collect()
}
