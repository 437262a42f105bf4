//! The summary of a campaign, as data, plain text and Markdown.
//!
//! It does not depend on a clock, a thread or a machine, so it is the same however the campaign was
//! run.

use core::cmp::Reverse;
use core::fmt::{self, Write};
use std::collections::BTreeMap;

use flight::rules::verdict::Landing;
use serde::Serialize;

use crate::row::{COLUMNS, Row};
use crate::statistics::{Landings, Share, quantile, sorted};
use crate::store::Manifest;

/// Columns whose percentiles are in the summary.
const SUMMARISED: [&str; 14] = [
    "touchdown_vertical_m_s",
    "touchdown_lateral_m_s",
    "touchdown_tilt_deg",
    "touchdown_rate_deg_s",
    "leg_use",
    "chosen_onset_height_m",
    "onset_height_m",
    "burn_time_at_contact_s",
    "gimbal_saturation_share",
    "error_vertical_m_s",
    "error_lateral_m_s",
    "error_height_m",
    "error_nose_deg",
    "flight_time_s",
];

/// A campaign's summary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The manifest of the campaign.
    pub manifest: Manifest,
    /// How the flights landed.
    #[serde(flatten)]
    pub landings: Landings,
    /// Why the others did not, the most frequent reason first.
    pub failures: Vec<Failures>,
    /// Ignitions while a check of the gate failed. This must be zero.
    pub ignitions_outside_gate: u64,
    /// Plans by control level, and the work of the solver.
    pub plans: Plans,
    pub distributions: Vec<Distribution>,
    /// Drawn quantities, beginning with the one that costs most landings.
    pub sensitivity: Vec<Sensitivity>,
}

/// A reason and the number of flights with it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failures {
    pub reason: String,
    /// The number of flights.
    pub flights: u64,
}

/// All flights' plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Plans {
    pub converged: u64,
    pub best_feasible: u64,
    /// The previous plan, shifted.
    pub shifted: u64,
    pub stabiliser: u64,
    pub solver_iterations: u64,
    /// Solves that did not converge.
    pub solver_failures: u64,
}

/// Percentiles of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// The column, with its unit.
    pub column: &'static str,
    /// Flights that have a value.
    pub flights: u64,
    pub least: f64,
    /// 5th percentile.
    pub p5: f64,
    /// 25th percentile.
    pub p25: f64,
    /// Median.
    pub p50: f64,
    /// 75th percentile.
    pub p75: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    pub greatest: f64,
}

/// How many landings a drawn quantity costs.
///
/// A flight's deviation is the distance of its draw from the nominal value, or the draw itself
/// where more is worse (wind, distance and motion at apogee). The median deviation divides the
/// flights into an inner and an outer half.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// The quantity, with its unit.
    pub column: &'static str,
    pub median_deviation: f64,
    /// Fraction of the inner half that stands undamaged.
    pub inner: Share,
    /// The same fraction of the outer half.
    pub outer: Share,
}

impl Sensitivity {
    /// How much smaller the fraction of landings is in the outer half than in the inner half.
    pub fn cost(&self) -> f64 {
        self.inner.share - self.outer.share
    }

    /// The 95 % interval of the cost: Newcombe's, from the Wilson intervals of both halves
    /// (Statistics in Medicine 17, 873-890, method 10).
    pub fn cost_interval(&self) -> [f64; 2] {
        let Self { inner, outer, .. } = self;
        let down = libm::hypot(inner.share - inner.low, outer.high - outer.share);
        let up = libm::hypot(inner.high - inner.share, outer.share - outer.low);
        [self.cost() - down, self.cost() + up]
    }
}

impl Summary {
    /// The summary of rows in any order.
    pub fn new(manifest: &Manifest, rows: &[Row]) -> Self {
        let count = |is: fn(&Row) -> bool| rows.iter().filter(|row| is(row)).count() as u64;
        let sum = |read: fn(&Row) -> u64| rows.iter().map(read).sum();
        Self {
            manifest: manifest.clone(),
            landings: Landings::of(rows.iter().map(Row::landing)),
            failures: failures(rows),
            ignitions_outside_gate: count(|row| row.ignition_outside_gate),
            plans: Plans {
                converged: sum(|row| row.plans_converged),
                best_feasible: sum(|row| row.plans_best_feasible),
                shifted: sum(|row| row.plans_shifted),
                stabiliser: sum(|row| row.plans_stabiliser),
                solver_iterations: sum(|row| row.solver_iterations),
                solver_failures: sum(|row| row.solver_failures),
            },
            distributions: SUMMARISED.iter().filter_map(|name| distribution(rows, name)).collect(),
            sensitivity: sensitivity(rows),
        }
    }
}

pub(crate) fn failures(rows: &[Row]) -> Vec<Failures> {
    let mut found = BTreeMap::new();
    for row in rows.iter().filter(|row| !row.failure.is_empty()) {
        *found.entry(&row.failure).or_default() += 1;
    }
    let found = found.into_iter().map(|(reason, flights)| Failures { reason: reason.clone(), flights });
    let mut found: Vec<Failures> = found.collect();
    found.sort_by_key(|failures| Reverse(failures.flights));
    found
}

/// The numbers in a column.
pub(crate) fn numbers<'a>(rows: &'a [Row], name: &str) -> impl Iterator<Item = f64> + use<'a> {
    let column = COLUMNS.iter().find(|column| column.name == name);
    rows.iter().filter_map(move |row| (column?.value)(row).as_f64())
}

fn distribution(rows: &[Row], name: &'static str) -> Option<Distribution> {
    let values = sorted(numbers(rows, name));
    let at = |share| quantile(&values, share);
    Some(Distribution {
        column: name,
        flights: values.len() as u64,
        least: at(0.0)?,
        p5: at(0.05)?,
        p25: at(0.25)?,
        p50: at(0.5)?,
        p75: at(0.75)?,
        p95: at(0.95)?,
        p99: at(0.99)?,
        greatest: at(1.0)?,
    })
}

fn sensitivity(rows: &[Row]) -> Vec<Sensitivity> {
    let to = |(name, nominal): &(&'static str, Option<f64>)| {
        let drawn = numbers(rows, name);
        sensitivity_to(
            rows,
            name,
            drawn.map(|value| nominal.map_or(value, |nominal| (value - nominal).abs())),
        )
    };
    let mut found: Vec<Sensitivity> = Row::DRAWN.iter().filter_map(to).collect();
    found.sort_by(|one, two| two.cost().total_cmp(&one.cost()));
    found
}

/// `None` for a quantity that does not vary.
fn sensitivity_to(
    rows: &[Row],
    column: &'static str,
    deviations: impl Iterator<Item = f64>,
) -> Option<Sensitivity> {
    let flights: Vec<(f64, &Row)> = deviations.zip(rows).collect();
    let order = sorted(flights.iter().map(|(deviation, _)| *deviation));
    let median = quantile(&order, 0.5)?;
    if order.first()?.to_bits() == order.last()?.to_bits() {
        return None;
    }
    let half = |outer: bool| {
        let mine = || flights.iter().filter(|(deviation, _)| (*deviation > median) == outer);
        Share::new(mine().filter(|(_, row)| row.stands).count() as u64, mine().count() as u64)
    };
    Some(Sensitivity { column, median_deviation: median, inner: half(false), outer: half(true) })
}

/// The summary as plain text.
pub fn to_text(summary: &Summary) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_text(summary, &mut out);
    out
}

/// The summary as Markdown.
pub fn to_markdown(summary: &Summary) -> String {
    let Manifest { mission, build, .. } = &summary.manifest;
    format!("# {mission}\n\nProgram `{build}`.\n\n```\n{}```\n", to_text(summary))
}

/// As much as fits into 80 columns; the summary has the other percentiles.
fn write_distributions(summary: &Summary, out: &mut String) -> fmt::Result {
    let heading = ["least", "5 %", "50 %", "95 %", "greatest"];
    writeln!(out, "{:<30}{}", "", heading.map(|name| format!("{name:>10}")).concat())?;
    summary.distributions.iter().try_for_each(|found| {
        let Distribution { column, least, p5, p50, p95, greatest, .. } = found;
        writeln!(out, "{column:<30}{least:>10.3}{p5:>10.3}{p50:>10.3}{p95:>10.3}{greatest:>10.3}")
    })
}

/// The quantities whose cost is significant with this number of flights.
fn write_sensitivities(summary: &Summary, out: &mut String) -> fmt::Result {
    let Summary { sensitivity, landings, .. } = summary;
    let costly = || sensitivity.iter().filter(|found| found.cost_interval()[0] > 0.0);
    if costly().next().is_none() {
        return writeln!(out, "\nwhat costs landings: {} flights do not tell", landings.stands.of);
    }
    writeln!(
        out,
        "\nwhat costs landings, with 95 % intervals: the half nearest the nominal value (of\nwind and the state at apogee the \
         lower half) against the other half. Of {} quantities\none in forty stands here by chance",
        sensitivity.len()
    )?;
    let heading = ["deviation", "inner %", "outer %", "cost %", "from %", "to %"];
    writeln!(out, "{:<30}{}", "", heading.map(|name| format!("{name:>8}")).concat())?;
    costly().try_for_each(|found| {
        let [low, high] = found.cost_interval();
        let percents = [found.inner.share, found.outer.share, found.cost(), low, high];
        let percents = percents.map(|share| format!("{:>8.1}", 100.0 * share)).concat();
        writeln!(out, "{:<30}{:>8.4}{percents}", found.column, found.median_deviation)
    })
}

fn write_text(summary: &Summary, out: &mut String) -> fmt::Result {
    let Landings { stands, envelope, .. } = &summary.landings;
    let (of, inside) = (stands.of, envelope.count);
    writeln!(
        out,
        "{} of {of} flights stand undamaged, {inside} touch down inside their envelope.",
        stands.count
    )?;
    let Manifest { mission, dispersion, seed, faults, .. } = &summary.manifest;
    let faults = if faults.is_empty() { String::new() } else { format!(", faults {}", faults.join(" ")) };
    writeln!(out, "{mission}, dispersion {dispersion}, seed {seed}{faults}")?;
    for (word, share) in Landing::WORDS.iter().zip(summary.landings.shares()) {
        writeln!(out, "{word:<38}  {share}")?;
    }
    writeln!(out, "ignitions outside the gate: {}", summary.ignitions_outside_gate)?;
    if !summary.failures.is_empty() {
        writeln!(out, "\nwhy not:")?;
        for failure in &summary.failures {
            writeln!(out, "{:>6}  {}", failure.flights, failure.reason)?;
        }
    }
    let Plans { converged, best_feasible, shifted, stabiliser, solver_iterations, solver_failures } =
        summary.plans;
    writeln!(
        out,
        "\nplans: {converged} converged, {best_feasible} best feasible, {shifted} shifted, {stabiliser} upright law;\n\
         {solver_iterations} iterations, {solver_failures} solves not converged\n"
    )?;
    write_distributions(summary, out)?;
    write_sensitivities(summary, out)
}
