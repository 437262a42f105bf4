//! Prints reports as text for people and as JSON for programs.
//!
//! Control characters are removed from the text of a log first, because a log may come from anywhere.

use std::io;
use std::io::Write;

use serde::Serialize;

use crate::log::{VerdictFacts, VerdictLimit};

/// Writes any report as JSON.
///
/// # Errors
/// The output failed.
pub fn print_json(report: &impl Serialize, output: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *output, report)?;
    writeln!(output)
}

/// Text from a log, without control characters.
pub(crate) fn shown(text: &str) -> String {
    protocol::text::printable(text.as_bytes())
}

/// `1 frame`, `2 frames`.
pub(crate) fn counted(count: u64, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// One limit in both verdicts.
pub(crate) struct LimitRow<'a> {
    pub(crate) limit: &'a VerdictLimit,
    /// Each verdict's value with its unit, marked if outside.
    pub(crate) values: [String; 2],
}

/// A verdict in short; `none` if there is none.
pub(crate) fn verdict_words(verdict: Option<&VerdictFacts>, none: &str) -> String {
    match verdict {
        None => none.to_owned(),
        Some(verdict) => format!("{} at {}", verdict.landing.word(), verdict.contact()),
    }
}

/// The limits of `named`, then those that only one verdict has, with the values of both. `shown` escapes text for the
/// output; `outside` marks a value outside its limit.
pub(crate) fn verdict_rows<'a>(
    named: Option<&'a VerdictFacts>,
    both: [Option<&'a VerdictFacts>; 2],
    shown: fn(&str) -> String,
    outside: &str,
) -> Vec<LimitRow<'a>> {
    let value = |verdict: Option<&VerdictFacts>, name: &str| {
        let found = verdict.and_then(|verdict| verdict.of_the_legs().find(|limit| limit.name == name));
        found.map_or_else(
            || "-".to_owned(),
            |found| {
                let mark = if found.passed { "" } else { outside };
                format!("{:.4} {}{mark}", found.value, shown(&found.unit))
            },
        )
    };
    let mut limits: Vec<&VerdictLimit> = Vec::new();
    for limit in named.into_iter().chain(both.into_iter().flatten()).flat_map(VerdictFacts::of_the_legs) {
        if !limits.iter().any(|known| known.name == limit.name) {
            limits.push(limit);
        }
    }
    limits
        .into_iter()
        .map(|limit| LimitRow { limit, values: both.map(|verdict| value(verdict, &limit.name)) })
        .collect()
}
