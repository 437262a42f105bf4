//! What answers have in common: columns, two verdicts beside each other, JSON. `cli` removes what steers a terminal.

use std::io;
use std::io::Write;

use protocol::log::v1::LimitResult;
use serde::Serialize;

use crate::log::Verdict;

/// Writes any report as JSON.
///
/// # Errors
/// The output failed.
pub fn print_json(report: &impl Serialize, output: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *output, report)?;
    writeln!(output)
}

/// `1 frame`, `2 frames`.
pub(crate) fn counted(count: u64, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// The most similar name.
pub(crate) fn nearest<'a>(given: &str, names: impl Iterator<Item = &'a String>) -> String {
    let likeness = |name: &str| strsim::jaro_winkler(given, name);
    let most = names.max_by(|a, b| likeness(a).total_cmp(&likeness(b)).then_with(|| b.cmp(a)));
    most.cloned().unwrap_or_default()
}

/// A cell that is wider does not push the others away. (A width of more than 16 bits cannot be formatted.)
const WIDEST: usize = 200;

/// Rows as lines of columns, each as wide as its widest cell: a column begins at the left (`<`) or ends at the right (`>`).
pub(crate) fn columns<const N: usize>(
    sides: [char; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> Vec<String> {
    let rows: Vec<[String; N]> = rows.into_iter().collect();
    let widths: [usize; N] = std::array::from_fn(|place| {
        rows.iter().map(|row| row[place].chars().count()).max().unwrap_or(0).min(WIDEST)
    });
    let line = |row: &[String; N]| {
        let cells = row.iter().zip(widths).zip(sides).map(|((cell, width), side)| match side {
            '<' => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// Two verdicts beside each other, and every limit that one of them has.
pub(crate) fn verdict_table(names: [&str; 2], both: [Option<&Verdict>; 2]) -> Vec<String> {
    let words = both.map(|verdict| {
        verdict.map_or_else(
            || "no verdict".to_owned(),
            |verdict| format!("{} at {}", verdict.landing.word(), verdict.contact()),
        )
    });
    let mut limits: Vec<&LimitResult> = Vec::new();
    for limit in both.into_iter().rev().flatten().flat_map(Verdict::of_the_legs) {
        if !limits.iter().any(|known| known.name == limit.name) {
            limits.push(limit);
        }
    }
    let row = |limit: &LimitResult| {
        let [first, second] = both.map(|verdict| {
            let found =
                verdict.and_then(|verdict| verdict.of_the_legs().find(|found| found.name == limit.name));
            found.map_or_else(
                || "-".to_owned(),
                |LimitResult { value, unit, passed, .. }| {
                    format!("{value:.4} {unit}{}", if *passed { "" } else { " OUTSIDE" })
                        .trim_end()
                        .to_owned()
                },
            )
        });
        [limit.name.clone(), first, second, format!("{:.4} to {:.4}", limit.minimum, limit.maximum)]
    };
    let ([first, second], [then, now]) = (names.map(str::to_owned), words);
    let head = [String::new(), first, second, "limit".to_owned()];
    let verdict = ["verdict".to_owned(), then, now, String::new()];
    columns(['<', '>', '>', '<'], [head, verdict].into_iter().chain(limits.into_iter().map(row)))
}
