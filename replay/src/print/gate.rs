//! Prints a gate as a table for people, as JSON and as JUnit cases.

use std::io::{self, Write};

use serde::Serialize;

use super::junit::{JunitCase, JunitOutcome};
use super::{counted, shown};
use crate::gate::{Change, Checked, Flown, Judged, Outcome};

/// Most flights without news that the table lists.
const SAME_SHOWN: usize = 20;

/// A gate as JSON has it.
#[derive(Debug, Serialize)]
pub struct GateReport<'a> {
    /// No flight fails.
    pub passed: bool,
    pub interrupted: bool,
    pub flights: &'a [Judged],
}

/// Writes the table: the flights that changed, then those that did not.
///
/// # Errors
/// The output failed.
pub fn print_gate(report: &GateReport, output: &mut impl Write) -> io::Result<()> {
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
fn summary(report: &GateReport) -> String {
    let all = [
        Change::Same,
        Change::Better,
        Change::NowLands,
        Change::New,
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
        GateReport { interrupted: true, .. } => "INTERRUPTED",
        GateReport { passed: true, .. } => "PASSED",
        GateReport { passed: false, .. } => "FAILED",
    };
    let flights = report.flights.iter().filter(|judged| judged.change != Change::NoFlight).count();
    format!("{word}: {}: {}", counted(flights as u64, "flight"), counts.join(", "))
}

/// Every flight as a case.
pub fn gate_cases(flights: &[Judged], may_diverge: bool) -> Vec<JunitCase> {
    let case = |judged: &Judged| {
        let words = format!(
            "{}; margin {} -> {}",
            ending(judged),
            margin(judged.before.as_ref()),
            margin(judged.now.as_ref())
        );
        let outcome = match (judged.fails(may_diverge), &judged.now) {
            (false, _) => JunitOutcome::Passed { said: format!("{}: {words}", judged.change.word()) },
            (true, Some(Outcome { checked: Checked::Unverified, problem: Some(problem), .. })) => {
                JunitOutcome::Error { message: problem.clone() }
            }
            (true, _) => JunitOutcome::Failed { message: judged.change.word().to_owned(), details: words },
        };
        JunitCase { name: judged.name.clone(), outcome }
    };
    flights.iter().map(case).collect()
}

fn ending(judged: &Judged) -> String {
    let of = |outcome: &Outcome| outcome.flown.as_ref().map(|flown| flown.ending.clone());
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

fn margin(outcome: Option<&Outcome>) -> String {
    let margin = outcome.and_then(|outcome| outcome.flown.as_ref()).and_then(Flown::margin);
    margin.map_or_else(|| "-".to_owned(), |margin| format!("{margin:.3}"))
}
