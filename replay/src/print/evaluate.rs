//! An evaluation, for people and as a table.

use std::io::{self, Write};

use super::shown;
use crate::evaluate::{EvaluateReport, EvaluatedTick};

/// Writes an evaluation as text: the summary, then every tick on which something differs.
///
/// # Errors
/// The output failed.
pub fn print_evaluate(report: &EvaluateReport, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: {}", shown(&report.file), report.kind)?;
    if !report.settings.is_empty() {
        writeln!(output, "with {}", shown(&report.settings.join(" ")))?;
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
    writeln!(output, "{} ticks are decided by another level", report.levels_different)?;
    let differing: Vec<&EvaluatedTick> =
        report.ticks.iter().filter(|tick| tick.recorded != tick.evaluated).collect();
    if differing.is_empty() {
        return Ok(());
    }
    writeln!(
        output,
        "{:>5} {:>9} {:<10} {:>20} {:>23} {:>14}  plan lands",
        "tick", "time s", "phase", "gimbal deg", "cost", "iterations"
    )?;
    for tick in differing {
        let (then, now) = (&tick.recorded, &tick.evaluated);
        let levels = if then.level == now.level {
            String::new()
        } else {
            format!("  {} -> {}", then.level, now.level)
        };
        writeln!(
            output,
            "{:>5} {:>9.3} {:<10} {:>8.3} -> {:>8.3} {:>9.2} -> {:>9.2} {:>5} -> {:>4}   {} -> {}{levels}",
            tick.tick,
            tick.time_s,
            tick.phase,
            then.gimbal_rad.to_degrees(),
            now.gimbal_rad.to_degrees(),
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
    writeln!(
        output,
        "tick,time_s,phase,recorded_gimbal_rad,evaluated_gimbal_rad,recorded_level,evaluated_level,recorded_cost,\
         evaluated_cost,recorded_iterations,evaluated_iterations"
    )?;
    for tick in &report.ticks {
        let (then, now) = (&tick.recorded, &tick.evaluated);
        writeln!(
            output,
            "{},{:?},{},{:?},{:?},{},{},{:?},{:?},{},{}",
            tick.tick,
            tick.time_s,
            tick.phase,
            then.gimbal_rad,
            now.gimbal_rad,
            then.level,
            now.level,
            then.cost,
            now.cost,
            then.iterations,
            now.iterations
        )?;
    }
    Ok(())
}

fn yes_no(answer: Option<bool>) -> &'static str {
    match answer {
        None => "-",
        Some(true) => "yes",
        Some(false) => "no",
    }
}
