//! Normal numbers from a seed, the same on every machine.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

/// Normal numbers by Box and Muller (Annals of Mathematical Statistics 29, 1958), on `libm` so that
/// they are the same on every machine.
#[derive(Debug, Clone)]
pub(crate) struct Normal<R = ChaCha12Rng> {
    random: R,
    /// The second number of the pair.
    spare: Option<f64>,
    sigma: f64,
}

impl Normal {
    /// The streams of a seed are independent, so a fault in one sensor does not change the noise of
    /// another.
    pub(crate) fn new(seed: u64, stream: u64, sigma: f64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self::of(random, sigma)
    }
}

impl<R: Rng> Normal<R> {
    pub(crate) fn of(random: R, sigma: f64) -> Self {
        Self { random, spare: None, sigma }
    }

    pub(crate) fn next(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * self.unit());
        self.spare = Some(self.sigma * (radius * sin));
        self.sigma * (radius * cos)
    }

    pub(crate) fn next3(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }

    pub(crate) fn unit(&mut self) -> f64 {
        unit(&mut self.random)
    }
}

/// Uniform in [0, 1), from 53 random bits.
pub(crate) fn unit(random: &mut impl Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
