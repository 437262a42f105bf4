//! Prints a tick that was solved again.

use std::io::{self, Write};

use super::shown;
use crate::tick::{Solved, TickReport};

/// Most nodes of the plan that are shown.
const NODES_SHOWN: usize = 12;

/// Writes a tick as text.
///
/// # Errors
/// The output failed.
pub fn print_tick(report: &TickReport, output: &mut impl Write) -> io::Result<()> {
    let TickReport { tick, time_s, phase, level, input, .. } = report;
    writeln!(output, "{}: tick {tick} ({time_s:.3} s, {phase}), decided by {level}", shown(&report.file))?;
    let [x, z, theta, u, w, q] = input.state;
    writeln!(
        output,
        "input    x {x:.3} m, z {z:.3} m, theta {:.3} deg, u {u:.3} m/s, w {w:.3} m/s, q {:.3} deg/s",
        theta.to_degrees(),
        q.to_degrees()
    )?;
    writeln!(
        output,
        "         {:.3} s since ignition, gimbal held {} deg, thrust {:.4} of nominal",
        input.time_since_ignition_s,
        degrees(&input.gimbal_applied_rad),
        input.thrust_scale
    )?;
    let same = if report.identical { "identical bit for bit" } else { "NOT IDENTICAL" };
    writeln!(
        output,
        "command  {} deg as recorded, {} deg now: {same}",
        degrees(&report.recorded_gimbal_rad),
        degrees(&report.gimbal_rad)
    )?;
    if report.warm.is_none() && report.cold.is_none() {
        let nearest = report.nearest_solved.map_or_else(
            || "no tick of this log does".to_owned(),
            |nearest| format!("the nearest that does is {nearest}"),
        );
        return writeln!(output, "solve    this tick solves no landing; {nearest}");
    }
    for (name, solved) in [("warm", &report.warm), ("cold", &report.cold)] {
        match solved {
            Some(solved) => print_solved(name, solved, output)?,
            None => writeln!(output, "{name:<8} nothing was kept from a solve at this tick")?,
        }
    }
    if let (Some(warm), Some(cold)) = (&report.warm, &report.cold) {
        writeln!(
            output,
            "         the warm start saves {} iterations; costs differ by {:.3e}, first inputs by {:.3e} rad",
            cold.iterations.cast_signed() - warm.iterations.cast_signed(),
            (warm.cost - cold.cost).abs(),
            (warm.gimbal_rad - cold.gimbal_rad).abs()
        )?;
    }
    for (place, constraint) in report.active.iter().enumerate() {
        let name = if place == 0 { "active" } else { "" };
        let at: Vec<String> = constraint.at.iter().map(ToString::to_string).collect();
        writeln!(
            output,
            "{name:<8} {} at {}, multiplier {:.4e}",
            constraint.what,
            at.join(" "),
            constraint.multiplier
        )?;
    }
    if report.active.is_empty() {
        writeln!(output, "active   none")?;
    }
    print_path(report, output)
}

/// One angle, or pitch and yaw.
fn degrees(rad: &[f64]) -> String {
    rad.iter().map(|rad| format!("{:.4}", rad.to_degrees())).collect::<Vec<_>>().join(" ")
}

fn print_solved(name: &str, solved: &Solved, output: &mut impl Write) -> io::Result<()> {
    writeln!(
        output,
        "{name:<8} {}, {} iterations, cost {:.6}, stationarity {:.1e}, feasibility {:.1e}, conditions missed by {:.1e}",
        solved.status,
        solved.iterations,
        solved.cost,
        solved.kkt_stationarity,
        solved.kkt_feasibility,
        solved.condition_miss
    )
}

fn print_path(report: &TickReport, output: &mut impl Write) -> io::Result<()> {
    let nodes = &report.path;
    let stride = nodes.len().div_ceil(NODES_SHOWN).max(1);
    for (node, point) in nodes.iter().enumerate() {
        if node % stride != 0 && node + 1 != nodes.len() {
            continue;
        }
        let name = if node == 0 { "path" } else { "" };
        let [x, z, theta, u, w, q] = point.state;
        let gimbal =
            point.gimbal_rad.map_or_else(String::new, |rad| format!(", gimbal {:.3} deg", rad.to_degrees()));
        writeln!(
            output,
            "{name:<8} +{:.1} s  x {x:>7.3} m  z {z:>7.3} m  theta {:>8.3} deg  u {u:>7.3} m/s  w {w:>7.3} m/s  q {:>8.3} deg/s{gimbal}",
            point.time_s,
            theta.to_degrees(),
            q.to_degrees()
        )?;
    }
    Ok(())
}
