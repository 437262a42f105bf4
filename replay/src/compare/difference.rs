//! The difference of one signal between two flights.

use serde::Serialize;

use super::Series;

/// The difference of one signal between two flights.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
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
}

impl SignalDifference {
    pub(super) fn of(signal: &str, a: &Series, b: &Series, shift_s: f64) -> Self {
        let mut found = Self {
            signal: signal.to_owned(),
            samples_of: [a.times_s.len(), b.times_s.len()],
            ..Self::default()
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
        found
    }

    /// Whether both flights have the same samples.
    pub(super) fn is_identical(&self) -> bool {
        let [ours, theirs] = self.samples_of;
        self.max == 0.0 && !self.not_comparable && ours == theirs
    }
}
