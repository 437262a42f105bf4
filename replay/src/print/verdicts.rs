//! Prints two verdicts side by side, limit by limit.

use crate::info::{VerdictFacts, VerdictLimit};

/// One limit in both verdicts.
pub(super) struct LimitRow<'a> {
    pub(super) limit: &'a VerdictLimit,
    /// Each verdict's value with its unit, marked if outside.
    pub(super) values: [String; 2],
}

/// A verdict in short; `none` if there is none.
pub(super) fn words(verdict: Option<&VerdictFacts>, none: &str) -> String {
    match verdict {
        None => none.to_owned(),
        Some(verdict) if verdict.landed => format!("LANDED at {}", verdict.contact()),
        Some(verdict) => format!("NOT LANDED at {}", verdict.contact()),
    }
}

/// The limits of `named`, then those that only one verdict has, with the values of both. `shown` escapes text for the
/// output; `outside` marks a value outside its limit.
pub(super) fn rows<'a>(
    named: Option<&'a VerdictFacts>,
    both: [Option<&'a VerdictFacts>; 2],
    shown: fn(&str) -> String,
    outside: &str,
) -> Vec<LimitRow<'a>> {
    let value = |verdict: Option<&VerdictFacts>, name: &str| {
        let found = verdict.and_then(|verdict| verdict.limits.iter().find(|limit| limit.name == name));
        found.map_or_else(
            || "-".to_owned(),
            |found| {
                let mark = if found.passed { "" } else { outside };
                format!("{:.4} {}{mark}", found.value, shown(&found.unit))
            },
        )
    };
    let mut limits: Vec<&VerdictLimit> = Vec::new();
    for limit in named.into_iter().chain(both.into_iter().flatten()).flat_map(|verdict| &verdict.limits) {
        if !limits.iter().any(|known| known.name == limit.name) {
            limits.push(limit);
        }
    }
    limits
        .into_iter()
        .map(|limit| LimitRow { limit, values: both.map(|verdict| value(verdict, &limit.name)) })
        .collect()
}
