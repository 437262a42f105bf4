//! Makes residuals independent that a slow disturbance has correlated: gusts in the drag, air and play in the rotation.
//!
//! The disturbance is a linear process of two states with a known covariance. A Kalman filter that predicts each residual
//! from those before it leaves innovations, and those are independent. The filter's gains do not depend on the
//! residuals, so it is a linear map, and the generalised least squares of a fit are ordinary ones on the innovations
//! (A. C. Harvey, Forecasting, Structural Time Series Models and the Kalman Filter, 1989, section 3.4).

use nalgebra::{Matrix2, Vector2};

/// The disturbance between one sample and the next, and how the sample shows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct NoiseStep {
    /// How the states go over from the sample before to this one.
    pub(super) transition: Matrix2<f64>,
    /// Covariance that the states gain on the way.
    pub(super) process: Matrix2<f64>,
    /// The states begin again with this covariance: at the first sample, and after a gap.
    pub(super) begins: Option<Matrix2<f64>>,
    /// The sample's residual for a unit of each state.
    pub(super) seen: Vector2<f64>,
    /// Variance of the sample's own noise.
    pub(super) white: f64,
}

#[derive(Debug, Clone, Copy)]
struct Prediction {
    transition: Matrix2<f64>,
    begins: bool,
    seen: Vector2<f64>,
    gain: Vector2<f64>,
    variance: f64,
}

/// The filter of a series of samples.
#[derive(Debug, Clone)]
pub(super) struct Whitener {
    steps: Vec<Prediction>,
}

impl Whitener {
    pub(super) fn new(steps: impl Iterator<Item = NoiseStep>) -> Self {
        let mut covariance = Matrix2::zeros();
        let predictions = steps.map(|step| {
            covariance = match step.begins {
                Some(begins) => begins,
                None => step.transition * covariance * step.transition.transpose() + step.process,
            };
            let spread = covariance * step.seen;
            let variance = step.seen.dot(&spread) + step.white;
            let gain = spread / variance;
            covariance -= gain * spread.transpose();
            Prediction {
                transition: step.transition,
                begins: step.begins.is_some(),
                seen: step.seen,
                gain,
                variance,
            }
        });
        Self { steps: predictions.collect() }
    }

    /// The innovations of residuals, in units of their standard deviations.
    pub(super) fn apply(&self, residuals: &[f64]) -> Vec<f64> {
        let mut state = Vector2::zeros();
        self.steps
            .iter()
            .zip(residuals)
            .map(|(step, residual)| {
                state = if step.begins { Vector2::zeros() } else { step.transition * state };
                let innovation = residual - step.seen.dot(&state);
                state += step.gain * innovation;
                innovation / libm::sqrt(step.variance)
            })
            .collect()
    }

    /// Twice the negative logarithm of the likelihood of residuals, without its constant.
    pub(super) fn surprise(&self, residuals: &[f64]) -> f64 {
        let logarithms: f64 = self.steps.iter().map(|step| libm::log(step.variance)).sum();
        logarithms + self.apply(residuals).iter().map(|innovation| innovation * innovation).sum::<f64>()
    }
}

/// The place of the lowest value of a function with one minimum between two ends, by the golden section.
pub(super) fn lowest(from: f64, to: f64, rounds: usize, mut value: impl FnMut(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (from, to);
    let mut at = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let mut found = at.map(&mut value);
    for _ in 0..rounds {
        if found[0] <= found[1] {
            high = at[1];
            at = [high - GOLDEN * (high - low), at[0]];
            found = [value(at[0]), found[0]];
        } else {
            low = at[0];
            at = [at[1], low + GOLDEN * (high - low)];
            found = [found[1], value(at[1])];
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A process with variance 1 and correlation 1/2 from sample to sample, seen without noise: the first innovation is
    /// the value, the next is the value less half of the one before, over the root of 3/4.
    #[test]
    fn val_hand_innovations_of_a_first_order_process() {
        let step = |first: bool| NoiseStep {
            transition: Matrix2::from_diagonal_element(0.5),
            process: Matrix2::from_diagonal_element(0.75),
            begins: first.then(Matrix2::identity),
            seen: Vector2::new(1.0, 0.0),
            white: 0.0,
        };
        let whitener = Whitener::new([step(true), step(false), step(false)].into_iter());
        let found = whitener.apply(&[2.0, 1.0, -0.5]);
        let root = libm::sqrt(0.75);
        for (found, expected) in found.iter().zip([2.0, 0.0, -1.0 / root]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let surprise = whitener.surprise(&[2.0, 1.0, -0.5]);
        assert!((surprise - (2.0 * libm::log(0.75) + 4.0 + 1.0 / 0.75)).abs() < 1e-12, "{surprise}");
    }

    #[test]
    fn val_hand_the_lowest_place_of_a_parabola() {
        let at = lowest(-3.0, 5.0, 40, |x| (x - 1.25) * (x - 1.25));
        assert!((at - 1.25).abs() < 1e-6, "{at}");
    }
}
