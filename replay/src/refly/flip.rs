//! Finds the smallest change of one setting that turns landed into not landed, or back.

use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Result, bail, ensure};
use clap::Args;
use serde::Serialize;

use super::vary::{FlightOutcome, margin_words, not_reproduced};
use super::{FlownHow, Prepared, ReflyError, ReflyOptions, StartAt};
use crate::cli::{Outcome, answer, stop_on_interrupt, warn_of_what_is_missing};
use crate::log::Recording;
use crate::print::{counted, print_json, shown};
use crate::settings::Setting;

/// Halvings of the interval in which the verdict changes.
const HALVINGS: u32 = 40;

/// Why a setting cannot be bisected.
#[derive(Debug, thiserror::Error)]
pub enum BisectError {
    /// The flight cannot be flown again.
    #[error(transparent)]
    Refly(#[from] ReflyError),
    /// The setting has no number to begin from.
    #[error("{path} has no number in the flight's profile; say where to begin with --value")]
    NoValue {
        /// The setting.
        path: String,
    },
    /// The value lies outside the range.
    #[error("{path} = {value} does not lie between {from} and {to}")]
    Outside {
        /// The setting.
        path: String,
        value: f64,
        /// Lowest value.
        from: f64,
        /// Highest value.
        to: f64,
    },
}

/// Options of a bisection.
#[derive(Debug, Clone)]
pub struct BisectOptions {
    /// The setting.
    pub path: String,
    /// Change the plant only.
    pub plant_alone: bool,
    /// Where to begin; the profile's own value if left out.
    pub value: Option<f64>,
    /// Lowest value tried.
    pub from: f64,
    /// Highest value tried.
    pub to: f64,
    /// Values tried on either side before the change is narrowed down.
    pub steps: u32,
    /// The other options of the flight.
    pub refly: ReflyOptions,
}

/// The change of the verdict on one side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flip {
    /// The last value tried that keeps the verdict.
    pub same_at: f64,
    /// The first value tried with the other verdict.
    pub other_at: f64,
    /// The change from the beginning.
    pub change: f64,
    /// Flight with that change.
    pub outcome: FlightOutcome,
}

/// A value of the setting that cannot be flown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RefusedValue {
    pub value: f64,
    pub reason: String,
}

/// The result of a bisection.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BisectReport {
    /// Marks the report as closed loop.
    pub kind: &'static str,
    /// The flight.
    pub file: String,
    /// Whether this build, with nothing changed, flies it as recorded.
    pub reproduced: bool,
    /// The setting.
    pub path: String,
    /// Whether it is changed for the plant alone.
    pub plant_alone: bool,
    /// The start.
    pub value: f64,
    /// The outcome at the start value.
    pub outcome: FlightOutcome,
    /// The first change of the verdict below the start value, found by steps and then narrowed down.
    pub below: Option<Flip>,
    /// The first change above the start value.
    pub above: Option<Flip>,
    /// The size of the steps below and above. A change that reverts within one step is not seen.
    pub steps: (f64, f64),
    /// The values that cannot be flown, and why.
    pub refused: Vec<RefusedValue>,
    /// The search was stopped; the rest of the report is what it had found until then.
    pub interrupted: bool,
    /// Number of flights flown.
    pub flown: usize,
}

impl BisectReport {
    /// The smaller of the two changes.
    pub fn smallest(&self) -> Option<Flip> {
        let flips = self.below.into_iter().chain(self.above);
        flips.min_by(|a, b| a.change.abs().total_cmp(&b.change.abs()))
    }
}

/// Looks for the smallest change of one setting that changes the verdict, until `stop` is set. A value that cannot be
/// flown is passed over, except the one to begin with.
///
/// # Errors
/// See [`BisectError`].
pub fn bisect(
    flight: &Recording,
    options: &BisectOptions,
    stop: &AtomicBool,
) -> Result<BisectReport, BisectError> {
    let path = &options.path;
    let prepared = Prepared::new(flight, &options.refly)?;
    let is_whole = prepared.is_whole(path)?;
    let reproduced = prepared.is_reproduced(&options.refly)?;
    let value = match options.value {
        Some(value) => value,
        None => prepared.number_of(path).ok_or_else(|| BisectError::NoValue { path: path.clone() })?,
    };
    let (from, to) = (options.from, options.to);
    if !(from..=to).contains(&value) {
        return Err(BisectError::Outside { path: path.clone(), value, from, to });
    }
    let mut search = Search { flight: prepared, options, is_whole, stop, flown: 0, refused: Vec::new() };
    let outcome = search.fly(value)?;
    let below = search.first_flip(value, from, outcome);
    let above = search.first_flip(value, to, outcome);
    let finest = if is_whole { 1.0 } else { 0.0 };
    let step = |end: f64| f64::max((end - value).abs() / f64::from(options.steps.max(1)), finest);
    Ok(BisectReport {
        kind: "closed loop: flown again in simulation",
        file: flight.name.clone(),
        reproduced,
        path: path.clone(),
        plant_alone: options.plant_alone,
        value,
        outcome,
        below,
        above,
        steps: (step(from), step(to)),
        flown: search.flown,
        refused: search.refused,
        interrupted: stop.load(Ordering::Relaxed),
    })
}

struct Search<'a> {
    flight: Prepared<'a>,
    options: &'a BisectOptions,
    is_whole: bool,
    stop: &'a AtomicBool,
    flown: usize,
    refused: Vec<RefusedValue>,
}

impl Search<'_> {
    fn fly(&mut self, value: f64) -> Result<FlightOutcome, BisectError> {
        let setting =
            Setting { path: self.options.path.clone(), value: toml::Value::Float(value), at_s: None };
        let mut refly_options = self.options.refly.clone();
        let settings = if self.options.plant_alone {
            &mut refly_options.plant_settings
        } else {
            &mut refly_options.settings
        };
        settings.push(setting);
        self.flown += 1;
        let report = self.flight.fly(&refly_options)?;
        Ok(FlightOutcome {
            landed: report.reflown.is_some_and(|verdict| verdict.landed),
            margin: report.margin,
        })
    }

    /// Moves from `value` by a distance; rounds down for whole numbers.
    fn onward(&self, value: f64, by: f64) -> f64 {
        value + if self.is_whole { libm::trunc(by) } else { by }
    }

    /// The outcome at a value; `None` if it cannot be flown, which is noted.
    fn tried(&mut self, value: f64) -> Option<FlightOutcome> {
        self.fly(value)
            .map_err(|error| self.refused.push(RefusedValue { value, reason: error.to_string() }))
            .ok()
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Steps from `value` towards `end` until the verdict changes, then halves the last step.
    fn first_flip(&mut self, value: f64, end: f64, outcome: FlightOutcome) -> Option<Flip> {
        let steps = self.options.steps.max(1);
        let mut same_at = value;
        for step in 1..=steps {
            let tried = self.onward(value, (end - value) * f64::from(step) / f64::from(steps));
            if tried.to_bits() == same_at.to_bits() {
                continue;
            }
            if self.is_stopped() {
                return None;
            }
            let Some(found) = self.tried(tried) else { continue };
            if found.landed == outcome.landed {
                same_at = tried;
                continue;
            }
            let (mut other_at, mut other) = (tried, found);
            for _ in 0..HALVINGS {
                let middle = self.onward(same_at, 0.5 * (other_at - same_at));
                let narrow = middle.to_bits() == same_at.to_bits() || middle.to_bits() == other_at.to_bits();
                if narrow || self.is_stopped() {
                    break;
                }
                let Some(there) = self.tried(middle) else { break };
                if there.landed == outcome.landed {
                    same_at = middle;
                } else {
                    (other_at, other) = (middle, there);
                }
            }
            return Some(Flip { same_at, other_at, change: other_at - value, outcome: other });
        }
        None
    }
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
        margin_words(report.outcome.margin)
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

/// The setting that is changed until the verdict flips.
#[derive(Debug, Args)]
#[group(id = "flipped")]
pub(super) struct Arguments {
    /// Look for the smallest change of this setting, named as in the mission, that turns landed into not landed, or back.
    #[arg(long, value_name = "PATH", requires_all = ["lowest", "highest"])]
    flip: Option<String>,
    /// Lowest value tried.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true, requires = "flip")]
    lowest: Option<f64>,
    /// Highest value tried.
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true, requires = "flip")]
    highest: Option<f64>,
    /// Value to begin with [default: the mission's value].
    #[arg(long, allow_negative_numbers = true, requires = "flip")]
    value: Option<f64>,
    /// Change the plant only; the controller does not know about the change.
    #[arg(long, requires = "flip")]
    of_plant: bool,
    /// Values tried on either side before the change is narrowed down.
    #[arg(long, value_name = "N", default_value_t = 32)]
    steps: u32,
}

impl Arguments {
    pub(super) fn is_asked(&self) -> bool {
        self.flip.is_some()
    }

    pub(super) fn run(&self, file: &Path, how: &FlownHow, json: bool) -> Result<Outcome> {
        let (Some(path), Some(from), Some(to)) = (self.flip.clone(), self.lowest, self.highest) else {
            bail!("--flip needs --lowest and --highest");
        };
        ensure!(from < to, "--lowest {from} must be below --highest {to}");
        let recording = Recording::open(file)?;
        warn_of_what_is_missing(&recording);
        let options = BisectOptions {
            path,
            plant_alone: self.of_plant,
            value: self.value,
            from,
            to,
            steps: self.steps,
            refly: how.options(StartAt::Landing)?,
        };
        let stop = stop_on_interrupt()?;
        let report = bisect(&recording, &options, &stop)?;
        answer(|output| if json { print_json(&report, output) } else { print_bisect(&report, output) })?;
        Ok(Outcome::Given)
    }
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
