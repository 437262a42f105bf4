//! Innovation gates: a measurement that does not fit is rejected and counted. If a sensor is rejected many times in a
//! row, the filter is wrong.

use crate::computer::memory::remembers;

/// The counts of one gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GateCounters {
    /// Measurements used.
    pub accepted: u32,
    /// Measurements rejected, because they did not fit or were not numbers.
    pub rejected: u32,
    /// Measurements rejected since the last accepted measurement.
    pub rejected_in_a_row: u32,
}

/// The counts of all gates, one for each sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gates {
    /// Inertial samples; an impossible sample is replaced by the sample before it.
    pub imu: GateCounters,
    pub barometer: GateCounters,
    /// Satellite velocity, three numbers a fix.
    pub gnss_velocity: GateCounters,
    /// Satellite position, three numbers a fix.
    pub gnss_position: GateCounters,
    pub lidar: GateCounters,
    /// Sideways force, for the wind.
    pub wind: GateCounters,
}

impl GateCounters {
    /// Counts a verdict and returns it.
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

/// Whether satellite velocities still fit on average. Each of them may pass its gate although together they differ too
/// much from their predictions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Surprise {
    mean: f64,
}

remembers!(Surprise { mean });

/// Weight of the newest value in the running mean of the normalised innovation squared. Halved and doubled: 144, 144.
const NEWEST: f64 = 0.1;
/// In a consistent filter a mean this large has a probability below 1e-6 per fix (the expected mean is 1).
/// Halved and doubled: 142, 144.
const TOO_MUCH: f64 = 5.0;

impl Default for Surprise {
    fn default() -> Self {
        Self { mean: 1.0 }
    }
}

impl Surprise {
    /// Takes one normalised innovation squared. Returns true when the filter must increase its uncertainty; the mean
    /// then starts again.
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
    fn a_steady_pull_is_detected_and_one_outlier_is_not() {
        let mut surprise = Surprise::default();
        assert!(!surprise.take(40.0));
        for _ in 0..50 {
            assert!(!surprise.take(1.0));
        }
        let pulls = (0..50).take_while(|_| !surprise.take(9.0)).count();
        assert!((4..=8).contains(&pulls), "{pulls}");
    }
}
