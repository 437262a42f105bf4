//! Prints an evaluation as text and as a table.

use std::io::{self, Write};

use super::shown;
use crate::evaluate::{Decided, EvaluateReport, EvaluatedTick, PhaseEntered};

/// Most differing ticks that are shown.
const TICKS_SHOWN: usize = 120;

/// Writes an evaluation as text: the summary, then the ticks that differ.
///
/// # Errors
/// The output failed.
pub fn print_evaluate(report: &EvaluateReport, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: {}", shown(&report.file), report.kind)?;
    if !report.settings.is_empty() {
        writeln!(output, "with {}", shown(&report.settings.join(" ")))?;
    }
    if report.unchanged_different > 0 {
        writeln!(
            output,
            "with nothing changed this build decides {} of {} ticks differently from the record",
            report.unchanged_different,
            report.ticks.len()
        )?;
    }
    let largest =
        report.gimbal_difference_max_tick.map(|tick| format!(" at tick {tick}")).unwrap_or_default();
    writeln!(
        output,
        "{} of {} gimbal commands differ: root mean square {:.3} deg in the landing, largest {:.3} deg{largest}",
        report.commands_different,
        report.ticks.len(),
        report.gimbal_difference_rms_rad.to_degrees(),
        report.gimbal_difference_max_rad.to_degrees()
    )?;
    writeln!(
        output,
        "fin commands differ by {:.3} deg at most; {} ticks are decided by another level",
        report.fins_difference_max_rad.to_degrees(),
        report.levels_different
    )?;
    for PhaseEntered { phase, recorded_s, evaluated_s } in &report.phases {
        if recorded_s != evaluated_s {
            let at = |time_s: Option<f64>| {
                time_s.map_or_else(|| "never".to_owned(), |time_s| format!("at {time_s:.3} s"))
            };
            writeln!(output, "{phase}: entered {} -> {}", at(*recorded_s), at(*evaluated_s))?;
        }
    }
    let differing: Vec<&EvaluatedTick> =
        report.ticks.iter().filter(|tick| tick.recorded != tick.evaluated).collect();
    if differing.is_empty() {
        return Ok(());
    }
    // Text shows planning frames only, because the others hardly differ; --csv has all 200 frames a second.
    let stride = differing.len().div_ceil(TICKS_SHOWN).max(1);
    if stride > 1 {
        writeln!(output, "one of {stride} differing ticks; --csv and --json show all:")?;
    }
    writeln!(
        output,
        "{:>5} {:>9} {:<12} {:>34} {:>22} {:>13}  plan lands",
        "tick", "time s", "phase", "gimbal deg", "cost", "iterations"
    )?;
    for tick in differing.into_iter().step_by(stride) {
        let (then, now) = (&tick.recorded, &tick.evaluated);
        let levels = if then.level == now.level {
            String::new()
        } else {
            format!("  {} -> {}", then.level, now.level)
        };
        writeln!(
            output,
            "{:>5} {:>9.3} {:<12} {:>15} -> {:>15} {:>9.2} -> {:>9.2} {:>5} -> {:>4}   {} -> {}{levels}",
            tick.tick,
            tick.time_s,
            tick.phase,
            angles(&then.gimbal_rad),
            angles(&now.gimbal_rad),
            then.cost,
            now.cost,
            then.iterations,
            now.iterations,
            yes_no(then.plan_lands),
            yes_no(now.plan_lands),
        )?;
    }
    Ok(())
}

/// Writes every tick of an evaluation as CSV.
///
/// # Errors
/// The output failed.
pub fn print_evaluate_csv(report: &EvaluateReport, output: &mut impl Write) -> io::Result<()> {
    let lists = report
        .ticks
        .first()
        .map_or((0, 0), |tick| (tick.recorded.gimbal_rad.len(), tick.recorded.fins_rad.len()));
    let mut columns = vec!["tick".to_owned(), "time_s".to_owned()];
    for side in ["recorded", "evaluated"] {
        columns.extend(["phase", "level", "cost", "iterations"].map(|name| format!("{side}_{name}")));
        // A single gimbal angle has no index in its name.
        let gimbal = (0..lists.0).map(|axis| match lists.0 {
            1 => format!("{side}_gimbal_rad"),
            _ => format!("{side}_gimbal_rad_{axis}"),
        });
        columns.extend(gimbal);
        columns.extend((0..lists.1).map(|fin| format!("{side}_fins_rad_{fin}")));
    }
    writeln!(output, "{}", columns.join(","))?;
    for tick in &report.ticks {
        let mut cells = vec![tick.tick.to_string(), format!("{:?}", tick.time_s)];
        for decided in [&tick.recorded, &tick.evaluated] {
            let Decided { gimbal_rad, fins_rad, phase, level, cost, iterations, plan_lands: _ } = decided;
            cells.extend([(*phase).to_owned(), (*level).to_owned()]);
            cells.extend([format!("{cost:?}"), iterations.to_string()]);
            cells.extend(gimbal_rad.iter().chain(fins_rad).map(|angle| format!("{angle:?}")));
        }
        writeln!(output, "{}", cells.join(","))?;
    }
    Ok(())
}

/// One angle, or pitch and yaw.
fn angles(rad: &[f64]) -> String {
    rad.iter().map(|rad| format!("{:.3}", rad.to_degrees())).collect::<Vec<_>>().join(" ")
}

fn yes_no(answer: Option<bool>) -> &'static str {
    match answer {
        None => "-",
        Some(true) => "yes",
        Some(false) => "no",
    }
}
