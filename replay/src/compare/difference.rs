//! The difference between two signals.

use serde::Serialize;

use super::{Samples, Series, Tolerance};

/// The difference of one signal between two flights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalDifference {
    pub signal: String,
    /// Times compared.
    pub samples: usize,
    /// Times of the baseline at which the other has no value.
    pub samples_outside: usize,
    /// Samples that only one of the two has.
    #[serde(flatten)]
    pub samples_of_both: Samples,
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
            samples_of_both: Samples::of(a, b, shift_s),
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
