//! Compares two flights signal by signal.
//!
//! Every number of both logs becomes a signal, named as in [`table`](crate::table) (`computer_frame.output.…`). The
//! second flight is shifted so that the chosen event of both flights coincides. It is then read at the times of the
//! first flight: linear between samples, whole numbers held. Measured solve times are not signals. Samples that only
//! one flight has are counted separately, because interpolation would hide a lost record.
//!
//! The log of a ground station has no ticks. It is compared with the vehicle's own log by the MAVLink messages that
//! both have, over the vehicle's time in them and while both recorded.

mod series;
mod tolerance;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use serde::Serialize;
pub use series::Samples;
pub use series::{Align, Anchors};
pub use series::{Flown, Series};
pub use tolerance::SignalDifference;
pub use tolerance::{Tolerance, ToleranceError, Tolerances};

use crate::cli::{Outcome, answer, warn_of_cut, warn_of_damage};
use crate::log::RecordingError;
use crate::log::VerdictFacts;
use crate::print::{
    JunitCase, JunitOutcome, LimitRow, counted, print_json, print_junit, shown, verdict_rows, verdict_words,
};

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

/// Most signals listed that differ within their tolerance or have no tolerance.
const SIGNALS_SHOWN: usize = 60;
/// Most names listed of added and missing signals.
const NAMES_SHOWN: usize = 20;

/// Writes comparisons as Markdown.
///
/// # Errors
/// The output failed.
pub fn print_compare(comparisons: &[Comparison], output: &mut impl Write) -> io::Result<()> {
    for comparison in comparisons {
        print_one(comparison, output)?;
    }
    Ok(())
}

fn print_one(comparison: &Comparison, output: &mut impl Write) -> io::Result<()> {
    let (a, b) = (cell(&comparison.baseline), cell(&comparison.other));
    writeln!(output, "# {b} against {a}\n")?;
    let aligned = match comparison.align {
        Align::Ignition => "ignition",
        Align::Touchdown => "touchdown",
        Align::Time => "vehicle time",
    };
    writeln!(output, "Aligned on {aligned}: {:+.6} s added to the second's times.\n", comparison.shift_s)?;
    if let Some([from_s, to_s]) = comparison.both_recorded_s {
        writeln!(output, "Compared while both recorded: {from_s:.3} to {to_s:.3} s since power-up.\n")?;
    }
    print_verdicts(comparison, output)?;
    let identical = comparison.identical();
    writeln!(
        output,
        "{} of both flights, {identical} of them identical; {} missing, {} added.\n",
        counted(comparison.signals.len() as u64, "signal"),
        comparison.missing.len(),
        comparison.added.len()
    )?;
    print_signals(comparison, output)?;
    for (what, names) in [("Missing", &comparison.missing), ("Added", &comparison.added)] {
        if !names.is_empty() {
            let listed: Vec<String> = names.iter().take(NAMES_SHOWN).map(|name| cell(name)).collect();
            let more = names.len().saturating_sub(NAMES_SHOWN);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            writeln!(output, "{what}: {}{more}.\n", listed.join(", "))?;
        }
    }
    if comparison.failures.is_empty() {
        return writeln!(output, "**Within tolerance.**\n");
    }
    writeln!(output, "**NOT within tolerance:**\n")?;
    for failure in &comparison.failures {
        writeln!(output, "- {}", shown(failure))?;
    }
    writeln!(output)
}

fn print_verdicts(comparison: &Comparison, output: &mut impl Write) -> io::Result<()> {
    let (a, b) = (comparison.verdicts.0.as_ref(), comparison.verdicts.1.as_ref());
    let words = |verdict| verdict_words(verdict, "none");
    writeln!(output, "| | first | second | limit |\n|---|---|---|---|")?;
    writeln!(output, "| verdict | {} | {} | |", words(a), words(b))?;
    for LimitRow { limit, values: [first, second] } in verdict_rows(a.or(b), [a, b], cell, " **outside**") {
        let name = cell(&limit.name);
        writeln!(output, "| {name} | {first} | {second} | {:.4} to {:.4} |", limit.minimum, limit.maximum)?;
    }
    writeln!(output)
}

fn print_signals(comparison: &Comparison, output: &mut impl Write) -> io::Result<()> {
    let differing: Vec<_> = comparison
        .signals
        .iter()
        .filter(|signal| signal.max > 0.0 || signal.not_comparable || !signal.passed)
        .collect();
    if differing.is_empty() {
        return Ok(());
    }
    writeln!(output, "| signal | samples | rms | max | at s | tolerance |\n|---|---:|---:|---:|---:|---|")?;
    let failed = differing.iter().filter(|signal| !signal.passed).count();
    for signal in differing.iter().take(SIGNALS_SHOWN.max(failed)) {
        let tolerance = match (signal.tolerance, signal.passed) {
            (None, _) => String::new(),
            (Some(_), true) => "within".to_owned(),
            (Some(_), false) => "**EXCEEDED**".to_owned(),
        };
        let at = signal.max_at_s.map(|at_s| format!("{at_s:.3}")).unwrap_or_default();
        writeln!(
            output,
            "| {} | {} | {:.4e} | {:.4e} | {at} | {tolerance} |",
            cell(&signal.signal),
            signal.samples,
            signal.rms,
            signal.max
        )?;
    }
    if differing.len() > SIGNALS_SHOWN.max(failed) {
        writeln!(output, "\nand {} more that differ", differing.len() - SIGNALS_SHOWN.max(failed))?;
    }
    writeln!(output)
}

/// Escapes text for a table cell.
fn cell(text: &str) -> String {
    shown(text).replace('|', "\\|")
}

/// Comparisons as test cases: one for the verdict and the counts, and one for each signal with a tolerance.
pub fn compare_cases(comparisons: &[Comparison]) -> Vec<JunitCase> {
    let mut cases = Vec::new();
    for comparison in comparisons {
        let flights = format!("{} against {}", shown(&comparison.other), shown(&comparison.baseline));
        let mut of_signals = Vec::new();
        for signal in comparison.signals.iter().filter(|signal| signal.tolerance.is_some()) {
            let message = comparison
                .failures
                .iter()
                .find(|failure| failure.starts_with(&format!("{}: ", signal.signal)))
                .cloned()
                .unwrap_or_default();
            of_signals.push(message.clone());
            let outcome = if signal.passed {
                JunitOutcome::Passed { said: String::new() }
            } else {
                JunitOutcome::Failed { details: message.clone(), message }
            };
            cases.push(JunitCase { name: format!("{flights}: {}", signal.signal), outcome });
        }
        let others: Vec<String> =
            comparison.failures.iter().filter(|failure| !of_signals.contains(failure)).cloned().collect();
        let outcome = if others.is_empty() {
            JunitOutcome::Passed { said: String::new() }
        } else {
            JunitOutcome::Failed { message: others.join("; "), details: others.join("\n") }
        };
        cases.push(JunitCase { name: format!("{flights}: verdict and signals"), outcome });
    }
    cases
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The flight to compare with.
    baseline: PathBuf,
    /// The other flights.
    #[arg(required = true)]
    others: Vec<PathBuf>,
    /// The event on which the flights are aligned [default: ignition if both flights have one, else vehicle time].
    #[arg(long, value_enum)]
    align: Option<AlignOn>,
    /// Tolerances, a TOML file.
    ///
    /// [signals."NAME"] with rms and max in the signal's own unit; a * at the end of NAME matches any rest. Before
    /// that: `verdict = false` lets the verdicts differ; `missing = N` and `added = N` allow this many signals that
    /// only one flight has; `samples_missing = SHARE` and `samples_added = SHARE` allow this share of each signal's
    /// samples (also possible for one signal, after its max); `damaged = true` allows logs that are damaged or end
    /// before their flight did. Anything left out is not tolerated.
    #[arg(long, value_name = "FILE")]
    tolerances: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long, conflicts_with = "junit")]
    json: bool,
    /// Answer in JUnit XML.
    #[arg(long)]
    junit: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AlignOn {
    /// Ignition of the landing motor.
    Ignition,
    /// Touchdown.
    Touchdown,
    /// Vehicle time itself.
    Time,
}

impl Args {
    pub(crate) fn run(self) -> Result<Outcome> {
        let tolerances = self.tolerances.as_deref().map(read).transpose()?.unwrap_or_default();
        let baseline = open(&self.baseline)?;
        let mut comparisons = Vec::new();
        for path in &self.others {
            let other = open(path)?;
            let align = match self.align {
                None => Align::best_for(&baseline, &other),
                Some(AlignOn::Ignition) => Align::Ignition,
                Some(AlignOn::Touchdown) => Align::Touchdown,
                Some(AlignOn::Time) => Align::Time,
            };
            comparisons.push(compare(&baseline, &other, align, &tolerances)?);
        }
        answer(|output| {
            if self.json {
                print_json(&comparisons, output)
            } else if self.junit {
                print_junit("compare", compare_cases(&comparisons), output)
            } else {
                print_compare(&comparisons, output)
            }
        })?;
        let within = |comparison: &Comparison| comparison.failures.is_empty();
        Ok(Outcome::Decided { yes: comparisons.iter().all(within) })
    }
}

fn open(path: &Path) -> Result<Flown> {
    let flown = Flown::open(path)?;
    warn_of_damage(&flown.name, flown.damage.as_deref());
    warn_of_cut(&flown.name, flown.cut.as_ref());
    Ok(flown)
}

fn read(path: &Path) -> Result<Tolerances> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    Ok(Tolerances::from_toml(&text, &name)?)
}
