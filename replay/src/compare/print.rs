//! A comparison for people.

use std::io::{self, Write};

use super::{Align, Comparison, WordsOfOne};
use crate::print::{LimitRow, counted, shown, verdict_rows, verdict_words};

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

/// The answer in one sentence.
fn sentence(comparison: &Comparison) -> String {
    let Comparison { baseline, other, signals, failures, .. } = comparison;
    let identical = comparison.identical();
    let tables = counted(comparison.tables() as u64, "table");
    let differing = signals.len() - identical;
    let found = match failures.split_first() {
        Some((first, [])) => format!("is NOT within tolerance of {baseline}: {first}"),
        Some((first, more)) => {
            format!("is NOT within tolerance of {baseline}: {first}; and {} more below", more.len())
        }
        None if differing == 0 => {
            format!(
                "is within tolerance of {baseline}: all {} of {tables} are identical",
                counted(signals.len() as u64, "signal")
            )
        }
        None => format!(
            "is within tolerance of {baseline}: {differing} of {} of {tables} differ",
            counted(signals.len() as u64, "signal")
        ),
    };
    format!("{other} {found}.")
}

fn print_one(comparison: &Comparison, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}\n", shown(&sentence(comparison)))?;
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
    print_words(comparison, output)?;
    if comparison.failures.len() < 2 {
        return Ok(());
    }
    writeln!(output, "**NOT within tolerance:**\n")?;
    for failure in &comparison.failures {
        writeln!(output, "- {}", shown(failure))?;
    }
    writeln!(output)
}

/// The rows of words that one of the two lacks.
fn print_words(comparison: &Comparison, output: &mut impl Write) -> io::Result<()> {
    let words = &comparison.words;
    if words.is_empty() {
        return Ok(());
    }
    writeln!(output, "| row of words | first | second |\n|---|---:|---:|")?;
    for WordsOfOne { table, row, baseline, other } in words.iter().take(NAMES_SHOWN) {
        writeln!(output, "| {table}: {} | {baseline} | {other} |", cell(row))?;
    }
    if words.len() > NAMES_SHOWN {
        writeln!(output, "\nand {} more that differ", words.len() - NAMES_SHOWN)?;
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
