//! How much flights may differ: a TOML file.
//!
//! ```toml
//! verdict = true          # the verdicts must agree; the default
//! missing = 0             # signals of the baseline that the other may lack; none if left out
//! added = 0               # additional signals that the other may have; none if left out
//! damaged = true          # damaged logs, and logs that end before their flight did, may be compared; not if left out
//!
//! [signals."vehicle_truth3d.state.position_m.x"]
//! rms = 0.01              # in the signal's own unit
//! max = 0.05
//!
//! [signals."computer_frame.output.*"]
//! max = 1e-9              # of several patterns that fit a signal, the longest applies
//! ```

use std::collections::BTreeMap;

use anyhow::{Result, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};

use super::{Flown, Series};
use crate::print::{counted, nearest};

/// How much one signal may differ, in its own unit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// Root mean square.
    pub rms: Option<f64>,
    /// Largest difference.
    pub max: Option<f64>,
}

/// How much two flights may differ.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerances {
    verdict: Option<bool>,
    #[serde(default)]
    missing: usize,
    #[serde(default)]
    added: usize,
    #[serde(default)]
    damaged: bool,
    #[serde(default)]
    signals: BTreeMap<String, Tolerance>,
}

impl Tolerances {
    /// Reads tolerances; `origin` is used in messages only.
    ///
    /// # Errors
    /// The text is not the expected TOML, or a limit is negative.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self> {
        let tolerances: Self = toml::from_str(text).map_err(|error| anyhow!("{origin}: {error}"))?;
        for (given, tolerance) in &tolerances.signals {
            let limits = tolerance.rms.into_iter().chain(tolerance.max);
            for found in limits {
                ensure!(found >= 0.0, "tolerance of `{given}`: {found} must be a number, 0 or more");
            }
        }
        Ok(tolerances)
    }

    /// The tolerance of a signal: that of the longest pattern that matches.
    pub fn of(&self, signal: &str) -> Option<Tolerance> {
        let fitting = self.signals.iter().filter(|(pattern, _)| fits(pattern, signal));
        fitting.max_by_key(|(pattern, _)| pattern.len()).map(|(_, tolerance)| *tolerance)
    }

    pub(super) fn verdict_must_agree(&self) -> bool {
        self.verdict.unwrap_or(true)
    }

    pub(super) fn count_failures(&self, missing: usize, added: usize) -> Vec<String> {
        let words = |(word, count, limit): (&str, usize, usize)| {
            let signals = counted(count as u64, "signal");
            (count > limit).then(|| format!("{signals} {word} (tolerated {limit})"))
        };
        let both = [("missing", missing, self.missing), ("added", added, self.added)];
        both.into_iter().filter_map(words).collect()
    }

    /// Parts of the flights that were not compared because of damage or a missing end.
    pub(super) fn record_failures(&self, flights: [&Flown; 2]) -> Vec<String> {
        let mut failures = Vec::new();
        for Flown { name, damage, cut, out_of_order, .. } in flights {
            if *out_of_order > 0 {
                let words = format!("{name}: {out_of_order} numbers are out of order and were not compared");
                failures.push(words);
            }
            let damage = damage.as_ref().filter(|_| !self.damaged);
            failures.extend(
                damage.map(|damage| format!("{name} is damaged: {damage}; nothing after that was compared")),
            );
            let cut = cut.as_ref().filter(|_| !self.damaged);
            failures.extend(cut.map(|cut| format!("{name} is of an INCOMPLETE flight: it {cut}")));
        }
        failures.dedup();
        failures
    }

    /// Every tolerance must match some signal; otherwise a misspelt name would go unnoticed.
    pub(super) fn check_names<'a>(&self, signals: &(impl Iterator<Item = &'a String> + Clone)) -> Result<()> {
        let is_unknown = |given: &&String| !signals.clone().any(|signal| fits(given, signal));
        let Some(given) = self.signals.keys().find(is_unknown) else { return Ok(()) };
        let nearest = nearest(given, signals.clone());
        bail!("tolerance of `{given}`: neither flight has such a signal; the nearest is `{nearest}`")
    }
}

/// A `*` at the end matches any rest.
fn fits(pattern: &str, signal: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(beginning) => signal.starts_with(beginning),
        None => pattern == signal,
    }
}

/// The difference of one signal between two flights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalDifference {
    pub signal: String,
    /// Times compared.
    pub samples: usize,
    /// Times of the baseline at which the other has no value.
    pub samples_outside: usize,
    /// All samples of the baseline and of the other.
    pub samples_of: [usize; 2],
    /// Root mean square of the difference, in the signal's unit.
    pub rms: f64,
    /// The largest difference.
    pub max: f64,
    /// When the largest difference occurs, vehicle time of the baseline, s.
    pub max_at_s: Option<f64>,
    /// At some time one of the two is NaN and the other is not.
    pub not_comparable: bool,
    /// The tolerance of this signal.
    pub tolerance: Option<Tolerance>,
    /// Whether the difference is within the tolerance.
    pub passed: bool,
}

impl SignalDifference {
    pub(super) fn of(
        signal: &str,
        a: &Series,
        b: &Series,
        shift_s: f64,
        tolerance: Option<Tolerance>,
    ) -> Self {
        let mut found = Self {
            signal: signal.to_owned(),
            samples: 0,
            samples_outside: 0,
            samples_of: [a.times_s.len(), b.times_s.len()],
            rms: 0.0,
            max: 0.0,
            max_at_s: None,
            not_comparable: false,
            tolerance,
            passed: true,
        };
        let mut squares = 0.0;
        for (time_s, value) in a.times_s.iter().zip(&a.values) {
            let Some(other) = b.at(time_s - shift_s) else {
                found.samples_outside += 1;
                continue;
            };
            found.samples += 1;
            let difference = (value - other).abs();
            if difference.is_nan() {
                // Two NaNs agree, and so do two equal infinities.
                let agree = value.to_bits() == other.to_bits() || (value.is_nan() && other.is_nan());
                found.not_comparable |= !agree;
                continue;
            }
            squares += difference * difference;
            if difference > found.max {
                found.max = difference;
                found.max_at_s = Some(*time_s);
            }
        }
        if found.samples > 0 {
            found.rms = libm::sqrt(squares / found.samples as f64);
        }
        found.passed = tolerance.is_none_or(|tolerance| {
            let within = |value: f64, limit: Option<f64>| limit.is_none_or(|limit| value <= limit);
            !found.not_comparable
                && found.samples > 0
                && within(found.rms, tolerance.rms)
                && within(found.max, tolerance.max)
        });
        found
    }

    /// Whether both flights have the same samples.
    pub(super) fn is_identical(&self) -> bool {
        let [ours, theirs] = self.samples_of;
        self.max == 0.0 && !self.not_comparable && self.passed && ours == theirs
    }

    /// Why the difference is not tolerated, in words.
    pub(super) fn failure(&self) -> Option<String> {
        if self.passed {
            return None;
        }
        if self.samples == 0 {
            return Some(format!("{}: no time at which both flights have it", self.signal));
        }
        if self.not_comparable {
            return Some(format!("{}: not a number in one of the flights", self.signal));
        }
        let limit = |limit: Option<f64>| limit.map_or_else(|| "any".to_owned(), |limit| format!("{limit}"));
        let tolerance = self.tolerance.unwrap_or_default();
        let at = self.max_at_s.map(|at_s| format!(" at {at_s:.3} s")).unwrap_or_default();
        Some(format!(
            "{}: rms {:.4e} (tolerated {}), max {:.4e}{at} (tolerated {})",
            self.signal,
            self.rms,
            limit(tolerance.rms),
            self.max,
            limit(tolerance.max)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_matching_pattern_applies() {
        let text = "[signals.\"a.*\"]\nmax = 1.0\n[signals.\"a.b\"]\nmax = 2.0\n";
        let tolerances = Tolerances::from_toml(text, "t.toml").unwrap();
        assert_eq!(tolerances.of("a.b").unwrap().max, Some(2.0));
        assert_eq!(tolerances.of("a.c").unwrap().max, Some(1.0));
        assert_eq!(tolerances.of("b"), None);
    }

    #[test]
    fn a_wrong_tolerance_is_named() {
        let refusal = |text| Tolerances::from_toml(text, "t.toml").unwrap_err().to_string();
        assert!(refusal("verdikt = true").contains("verdikt"));
        assert!(refusal("[signals.a]\nmax = -1.0").contains('a'));
        let signals = ["vehicle_truth.state.x_m".to_owned()];
        let tolerances = Tolerances::from_toml("[signals.\"vehicle_truth.x_m\"]\nmax = 1.0", "t").unwrap();
        let refusal = tolerances.check_names(&signals.iter()).unwrap_err().to_string();
        assert!(refusal.contains("the nearest is `vehicle_truth.state.x_m`"), "{refusal}");
    }
}
