//! What answers have in common: columns, two verdicts beside each other. `cli` removes what steers
//! a terminal.

use protocol::log::v1::LimitResult;

use crate::log::Verdict;

/// `1 frame`, `2 frames`.
pub(crate) fn counted(count: u64, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// Loss of messages, as every command reports it.
pub(crate) fn messages_lost(count: u64) -> String {
    format!("{} lost", counted(count, "message"))
}

/// The most similar name.
pub(crate) fn nearest<'a>(given: &str, names: impl Iterator<Item = &'a String>) -> String {
    let likeness = |name: &str| strsim::jaro_winkler(given, name);
    let most = names.max_by(|a, b| likeness(a).total_cmp(&likeness(b)).then_with(|| b.cmp(a)));
    most.cloned().unwrap_or_default()
}

/// A cell that is wider does not push the others away. (A width of more than 16 bits cannot be
/// formatted.)
const WIDEST: usize = 200;

/// Rows as lines of columns, each as wide as its widest cell: a column begins at the left (`<`) or
/// ends at the right (`>`).
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

/// The name of a verdict.
pub(crate) fn word(verdict: Option<&Verdict>) -> &'static str {
    verdict.map_or("no verdict", |verdict| verdict.landing.word())
}

/// Where a value is that broke its limit: what gives way at it went no further.
pub(crate) fn beyond(limit: &LimitResult) -> &'static str {
    if (limit.minimum..=limit.maximum).contains(&limit.value) { "AT ITS LIMIT" } else { "OUTSIDE" }
}

/// Every limit that one of two verdicts has, the most different first: how far apart they are over
/// its range, and its name, both values and its ends.
pub(crate) fn limits_of_both(both: [Option<&Verdict>; 2]) -> Vec<(f64, [String; 4])> {
    let mut limits: Vec<&LimitResult> = Vec::new();
    for limit in both.into_iter().rev().flatten().flat_map(Verdict::of_the_legs) {
        if !limits.iter().any(|known| known.name == limit.name) {
            limits.push(limit);
        }
    }
    let row = |limit: &LimitResult| {
        let found = both.map(|verdict| verdict?.of_the_legs().find(|found| found.name == limit.name));
        let [first, second] = found.map(|found| {
            let Some(limit) = found else { return "-".to_owned() };
            let beyond = if limit.passed { "" } else { beyond(limit) };
            format!("{:.4} {} {beyond}", limit.value, limit.unit).trim_end().replace("  ", " ")
        });
        let range = limit.maximum - limit.minimum;
        let apart = match found {
            // The larger of it and of no number, which is 0 over 0.
            [Some(then), Some(now)] => ((then.value - now.value).abs() / range).max(0.0),
            // An event without a range is listed only if it happened; a value may be unknown.
            _ if range > 0.0 => 0.0,
            _ => f64::INFINITY,
        };
        (apart, [limit.name.clone(), first, second, format!("{:.4} to {:.4}", limit.minimum, limit.maximum)])
    };
    let mut rows: Vec<_> = limits.into_iter().map(row).collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    rows
}

/// Two verdicts beside each other, and their limits.
pub(crate) fn verdict_table(names: [&str; 2], both: [Option<&Verdict>; 2]) -> Vec<String> {
    let at = |verdict: &Verdict| format!(" at {}", verdict.contact());
    let [then, now] = both.map(|verdict| word(verdict).to_owned() + &verdict.map_or_else(String::new, at));
    let [first, second] = names.map(str::to_owned);
    let head = [String::new(), first, second, "limit".to_owned()];
    let verdict = ["verdict".to_owned(), then, now, String::new()];
    let limits = limits_of_both(both).into_iter().map(|(_, row)| row);
    columns(['<', '>', '>', '<'], [head, verdict].into_iter().chain(limits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_more_to_give_is_at_its_limit_and_not_outside() {
        let stroke = |value| LimitResult { value, maximum: 1.0, ..LimitResult::default() };
        assert_eq!([1.0, 1.1].map(|value| beyond(&stroke(value))), ["AT ITS LIMIT", "OUTSIDE"]);
    }
}
