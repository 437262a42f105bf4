//! Prints a re-flown flight for people.

use std::io::{self, Write};

use super::verdicts::{self, LimitRow};
use super::{counted, shown};
use crate::info::VerdictFacts;
use crate::refly::{Law, Reached, ReflyReport};

/// Writes the result of flying a flight again.
///
/// # Errors
/// The output failed.
pub fn print_refly(report: &ReflyReport, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: {}", shown(&report.file), report.kind)?;
    let start = &report.start;
    writeln!(
        output,
        "from tick {} (T+{:.3} s, {}, recorded {}): x {:.3} m, altitude {:.3} m, thrust {:.4} of nominal",
        start.tick,
        start.time_s,
        start.phase,
        match start.from {
            crate::refly::From::Truth => "truth",
            crate::refly::From::Estimate => "estimate",
        },
        start.x_m,
        start.z_m,
        report.thrust_scale
    )?;
    for (what, settings) in [("with", &report.settings), ("plant alone with", &report.plant_settings)] {
        if !settings.is_empty() {
            writeln!(output, "{what} {}", shown(&settings.join(" ")))?;
        }
    }
    for (what, faults) in
        [("with the fault", &report.faults.with), ("without the fault", &report.faults.without)]
    {
        if !faults.is_empty() {
            writeln!(output, "{what} {}, from the beginning of the flight", shown(&faults.join(" ")))?;
        }
    }
    if let Some(seed) = report.seed {
        writeln!(output, "plant drawn with seed {seed} instead of the recorded one")?;
    }
    let Reached { frames, identical, first_different } = report.reached;
    writeln!(
        output,
        "flown again from its start up to there: {identical} of {frames} recorded frames identical"
    )?;
    if let Some(frame) = first_different {
        writeln!(
            output,
            "NOT AS RECORDED from frame {frame} on: this build flies differently, and the result continues from its own flight"
        )?;
    }
    match report.law {
        Law::AsRecorded => {}
        law => writeln!(output, "with the landing burn flown by {}", law.name())?,
    }
    print_verdicts(report.recorded.as_ref(), report.reflown.as_ref(), output)?;
    let answer = match report.verdict_changed {
        Some(true) => "the verdict CHANGES",
        Some(false) => "the verdict does not change",
        None => "the log has no verdict to compare with",
    };
    let margin = report.margin.map_or_else(|| "no contact".to_owned(), |margin| format!("{margin:.3}"));
    writeln!(output, "{answer}; margin to the nearest limit {margin}")?;
    writeln!(
        output,
        "{}; of {} recorded too, {} with the same gimbal command bit for bit; largest difference {:.3e} rad",
        counted(report.ticks as u64, "tick"),
        report.commands_recorded,
        report.commands_identical,
        report.gimbal_difference_max_rad
    )
}

/// Two verdicts, limit by limit.
pub(super) fn print_verdicts(
    recorded: Option<&VerdictFacts>,
    now: Option<&VerdictFacts>,
    output: &mut impl Write,
) -> io::Result<()> {
    let words = |verdict| verdicts::words(verdict, "no verdict");
    writeln!(output, "{:<14} {:>22} {:>22}", "", "recorded", "flown again")?;
    writeln!(output, "{:<14} {:>22} {:>22}", "verdict", words(recorded), words(now))?;
    for LimitRow { limit, values: [then, now] } in
        verdicts::rows(now.or(recorded), [recorded, now], shown, " OUTSIDE")
    {
        writeln!(
            output,
            "{:<14} {then:>22} {now:>22}   limit {:.4} to {:.4}",
            shown(&limit.name),
            limit.minimum,
            limit.maximum
        )?;
    }
    Ok(())
}
