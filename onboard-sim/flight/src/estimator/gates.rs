//! Innovation gates: what does not fit is left out and counted; what keeps not fitting is the filter's fault.

use crate::memory::remembers;

/// What one gate has seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GateCounters {
    /// Measurements used.
    pub accepted: u32,
    /// Measurements left out, because they did not fit or were not numbers.
    pub rejected: u32,
    /// Left out since the last one that was used.
    pub rejected_in_a_row: u32,
}

/// The gates' counters, one a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gates {
    /// Inertial samples; one that no inertial unit can send is replaced by the one before.
    pub imu: GateCounters,
    /// Barometer.
    pub barometer: GateCounters,
    /// Satellite velocity, three numbers a fix.
    pub gnss_velocity: GateCounters,
    /// Satellite position, three numbers a fix.
    pub gnss_position: GateCounters,
    /// Lidar.
    pub lidar: GateCounters,
    /// Sideways force, for the wind.
    pub wind: GateCounters,
}

impl GateCounters {
    /// Counts a verdict and hands it on.
    pub(super) fn count(&mut self, accepted: bool) -> bool {
        if accepted {
            self.accepted = self.accepted.saturating_add(1);
            self.rejected_in_a_row = 0;
        } else {
            self.rejected = self.rejected.saturating_add(1);
            self.rejected_in_a_row = self.rejected_in_a_row.saturating_add(1);
        }
        accepted
    }
}

/// Whether satellite velocities still fit on average: single ones may all pass their gate and yet pull one way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surprise {
    mean: f64,
}

remembers!(Surprise { mean });

/// Share of the newest in the running mean of the normalised innovation squared.
const NEWEST: f64 = 0.1;
/// A mean this large has a chance of less than 1e-6 a fix in a filter that knows its errors (expected: 1).
const TOO_MUCH: f64 = 5.0;

impl Default for Surprise {
    fn default() -> Self {
        Self { mean: 1.0 }
    }
}

impl Surprise {
    /// Takes one normalised innovation squared. True when the filter has to doubt itself; then it starts afresh.
    pub(super) fn take(&mut self, normalised_squared: f64) -> bool {
        self.mean += NEWEST * (normalised_squared.min(100.0) - self.mean);
        let too_much = self.mean > TOO_MUCH;
        if too_much {
            self.mean = 1.0;
        }
        too_much
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_outlier_is_no_surprise_and_a_steady_pull_is() {
        let mut surprise = Surprise::default();
        assert!(!surprise.take(40.0));
        for _ in 0..50 {
            assert!(!surprise.take(1.0));
        }
        let pulls = (0..50).take_while(|_| !surprise.take(9.0)).count();
        assert!((4..=8).contains(&pulls), "{pulls}");
    }
}
