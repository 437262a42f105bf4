//! Statistics of how long the controller's ticks took.

/// Measured tick times of one flight, s.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolveTimes {
    times_s: Vec<f64>,
    missed: u64,
}

impl SolveTimes {
    /// Adds one.
    pub fn add(&mut self, time_s: f64, deadline_s: f64) {
        self.times_s.push(time_s);
        self.missed += u64::from(time_s > deadline_s);
    }

    /// Ticks that took longer than their deadline.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Median, 99th percentile and worst, s; `None` before the first tick.
    pub fn quantiles_s(&self) -> Option<[f64; 3]> {
        let mut sorted = self.times_s.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        // Nearest rank: a value that was measured, not an interpolation.
        let at = |percent: usize| sorted[(percent * sorted.len()).div_ceil(100).saturating_sub(1).min(last)];
        Some([at(50), at(99), sorted[last]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_measured_values() {
        let mut times = SolveTimes::default();
        assert_eq!(times.quantiles_s(), None);
        for k in (1..=100).rev() {
            times.add(f64::from(k), 99.5);
        }
        assert_eq!(times.quantiles_s(), Some([50.0, 99.0, 100.0]));
        assert_eq!(times.missed(), 1);
    }
}
