//! Prints sweeps and bisections as text and as a table.

use std::io::{self, Write};

use super::{counted, shown};
use crate::sweep::{BisectReport, FlightOutcome, Flip, PointOutcome, RefusedValue, SweepReport};

/// Writes the best points of a sweep as text.
///
/// # Errors
/// The output failed.
pub fn print_sweep(report: &SweepReport, top: usize, output: &mut impl Write) -> io::Result<()> {
    let flights = report.flights.len();
    writeln!(
        output,
        "{}: {} on {}, ranked by the worst flight's margin",
        report.kind,
        counted(report.points.len() as u64, "point"),
        counted(flights as u64, "flight")
    )?;
    for name in &report.not_reproduced {
        not_reproduced(name, output)?;
    }
    writeln!(output, "{:>4} {:>9} {:>9}  settings; worst flight", "rank", "margin", "landed")?;
    for (rank, point) in report.points.iter().enumerate().take(top) {
        let PointOutcome { settings, landed, worst_flight, .. } = point;
        writeln!(
            output,
            "{:>4} {:>9} {:>9}  {}; {}",
            rank + 1,
            margin(point.worst_margin),
            format!("{landed}/{flights}"),
            shown(&settings.join(" ")),
            shown(worst_flight)
        )?;
    }
    if report.points.len() > top {
        writeln!(output, "and {} more; --top shows more, --csv all", report.points.len() - top)?;
    }
    Ok(())
}

/// Writes every point of a sweep on every flight as CSV, the best point first.
///
/// # Errors
/// The output failed.
pub fn print_sweep_csv(report: &SweepReport, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "rank,point,settings,flight,landed,margin,worst_margin")?;
    for (rank, point) in report.points.iter().enumerate() {
        for (name, flight) in report.flights.iter().zip(&point.flights) {
            let number = |margin: Option<f64>| margin.map(|margin| format!("{margin:?}")).unwrap_or_default();
            writeln!(
                output,
                "{},{},{},{},{},{},{}",
                rank + 1,
                point.point,
                quoted(&point.settings.join(" ")),
                quoted(name),
                flight.landed,
                number(flight.margin),
                number(point.worst_margin)
            )?;
        }
    }
    Ok(())
}

/// Writes a bisection as text.
///
/// # Errors
/// The output failed.
pub fn print_bisect(report: &BisectReport, output: &mut impl Write) -> io::Result<()> {
    let who = if report.plant_alone { " (of the plant alone)" } else { "" };
    writeln!(output, "{}: {}", shown(&report.file), report.kind)?;
    if !report.reproduced {
        not_reproduced(&report.file, output)?;
    }
    if report.interrupted {
        let flown = counted(report.flown as u64, "flight");
        writeln!(output, "INTERRUPTED after {flown}: this is what was found until then")?;
    }
    if let Some(RefusedValue { value, reason }) = report.refused.first() {
        let count = counted(report.refused.len() as u64, "value");
        writeln!(output, "{count} cannot be flown and left out; the first is {value}: {}", shown(reason))?;
    }
    writeln!(
        output,
        "{}{who} = {}: {}, margin {}",
        shown(&report.path),
        report.value,
        word(report.outcome),
        margin(report.outcome.margin)
    )?;
    for (side, flip, step) in
        [("below", &report.below, report.steps.0), ("above", &report.above, report.steps.1)]
    {
        match flip {
            None => writeln!(output, "{side}: no change of the verdict in steps of {step:.4e}")?,
            Some(Flip { same_at, other_at, change, outcome }) => {
                let (other_at, same_at) = told_apart(*other_at, *same_at);
                writeln!(
                    output,
                    "{side}: {} from {other_at} on ({change:+.6e}), still {} at {same_at}",
                    word(*outcome),
                    word(report.outcome)
                )?;
            }
        }
    }
    match report.smallest() {
        None => writeln!(output, "no change within the range changes the verdict; {} flown", report.flown),
        Some(flip) => writeln!(
            output,
            "the smallest change that changes the verdict: {:+.6e}, to {}; {} flown",
            flip.change,
            told_apart(flip.other_at, flip.same_at).0,
            report.flown
        ),
    }
}

fn not_reproduced(name: &str, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: with nothing changed this build does not fly it as recorded", shown(name))
}

/// Two numbers with just enough decimals to differ.
fn told_apart(a: f64, b: f64) -> (String, String) {
    const DECIMALS: std::ops::RangeInclusive<usize> = 9..=16;
    let rounded = |decimals: usize| (format!("{a:.decimals$}"), format!("{b:.decimals$}"));
    // The shortest exact text of a number is unique.
    DECIMALS.map(rounded).find(|(a, b)| a != b).unwrap_or_else(|| (format!("{a:?}"), format!("{b:?}")))
}

fn word(outcome: FlightOutcome) -> &'static str {
    if outcome.landed { "LANDED" } else { "NOT LANDED" }
}

fn margin(margin: Option<f64>) -> String {
    margin.map_or_else(|| "not down".to_owned(), |margin| format!("{margin:.4}"))
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_numbers_print_differently() {
        let apart = |a: f64, b: f64| told_apart(a, b);
        assert_eq!(apart(0.95, 0.96), ("0.950000000".to_owned(), "0.960000000".to_owned()));
        assert_eq!(
            apart(0.95, 0.950_000_000_000_3),
            ("0.9500000000000".to_owned(), "0.9500000000003".to_owned())
        );
        for number in [0.95, 1e-30, 1e30, -7.0, f64::MIN_POSITIVE] {
            let (a, b) = apart(number, f64::from_bits(number.to_bits() + 1));
            assert_ne!(a, b);
        }
    }
}
