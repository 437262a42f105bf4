//! Prints a verification for people.

use std::io::{self, Write};

use super::{JunitCase, JunitOutcome, counted, shown};
use crate::verify::{
    Consequence, Divergence, FieldDifference, FramesReport, Growth, GrowthStep, Verification, VerifyReport,
};

/// Most fields of the first diverged tick that are shown.
const FIELDS_SHOWN: usize = 5;

/// Writes a verification as text.
///
/// # Errors
/// The output failed.
pub fn print_verify(report: &VerifyReport, output: &mut impl Write) -> io::Result<()> {
    let name = name_of(report);
    let VerifyReport { ticks_identical, ticks_compared, ticks_recorded, .. } = report;
    match report.outcome {
        Verification::Identical => {
            writeln!(output, "{name}: {ticks_identical} of {ticks_compared} ticks identical")?;
        }
        Verification::IdenticalReadablePart => {
            let of = if report.damage.is_some() { " of the readable part" } else { "" };
            let what_is_missing = what_is_missing(report);
            writeln!(
                output,
                "{name}: {ticks_identical} of {ticks_compared} ticks identical{of}{what_is_missing}"
            )?;
        }
        Verification::Diverged if report.ticks_different == 0 => {
            writeln!(
                output,
                "{name}: DIVERGED, though {ticks_identical} of {ticks_compared} ticks are identical"
            )?;
        }
        Verification::Diverged => {
            let VerifyReport { ticks_different, fields_different, .. } = report;
            let fields = counted(*fields_different, "field");
            writeln!(
                output,
                "{name}: DIVERGED: {ticks_different} of {ticks_compared} ticks differ, in {fields}"
            )?;
        }
        Verification::NotReplayable if *ticks_compared == 0 => {
            let reason = report.obstacle.as_ref().map(|obstacle| shown(&obstacle.to_string()));
            writeln!(output, "{name}: nothing was compared: {}", reason.unwrap_or_default())?;
        }
        Verification::NotReplayable => writeln!(
            output,
            "{name}: not replayable as a whole: the first {ticks_identical} of {ticks_recorded} ticks are identical"
        )?,
    }
    if let Some(first) = &report.first_divergence {
        print_divergence("tick", first, output)?;
    }
    print_frames(report, output)?;
    if !report.digests_compared && report.ticks_compared > 0 {
        writeln!(
            output,
            "another release wrote it: what it remembered was not compared, what it decided was"
        )?;
    }
    if let Some(growth) = &report.growth {
        print_growth(growth, output)?;
    }
    if let Some(consequence) = &report.consequence {
        print_consequence(consequence, output)?;
    }
    if let Some(obstacle) = report.obstacle.as_ref().filter(|_| *ticks_compared > 0) {
        writeln!(output, "not every tick was compared: {}", shown(&obstacle.to_string()))?;
    }
    if report.outcome != Verification::IdenticalReadablePart {
        let what_is_missing = what_is_missing(report);
        if !what_is_missing.is_empty() {
            writeln!(output, "what was compared is{what_is_missing}")?;
        }
    }
    Ok(())
}

/// Prints the comparison of the flight computer's frames from power-up on, or that only its ticks were compared.
fn print_frames(report: &VerifyReport, output: &mut impl Write) -> io::Result<()> {
    let Some(frames) = &report.frames else {
        let nothing = report.ticks_compared == 0;
        return if nothing { Ok(()) } else { writeln!(output, "{TICKS_ALONE}") };
    };
    let FramesReport { compared, different, until_s, .. } = frames;
    let until = until_s.map(|until_s| format!(" to {until_s:.3} s after it")).unwrap_or_default();
    if *different == 0 {
        writeln!(output, "flight computer from power-up{until}: {compared} of {compared} frames identical")?;
    } else {
        writeln!(output, "flight computer from power-up{until}: {different} of {compared} frames DIFFER")?;
    }
    match &frames.first_divergence {
        Some(first) => print_divergence("frame", first, output),
        None => Ok(()),
    }
}

/// The remark on a log whose flight computer cannot be run again from power-up on.
const TICKS_ALONE: &str = "the log has no frames of the flight computer from power-up: arming and countdown, if any, were not run again";

/// The file and, if it holds several flights, the flight's number.
fn name_of(report: &VerifyReport) -> String {
    let file = shown(&report.file);
    report
        .flight
        .map_or_else(|| file.clone(), |flight| format!("{file}: flight {} of {}", flight.number, flight.of))
}

/// What is missing from the part of the flight that was read.
fn what_is_missing(report: &VerifyReport) -> String {
    let cut = report.cut.as_ref().map(|cut| format!(" of an INCOMPLETE flight: {cut}"));
    let unread = report.damage.as_ref().map(|damage| {
        let ticks = match report.unread.and_then(|unread| unread.ticks) {
            Some((unread, all)) => format!("{unread} of {all} ticks were not read"),
            None => "how many ticks were not read is not known".to_owned(),
        };
        let seconds = report.unread.and_then(|unread| unread.seconds);
        let seconds = seconds.map(|seconds| format!(" ({seconds:.3} s)")).unwrap_or_default();
        format!("; {ticks}{seconds}: {}", shown(damage))
    });
    [cut, unread].into_iter().flatten().collect()
}

fn print_divergence(kind: &str, first: &Divergence, output: &mut impl Write) -> io::Result<()> {
    writeln!(
        output,
        "first at {kind} {} (t = {:.3} s, {}), {}:",
        first.tick,
        first.time_s,
        first.phase,
        counted(first.fields_different as u64, "field")
    )?;
    for field in first.fields.iter().take(FIELDS_SHOWN) {
        print_field(field, output)?;
    }
    if first.fields_different > FIELDS_SHOWN {
        writeln!(output, "  and {} more", counted((first.fields_different - FIELDS_SHOWN) as u64, "field"))?;
    }
    Ok(())
}

fn print_field(field: &FieldDifference, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "  {}", field.path)?;
    for (name, value) in [("recorded", &field.recorded), ("recomputed", &field.recomputed)] {
        let bits = value.bits().map(|bits| format!("0x{bits:016x}")).unwrap_or_default();
        writeln!(output, "    {}", format!("{name:<10}  {:<24}  {bits}", value.to_string()).trim_end())?;
    }
    if let Some(ulps) = field.ulps {
        writeln!(output, "    apart       {ulps} ULP")?;
    }
    Ok(())
}

/// Prints the first diverged tick, the ticks 1, 2, 4, 8 and so on after it, the worst tick and the last tick.
fn print_growth(growth: &Growth, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "how it grows (gimbal command, worst field):")?;
    let doubling = (0..).map(|power| (1_usize << power) - 1).take_while(|place| *place < growth.steps.len());
    let mut shown: Vec<&GrowthStep> = doubling.filter_map(|place| growth.steps.get(place)).collect();
    shown.extend(growth.peak.iter().chain(&growth.last));
    shown.sort_by_key(|step| step.tick);
    shown.dedup_by_key(|step| step.tick);
    for step in shown {
        let ulps = step.worst_ulps.map_or_else(|| "-".to_owned(), |ulps| ulps.to_string());
        writeln!(
            output,
            "  tick {:>5} {:>9.3} s  {:>10.3e} rad  {ulps} ULP in {}",
            step.tick,
            step.time_s,
            step.gimbal_rad,
            counted(step.fields_different as u64, "field")
        )?;
    }
    Ok(())
}

fn print_consequence(consequence: &Consequence, output: &mut impl Write) -> io::Result<()> {
    if let Some(obstacle) = &consequence.obstacle {
        return writeln!(output, "verdict: whether it would change is not known: {}", shown(obstacle));
    }
    let words = |verdict: Option<bool>| match verdict {
        Some(true) => "LANDED",
        Some(false) => "NOT LANDED",
        None => "no verdict",
    };
    let answer = match consequence.changed {
        Some(true) => "would CHANGE",
        Some(false) => "would not change",
        None => "is not comparable",
    };
    writeln!(
        output,
        "verdict: {answer}: recorded {}, flown on by this build from tick {} (closed loop) {}",
        words(consequence.recorded.as_ref().map(|verdict| verdict.landed)),
        consequence.from_tick,
        words(consequence.reflown.as_ref().map(|verdict| verdict.landed))
    )
}

/// A verification as a test case. With `strict`, only a whole identical flight passes.
pub fn verify_case(report: &VerifyReport, strict: bool) -> JunitCase {
    let mut text = Vec::new();
    // Writing into memory cannot fail.
    let _ = print_verify(report, &mut text);
    let details = String::from_utf8_lossy(&text).into_owned();
    let message = details.lines().next().unwrap_or_default().to_owned();
    let outcome = match report.outcome {
        Verification::IdenticalReadablePart if strict => JunitOutcome::Failed { message, details },
        Verification::Identical | Verification::IdenticalReadablePart => {
            JunitOutcome::Passed { said: details }
        }
        Verification::Diverged => JunitOutcome::Failed { message, details },
        Verification::NotReplayable => JunitOutcome::Error { message: details },
    };
    JunitCase { name: format!("verify {}", name_of(report)), outcome }
}
