//! Flies many settings over many flights in closed loop and ranks them by the worst flight's margin.
//!
//! A point is one choice of every varied setting; a job is one point on one flight. Jobs are independent and their
//! results are put in the order of the points, so the answer does not depend on how many run at the same time.

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Result, ensure};
use campaign::stopwatch::Stopwatch;
use clap::Args;
use serde::Serialize;

pub use super::jobs::sweep;
use super::{FlownHow, ReflyError, StartAt, can_be_flown};
use crate::cli::{Outcome, answer, in_pool, refuse_existing, say, warn_of_what_is_missing, write_table};
use crate::log::Recording;
use crate::print::{counted, print_json, shown};
use crate::settings::Setting;

/// A flight cannot be flown again at some point.
#[derive(Debug, thiserror::Error)]
#[error("{settings}")]
pub struct SweepError {
    /// The settings of the point.
    pub(super) settings: String,
    /// What is wrong.
    pub(super) source: Box<ReflyError>,
}

/// The outcome of one flight at one point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FlightOutcome {
    /// Inside every touchdown limit.
    pub landed: bool,
    /// Distance to the nearest limit as a fraction of it; see [`ReflyReport::margin`](crate::refly::ReflyReport).
    /// `None` if the vehicle did not come down.
    pub margin: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointOutcome {
    /// Its number among the points.
    pub point: usize,
    pub settings: Vec<String>,
    /// Flights that landed.
    pub landed: usize,
    /// The worst flight's margin; `None` if one did not come down.
    pub worst_margin: Option<f64>,
    pub worst_flight: String,
    /// Every flight, in the order given.
    pub flights: Vec<FlightOutcome>,
}

/// The result of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepReport {
    /// Marks the report as closed loop.
    pub kind: &'static str,
    pub flights: Vec<String>,
    /// The flights of this run that this build, with nothing changed, does not fly as recorded.
    pub not_reproduced: Vec<String>,
    /// The points, the best first.
    pub points: Vec<PointOutcome>,
}

impl SweepReport {
    /// Ranks the points by largest worst-case margin, then by number of landings, then in the given order.
    pub(super) fn ranked(
        flights: Vec<String>,
        not_reproduced: Vec<String>,
        mut points: Vec<PointOutcome>,
    ) -> Self {
        let margin = |point: &PointOutcome| point.worst_margin.unwrap_or(f64::NEG_INFINITY);
        points.sort_by(|a, b| {
            margin(b).total_cmp(&margin(a)).then(b.landed.cmp(&a.landed)).then(a.point.cmp(&b.point))
        });
        Self { kind: "closed loop: flown again in simulation", flights, not_reproduced, points }
    }
}

/// Most points of one sweep: more would take days.
const POINTS_MAX: usize = 1_000_000;

/// A setting and the values it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Vary {
    /// The setting, as in `powered.weights.theta`.
    pub path: String,
    pub values: Values,
}

/// The values of a varied setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// A list of values.
    Listed(Vec<toml::Value>),
    /// Evenly spaced values.
    Range {
        /// The first.
        from: f64,
        /// The last.
        to: f64,
        /// Number of values.
        count: usize,
    },
}

/// Why the values cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VaryError {
    /// The text cannot be parsed.
    #[error("`{given}`: must be PATH=FROM:TO:COUNT or PATH=A,B,C, as in powered.weights.theta=50:110:7")]
    Form { given: String },
    /// Too many points.
    #[error("{points} points; at most {POINTS_MAX} are allowed in one sweep")]
    TooMany { points: usize },
}

/// The settings of one point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Choice {
    /// Settings of controller and plant.
    pub settings: Vec<Setting>,
    /// Settings of the plant only.
    pub plant_settings: Vec<Setting>,
}

impl Choice {
    pub(super) fn words(&self) -> Vec<String> {
        self.settings.iter().chain(&self.plant_settings).map(ToString::to_string).collect()
    }
}

impl FromStr for Vary {
    type Err = VaryError;

    fn from_str(given: &str) -> Result<Self, VaryError> {
        let form = || VaryError::Form { given: given.to_owned() };
        let (path, text) = given.split_once('=').ok_or_else(form)?;
        let (path, text) = (path.trim().to_owned(), text.trim());
        if path.is_empty() || text.is_empty() {
            return Err(form());
        }
        let parts: Vec<&str> = text.split(':').collect();
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let values = match parts.as_slice() {
            [_] => {
                let listed = text.split(',').map(|value| format!("{path}={value}").parse::<Setting>());
                let listed = listed.map(|setting| setting.ok().filter(|setting| setting.at_s.is_none()));
                Values::Listed(
                    listed
                        .map(|setting| Some(setting?.value))
                        .collect::<Option<Vec<_>>>()
                        .ok_or_else(form)?,
                )
            }
            [from, to, count] => Values::Range {
                from: number(from).ok_or_else(form)?,
                to: number(to).ok_or_else(form)?,
                count: count.trim().parse().ok().filter(|count| *count >= 1).ok_or_else(form)?,
            },
            _ => return Err(form()),
        };
        Ok(Self { path, values })
    }
}

impl Vary {
    fn count(&self) -> usize {
        match &self.values {
            Values::Listed(values) => values.len(),
            Values::Range { count, .. } => *count,
        }
    }

    /// The value at this index of the grid.
    fn at(&self, place: usize) -> Setting {
        let value = match &self.values {
            Values::Listed(values) => values.get(place).cloned().unwrap_or(toml::Value::Boolean(false)),
            Values::Range { from, to, count } => {
                let share = if *count > 1 { place as f64 / (*count - 1) as f64 } else { 0.0 };
                toml::Value::Float(from + share * (to - from))
            }
        };
        Setting { path: self.path.clone(), value, at_s: None }
    }
}

/// Every combination; the last setting changes fastest.
///
/// # Errors
/// There are too many points.
pub fn grid(vary: &[Vary], plant: &[Vary]) -> Result<Vec<Choice>, VaryError> {
    let all: Vec<&Vary> = vary.iter().chain(plant).collect();
    let points = all.iter().map(|vary| vary.count()).fold(1, usize::saturating_mul);
    if points > POINTS_MAX {
        return Err(VaryError::TooMany { points });
    }
    let choice = |point: usize| {
        let mut rest = point;
        let mut settings: Vec<Setting> = Vec::new();
        for vary in all.iter().rev() {
            settings.push(vary.at(rest % vary.count()));
            rest /= vary.count();
        }
        settings.reverse();
        let plant_settings = settings.split_off(vary.len());
        Choice { settings, plant_settings }
    };
    Ok((0..points).map(choice).collect())
}

/// Points of a sweep that are printed.
const SHOWN: usize = 20;

/// Writes the best points of a sweep as text.
///
/// # Errors
/// The output failed.
pub fn print_sweep(report: &SweepReport, output: &mut impl Write) -> io::Result<()> {
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
    for (rank, point) in report.points.iter().enumerate().take(SHOWN) {
        let PointOutcome { settings, landed, worst_flight, .. } = point;
        writeln!(
            output,
            "{:>4} {:>9} {:>9}  {}; {}",
            rank + 1,
            margin_words(point.worst_margin),
            format!("{landed}/{flights}"),
            shown(&settings.join(" ")),
            shown(worst_flight)
        )?;
    }
    if report.points.len() > SHOWN {
        writeln!(output, "and {} more; --csv FILE writes all", report.points.len() - SHOWN)?;
    }
    Ok(())
}

/// Writes every point of a sweep on every flight as CSV, the best point first.
///
/// # Errors
/// The output failed.
pub fn write_sweep_csv(report: &SweepReport, output: &mut dyn Write) -> io::Result<()> {
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

fn not_reproduced(name: &str, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "{}: with nothing changed this build does not fly it as recorded", shown(name))
}

fn margin_words(margin: Option<f64>) -> String {
    margin.map_or_else(|| "not down".to_owned(), |margin| format!("{margin:.4}"))
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// What is varied.
#[derive(Debug, Args)]
#[group(id = "varied")]
pub(super) struct Arguments {
    /// Try PATH=FROM:TO:COUNT or PATH=A,B,C and rank.
    ///
    /// It is a setting of controller and plant. May be given more than once: every combination is flown.
    #[arg(long, value_name = "VALUES")]
    vary: Vec<Vary>,
    /// The same of a setting of the plant alone.
    #[arg(long, value_name = "VALUES")]
    vary_plant: Vec<Vary>,
    /// Flights flown at the same time; the answer does not depend on it [default: all processors].
    #[arg(long, value_name = "N", hide_short_help = true)]
    jobs: Option<NonZeroUsize>,
    /// Write a table with every point on every flight into a new file.
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    csv: Option<PathBuf>,
}

impl Arguments {
    pub(super) fn is_asked(&self) -> bool {
        !(self.vary.is_empty() && self.vary_plant.is_empty()) || self.csv.is_some()
    }

    pub(super) fn run(&self, files: &[PathBuf], how: &FlownHow, json: bool) -> Result<Outcome> {
        ensure!(
            !(self.vary.is_empty() && self.vary_plant.is_empty()),
            "nothing to vary; give --vary powered.weights.theta=50:110:7 or the like"
        );
        self.csv.as_deref().map_or(Ok(()), refuse_existing)?;
        let points = grid(&self.vary, &self.vary_plant)?;
        let options = how.options(StartAt::Landing)?;
        let mut flights = Vec::new();
        for file in files {
            let opened = Recording::open(file).map_err(ReflyError::from);
            match opened.and_then(|flight| can_be_flown(&flight).map(|()| flight)) {
                Ok(flight) => {
                    warn_of_what_is_missing(&flight);
                    flights.push(flight);
                }
                Err(error) if files.len() == 1 => return Err(error.into()),
                Err(error) => say(&format!("skipped: {:#}", anyhow::Error::from(error))),
            }
        }
        ensure!(!flights.is_empty(), "none of the {} logs can be flown again", files.len());
        let stopwatch = Stopwatch::start();
        let told = |done, of| stopwatch.show(done, of, "flights");
        let report = in_pool(self.jobs, || sweep(&flights, &points, &options, &told))??;
        if let Some(path) = &self.csv {
            write_table(path, |output| write_sweep_csv(&report, output))?;
        }
        answer(|output| if json { print_json(&report, output) } else { print_sweep(&report, output) })?;
        Ok(Outcome::Given)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(choices: &[Choice]) -> Vec<String> {
        choices.iter().map(|choice| choice.words().join(" ")).collect()
    }

    #[test]
    fn a_grid_has_every_combination_in_order() {
        let points = grid(&["a=1:3:3".parse().unwrap()], &["b=x,y".parse().unwrap()]).unwrap();
        assert_eq!(
            shown(&points),
            [
                "a=1.0 b=\"x\"",
                "a=1.0 b=\"y\"",
                "a=2.0 b=\"x\"",
                "a=2.0 b=\"y\"",
                "a=3.0 b=\"x\"",
                "a=3.0 b=\"y\""
            ]
        );
        assert!(points[0].plant_settings[0].path == "b");
        assert!(grid(&["a=0:1:2000".parse().unwrap(), "b=0:1:2000".parse().unwrap()], &[]).is_err());
    }

    #[test]
    fn a_malformed_range_is_refused() {
        for bad in ["a", "a=", "=1:2:2", "a=1:2", "a=1:2:0", "a=1:x", "a=1:2:3:4", "a=1:inf"] {
            assert!(bad.parse::<Vary>().is_err(), "{bad}");
        }
    }
}
