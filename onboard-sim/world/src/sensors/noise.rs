//! Noise from a seed: white noise and slow wander.

use nalgebra::Vector3;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

/// Standard normal numbers by Box and Muller, on `libm` so that they are the same on every machine.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    random: ChaCha12Rng,
    /// The second number of the pair.
    spare: Option<f64>,
}

impl Normal {
    /// The streams of a seed are independent, so a fault in one sensor does not change the noise of another.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self { random, spare: None }
    }

    pub(super) fn next(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * self.unit());
        self.spare = Some(radius * sin);
        radius * cos
    }

    pub(super) fn next3(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }

    /// Uniform in [0, 1), from 53 random bits.
    pub(super) fn unit(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A stationary first-order Gauss-Markov process: its correlation decays exponentially.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wander {
    pub(super) value: f64,
    sigma: f64,
    correlation_s: f64,
}

impl Wander {
    /// Starts from its stationary distribution.
    pub(super) fn new(sigma: f64, correlation_s: f64, normal: &mut Normal) -> Self {
        Self { value: sigma * normal.next(), sigma, correlation_s }
    }

    /// Advances over an interval of any length, exactly.
    pub(super) fn advance(&mut self, interval_s: f64, normal: &mut Normal) {
        let kept = libm::exp(-interval_s / self.correlation_s);
        self.value = self.value * kept + self.sigma * libm::sqrt(1.0 - kept * kept) * normal.next();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let mut normal = Normal::new(3, 0);
        let n = 40_000;
        let draws: Vec<f64> = (0..n).map(|_| normal.next()).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        // Four standard errors.
        assert!(mean.abs() < 4.0 / 200.0, "{mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0f64 / f64::from(n)).sqrt(), "{variance}");
    }

    #[test]
    fn the_wander_is_stationary_and_its_correlation_decays_at_the_stated_rate() {
        let mut normal = Normal::new(5, 1);
        let (mut squares, mut products) = (0.0, 0.0);
        let n = 20_000;
        for _ in 0..n {
            let mut wander = Wander::new(2.0, 10.0, &mut normal);
            let before = wander.value;
            wander.advance(5.0, &mut normal);
            squares += wander.value * wander.value;
            products += wander.value * before;
        }
        let n = f64::from(n);
        assert!((squares / n / 4.0 - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", squares / n);
        // exp(-1/2); the product's standard deviation is below 1.2.
        assert!((products / n / 4.0 - 0.606_530_66).abs() < 4.0 * 1.2 / n.sqrt(), "{}", products / n);
    }
}
