//! How much flights may differ: a TOML file.
//!
//! ```toml
//! verdict = true          # the verdicts must agree; the default
//! missing = 0             # signals of the baseline that the other may lack; any number if left out
//! added = 0               # signals that the other may have besides
//!
//! [signals."vehicle_truth.state.x_m"]
//! rms = 0.01              # in the signal's own unit
//! max = 0.05
//!
//! [signals."controller_tick.output.*"]
//! max = 1e-9              # the longest pattern that fits a signal holds
//! ```

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

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
    missing: Option<usize>,
    added: Option<usize>,
    #[serde(default)]
    signals: BTreeMap<String, Tolerance>,
}

/// Why tolerances cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ToleranceError {
    /// Not the expected TOML.
    #[error("{origin}: {reason}")]
    Parse {
        /// The file.
        origin: String,
        /// The parser's words.
        reason: String,
    },
    /// No such signal.
    #[error("tolerance of `{given}`: neither flight has such a signal; the nearest is `{nearest}`")]
    Unknown {
        /// What was given.
        given: String,
        /// The signal most like it.
        nearest: String,
    },
    /// A limit that nothing can keep.
    #[error("tolerance of `{given}`: {found} must be a number, 0 or more")]
    Value {
        /// The signal.
        given: String,
        /// What was found.
        found: f64,
    },
}

impl Tolerances {
    /// Reads tolerances; `origin` is used in messages only.
    ///
    /// # Errors
    /// The text is not the expected TOML, or a limit is negative.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ToleranceError> {
        let tolerances: Self = toml::from_str(text).map_err(|error| ToleranceError::Parse {
            origin: origin.to_owned(),
            reason: error.to_string(),
        })?;
        for (given, tolerance) in &tolerances.signals {
            let limits = tolerance.rms.into_iter().chain(tolerance.max);
            for found in limits {
                if found.is_nan() || found < 0.0 {
                    return Err(ToleranceError::Value { given: given.clone(), found });
                }
            }
        }
        Ok(tolerances)
    }

    /// What is tolerated of a signal: the longest pattern that fits.
    pub fn of(&self, signal: &str) -> Option<Tolerance> {
        let fitting = self.signals.iter().filter(|(pattern, _)| fits(pattern, signal));
        fitting.max_by_key(|(pattern, _)| pattern.len()).map(|(_, tolerance)| *tolerance)
    }

    pub(super) fn verdict_must_agree(&self) -> bool {
        self.verdict.unwrap_or(true)
    }

    pub(super) fn count_failures(&self, missing: usize, added: usize) -> Vec<String> {
        let exceeded = |count: usize, limit: Option<usize>| limit.filter(|limit| count > *limit);
        let mut failures = Vec::new();
        if let Some(limit) = exceeded(missing, self.missing) {
            failures.push(format!("{missing} signals are missing (tolerated {limit})"));
        }
        if let Some(limit) = exceeded(added, self.added) {
            failures.push(format!("{added} signals are added (tolerated {limit})"));
        }
        failures
    }

    /// Every tolerance must fit some signal, or a misspelt one would tolerate everything.
    pub(super) fn check_names<'a>(
        &self,
        signals: &(impl Iterator<Item = &'a String> + Clone),
    ) -> Result<(), ToleranceError> {
        for given in self.signals.keys() {
            if signals.clone().any(|signal| fits(given, signal)) {
                continue;
            }
            let nearest = signals
                .clone()
                .max_by(|a, b| strsim::jaro_winkler(given, a).total_cmp(&strsim::jaro_winkler(given, b)));
            let nearest = nearest.cloned().unwrap_or_default();
            return Err(ToleranceError::Unknown { given: given.clone(), nearest });
        }
        Ok(())
    }
}

/// A `*` at the end fits any rest.
fn fits(pattern: &str, signal: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(beginning) => signal.starts_with(beginning),
        None => pattern == signal,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_pattern_holds() {
        let text = "[signals.\"a.*\"]\nmax = 1.0\n[signals.\"a.b\"]\nmax = 2.0\n";
        let tolerances = Tolerances::from_toml(text, "t.toml").unwrap();
        assert_eq!(tolerances.of("a.b").unwrap().max, Some(2.0));
        assert_eq!(tolerances.of("a.c").unwrap().max, Some(1.0));
        assert_eq!(tolerances.of("b"), None);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let refusal = |text| Tolerances::from_toml(text, "t.toml").unwrap_err().to_string();
        assert!(refusal("verdikt = true").contains("verdikt"));
        assert!(refusal("[signals.a]\nmax = -1.0").contains('a'));
        let signals = ["vehicle_truth.state.x_m".to_owned()];
        let tolerances = Tolerances::from_toml("[signals.\"vehicle_truth.x_m\"]\nmax = 1.0", "t").unwrap();
        let refusal = tolerances.check_names(&signals.iter()).unwrap_err().to_string();
        assert!(refusal.contains("the nearest is `vehicle_truth.state.x_m`"), "{refusal}");
    }
}
