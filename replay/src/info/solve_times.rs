//! Statistics of solve times.

use serde::Serialize;

/// Limit on the times kept for the percentiles: 8 MB, more than a day of flight at 10 Hz.
const TIMES_KEPT: usize = 1_000_000;

/// Durations of the ticks that solve, as measured on board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolveTimes {
    /// Number of measurements.
    pub count: u64,
    pub median_s: f64,
    /// 99th percentile, s.
    pub p99_s: f64,
    /// The longest, s.
    pub max_s: f64,
    /// The shortest deadline, s.
    pub deadline_s: f64,
    /// Number of ticks that missed their deadline.
    pub over_deadline: u64,
}

/// Counts solve times.
#[derive(Debug, Default)]
pub(super) struct SolveTimeCounter {
    times_s: Vec<f64>,
    count: u64,
    deadline_s: Option<f64>,
    over_deadline: u64,
}

impl SolveTimeCounter {
    pub(super) fn count(&mut self, time_s: f64, deadline_s: f64) {
        self.count += 1;
        if self.times_s.len() < TIMES_KEPT {
            self.times_s.push(time_s);
        }
        self.deadline_s = Some(self.deadline_s.map_or(deadline_s, |least_s| least_s.min(deadline_s)));
        self.over_deadline += u64::from(time_s > deadline_s);
    }

    /// `None` if nothing was measured.
    pub(super) fn into_facts(mut self) -> Option<SolveTimes> {
        self.times_s.sort_by(f64::total_cmp);
        Some(SolveTimes {
            count: self.count,
            median_s: percentile(&self.times_s, 50),
            p99_s: percentile(&self.times_s, 99),
            max_s: percentile(&self.times_s, 100),
            deadline_s: self.deadline_s?,
            over_deadline: self.over_deadline,
        })
    }
}

/// The smallest element that at least `percent` of 100 do not exceed (nearest rank).
fn percentile(sorted: &[f64], percent: usize) -> f64 {
    let rank = (sorted.len() * percent).div_ceil(100);
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_use_the_nearest_rank() {
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        for (percent, expected) in [(50, 50.0), (99, 99.0), (100, 100.0)] {
            assert_eq!(percentile(&hundred, percent).to_bits(), f64::to_bits(expected));
            assert_eq!(percentile(&[7.0], percent).to_bits(), 7.0_f64.to_bits());
        }
        assert!(percentile(&[], 50).is_nan());
    }
}
