//! Removes pressure spikes before any use of the barometer.
//!
//! Recorded barometers show single samples that are off by up to kilometres. A sample that the
//! vehicle cannot have reached since the last one is held back until [`AGREEING`] in a row agree
//! with each other: then the pressure has really changed, as after the firing of a charge.

use serde::Serialize;

/// Change of the height between two samples that noise and flow explain, m.
const STEP_M: f64 = 15.0;
/// Fastest climb or fall of a model rocket, m/s: beyond Mach 1 static ports show anything.
const SPEED_MAX_M_S: f64 = 400.0;
/// Samples that have to agree.
const AGREEING: u32 = 3;

with_defaults! {
    /// The last samples.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
    pub(crate) struct SpikeFilter {
        accepted: Sample = Sample::NONE,
        /// The last sample that was held back, and how many agreed with it.
        held: Sample = Sample::NONE,
        agreeing: u32 = 0,
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Sample {
    height_m: f64,
    time_s: f64,
}

impl Sample {
    const NONE: Self = Self { height_m: f64::NAN, time_s: f64::NAN };

    fn reaches(self, next: Self) -> bool {
        let change_m = (next.height_m - self.height_m).abs();
        change_m <= STEP_M + SPEED_MAX_M_S * (next.time_s - self.time_s)
    }
}

impl SpikeFilter {
    /// Returns a frame's pressure altitude, m, unless it is a spike or not a number.
    pub(crate) fn take(&mut self, altitude_m: Option<f64>, time_s: f64) -> Option<f64> {
        let sample = Sample { height_m: altitude_m.filter(|height_m| height_m.is_finite())?, time_s };
        let first = self.accepted.height_m.is_nan();
        if !first && !self.accepted.reaches(sample) {
            self.agreeing = if self.held.reaches(sample) { self.agreeing + 1 } else { 1 };
            self.held = sample;
            if self.agreeing < AGREEING {
                return None;
            }
        }
        (self.accepted, self.held, self.agreeing) = (sample, Sample::NONE, 0);
        altitude_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The accepted heights of samples at 50 Hz.
    fn accepted(heights_m: &[f64]) -> Vec<f64> {
        let mut filter = SpikeFilter::default();
        let samples = heights_m.iter().enumerate();
        samples.filter_map(|(at, height_m)| filter.take(Some(*height_m), 0.02 * at as f64)).collect()
    }

    #[test]
    fn one_or_two_wrong_samples_are_removed_and_a_step_is_accepted() {
        assert_eq!(accepted(&[1.0, 2.0, 3_000.0, 3.0]), [1.0, 2.0, 3.0]);
        assert_eq!(accepted(&[1.0, -3_000.0, -2_990.0, 1.5, 2.0]), [1.0, 1.5, 2.0]);
        assert_eq!(accepted(&[1.0, 900.0, -900.0, 900.0, 2.0]), [1.0, 2.0]);
        assert_eq!(accepted(&[1.0, 300.0, 301.0, 302.0, 303.0]), [1.0, 302.0, 303.0]);
        assert_eq!(accepted(&[1.0, f64::NAN, 2.0]), [1.0, 2.0]);
    }

    #[test]
    fn a_fast_climb_passes() {
        let climb: Vec<f64> = (0..100).map(|sample| 6.8 * f64::from(sample)).collect();
        assert_eq!(accepted(&climb), climb);
    }
}
