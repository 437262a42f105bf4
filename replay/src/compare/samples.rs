//! Finds the samples of a signal that only one of two flights has.
//!
//! Interpolation hides a lost record, so samples are counted: each sample of the first flight is paired with the sample
//! of the second flight at the same time, to within half a period.

use serde::Serialize;

use super::Series;

/// Fraction of a period: samples of flights aligned on an event are up to half a period apart.
const PERIOD_SHARE: f64 = 0.6;
/// Tolerance for rounding: times are sums of periods.
const SAME_S: f64 = 5e-7;

/// Samples of a signal in two flights.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Samples {
    /// Samples of the baseline.
    #[serde(rename = "samples_expected")]
    pub expected: usize,
    /// Baseline samples that the other flight lacks.
    #[serde(rename = "samples_missing")]
    pub missing: usize,
    /// Samples that only the other flight has.
    #[serde(rename = "samples_added")]
    pub added: usize,
}

impl Samples {
    /// Pairs the samples of two signals; `shift_s` is added to the second's times.
    pub(super) fn of(a: &Series, b: &Series, shift_s: f64) -> Self {
        let (ours, theirs) = (&a.times_s, &b.times_s);
        let mut paired = 0;
        if ours.len() == 1 && theirs.len() == 1 {
            // A value recorded once has no period, and may come before the event on which flights are aligned.
            paired = 1;
        } else {
            let period_s = typical_period_s(ours).min(typical_period_s(theirs));
            let near_s = SAME_S + PERIOD_SHARE * period_s;
            let mut waiting = theirs.iter().map(|time_s| time_s + shift_s).peekable();
            for time_s in ours {
                while waiting.next_if(|other_s| *other_s < time_s - near_s).is_some() {}
                paired += usize::from(waiting.next_if(|other_s| *other_s <= time_s + near_s).is_some());
            }
        }
        Self { expected: ours.len(), missing: ours.len() - paired, added: theirs.len() - paired }
    }

    /// The share of the baseline's samples that is missing.
    pub(super) fn missing_share(self) -> f64 {
        share(self.missing, self.expected)
    }

    /// The share of the other's samples that is added.
    pub(super) fn added_share(self) -> f64 {
        share(self.added, self.expected - self.missing + self.added)
    }
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

/// The median step between times; infinite for a single time.
fn typical_period_s(times_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(ours: &[f64], theirs: &[f64]) -> (usize, usize) {
        let series = |times: &[f64]| Series { times_s: times.to_vec(), values: times.to_vec(), whole: false };
        let samples = Samples::of(&series(ours), &series(theirs), 0.0);
        assert_eq!(samples.expected, ours.len());
        (samples.missing, samples.added)
    }

    #[test]
    fn samples_are_paired_once_and_by_their_times() {
        let whole: Vec<f64> = (0..10).map(f64::from).collect();
        let half: Vec<f64> = (0..5).map(|place| 2.0 * f64::from(place)).collect();
        assert_eq!(found(&whole, &whole), (0, 0));
        assert_eq!(found(&whole, &half), (5, 0));
        assert_eq!(found(&half, &whole), (0, 5));
        let shifted: Vec<f64> = whole.iter().map(|time_s| time_s + 0.5).collect();
        assert_eq!(found(&whole, &shifted), (0, 0));
        let mut hole = whole.clone();
        hole.remove(4);
        assert_eq!((found(&whole, &hole), found(&hole, &whole)), ((1, 0), (0, 1)));
        assert_eq!(found(&whole, &whole[..7]), (3, 0));
        assert_eq!(found(&whole, &[]), (10, 0));
        assert_eq!(found(&[0.0], &[7.0]), (0, 0));
        // Two records at the same time count as two.
        assert_eq!(found(&[0.0, 0.0, 1.0], &[0.0, 1.0]), (1, 0));
    }
}
