//! The summary as plain text and as Markdown.

use core::fmt::{self, Write};

use super::{Attainable, Distribution, Summary};
use crate::order::{Manifest, Shard};
use crate::statistics::Share;

/// The summary as plain text.
pub fn to_text(summary: &Summary) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = text(summary, &mut out);
    out
}

/// The summary as Markdown, with links to the pictures in the same directory.
pub fn to_markdown(summary: &Summary) -> String {
    let mut out = String::new();
    let _ = markdown(summary, &mut out);
    out
}

fn percent(share: &Share) -> String {
    format!(
        "{} of {}: {:.1} % ({:.1} to {:.1} %)",
        share.count,
        share.of,
        100.0 * share.share,
        100.0 * share.low,
        100.0 * share.high
    )
}

/// What attainable means.
const CLAIRVOYANT: &str = "attainable: a clairvoyant lands it with the legs. Its command height is the same for all \
                           flights; once the thrust begins it knows the motor, the mass and the drag, and uses fins and \
                           tilt as a throttle. Motion is vertical: wind, place and attitude dynamics are left out";

/// The landings that the clairvoyant does not have.
fn others(attainable: &Attainable) -> String {
    match [attainable.landed_from_another_height, attainable.landed_beyond] {
        [0, 0] => String::new(),
        [chosen, beyond] => {
            format!("; besides, {chosen} landed from another height, and {beyond} beyond what is attainable")
        }
    }
}

fn capitalised(text: &str) -> String {
    let (first, rest) = text.split_at(1);
    first.to_uppercase() + rest
}

fn what(manifest: &Manifest) -> String {
    let mut what = format!(
        "{}, dispersion {}, seed {}, controller {}",
        manifest.mission, manifest.dispersion, manifest.seed, manifest.controller
    );
    if !manifest.steered {
        what.push_str(", passive descent");
    }
    if manifest.shard != Shard::WHOLE {
        what = format!("{what}, shard {}", manifest.shard);
    }
    if !manifest.faults.is_empty() {
        what = format!("{what}, faults {}", manifest.faults.join(" "));
    }
    what
}

fn percentiles(distribution: &Distribution) -> [f64; 8] {
    [
        distribution.least,
        distribution.p5,
        distribution.p25,
        distribution.p50,
        distribution.p75,
        distribution.p95,
        distribution.p99,
        distribution.greatest,
    ]
}

const HEADINGS: [&str; 8] = ["least", "5 %", "25 %", "50 %", "75 %", "95 %", "99 %", "greatest"];

fn text(summary: &Summary, out: &mut String) -> fmt::Result {
    writeln!(out, "{}", what(&summary.manifest))?;
    writeln!(out, "legs    {}", percent(&summary.legs))?;
    writeln!(out, "strict  {}", percent(&summary.strict))?;
    if let Some(attainable) = &summary.attainable {
        let Attainable { command_height_m, .. } = attainable;
        writeln!(
            out,
            "attainable, ignition command at {command_height_m:.1} m  {}",
            percent(&attainable.attainable)
        )?;
        writeln!(out, "landed of attainable  {}{}", percent(&attainable.landed), others(attainable))?;
        writeln!(out, "({CLAIRVOYANT})")?;
    }
    writeln!(out, "ignitions outside the gate: {}", summary.ignitions_outside_gate)?;
    if !summary.failures.is_empty() {
        writeln!(out, "\nwhy not:")?;
        for failure in &summary.failures {
            writeln!(out, "{:>6}  {}", failure.flights, failure.reason)?;
        }
    }
    let plans = &summary.plans;
    writeln!(
        out,
        "\nplans: {} converged, {} best feasible, {} shifted, {} upright law; {} iterations, {} solves not converged",
        plans.converged,
        plans.best_feasible,
        plans.shifted,
        plans.stabiliser,
        plans.solver_iterations,
        plans.solver_failures
    )?;
    write!(out, "\n{:<26}", "")?;
    for heading in HEADINGS {
        write!(out, "{heading:>10}")?;
    }
    writeln!(out)?;
    for distribution in &summary.distributions {
        write!(out, "{:<26}", distribution.column)?;
        for value in percentiles(distribution) {
            write!(out, "{value:>10.3}")?;
        }
        writeln!(out)?;
    }
    writeln!(
        out,
        "\nwhat costs most: landings (legs) in the half nearest the nominal value and in the other half"
    )?;
    writeln!(out, "{:<32}{:>10}{:>10}{:>10}{:>12}", "", "inner %", "outer %", "cost %", "rank corr.")?;
    for sensitivity in &summary.sensitivity {
        writeln!(
            out,
            "{:<32}{:>10.1}{:>10.1}{:>10.1}{:>12.3}",
            sensitivity.column,
            100.0 * sensitivity.inner.share,
            100.0 * sensitivity.outer.share,
            100.0 * sensitivity.cost(),
            sensitivity.rank_correlation
        )?;
    }
    Ok(())
}

fn markdown(summary: &Summary, out: &mut String) -> fmt::Result {
    let manifest = &summary.manifest;
    writeln!(out, "# {}\n", what(manifest))?;
    writeln!(out, "Program `{}`. Intervals are Wilson's, 95 %.\n", manifest.build)?;
    writeln!(out, "| verdict | landed |\n|---|---|")?;
    writeln!(out, "| legs | {} |\n| strict | {} |\n", percent(&summary.legs), percent(&summary.strict))?;
    if let Some(attainable) = &summary.attainable {
        writeln!(out, "| one ignition height for all flights | flights |\n|---|---|")?;
        let Attainable { command_height_m, .. } = attainable;
        writeln!(
            out,
            "| attainable, command at {command_height_m:.1} m | {} |",
            percent(&attainable.attainable)
        )?;
        writeln!(out, "| landed of attainable | {}{} |\n", percent(&attainable.landed), others(attainable))?;
        writeln!(out, "{}.\n", capitalised(CLAIRVOYANT))?;
    }
    writeln!(out, "Ignitions outside the gate: {}.\n", summary.ignitions_outside_gate)?;
    if !summary.failures.is_empty() {
        writeln!(out, "| why not | flights |\n|---|---|")?;
        for failure in &summary.failures {
            writeln!(out, "| {} | {} |", failure.reason, failure.flights)?;
        }
        writeln!(out)?;
    }
    writeln!(out, "| | {} |\n|---|{}", HEADINGS.join(" | "), "---|".repeat(HEADINGS.len()))?;
    for distribution in &summary.distributions {
        let values = percentiles(distribution).map(|value| format!("{value:.3}"));
        writeln!(out, "| `{}` | {} |", distribution.column, values.join(" | "))?;
    }
    writeln!(out, "\n## What costs most\n")?;
    writeln!(
        out,
        "Flights are halved at the median deviation of a drawn quantity from its nominal value (for wind and the state \
         at apogee: at the median value). `cost` is the share of landings (legs) that the outer half has less. The rank \
         correlation is Spearman's, between deviation and the largest share of the legs' limits used at contact.\n"
    )?;
    writeln!(out, "| drawn | median deviation | inner % | outer % | cost % | rank correlation |")?;
    writeln!(out, "|---|---|---|---|---|---|")?;
    for sensitivity in &summary.sensitivity {
        writeln!(
            out,
            "| `{}` | {:.4} | {:.1} | {:.1} | {:.1} | {:.3} |",
            sensitivity.column,
            sensitivity.median_deviation,
            100.0 * sensitivity.inner.share,
            100.0 * sensitivity.outer.share,
            100.0 * sensitivity.cost(),
            sensitivity.rank_correlation
        )?;
    }
    writeln!(out, "\n## Pictures\n")?;
    for (name, title) in crate::picture::PICTURES {
        writeln!(out, "![{title}]({name})")?;
    }
    Ok(())
}
