//! Standard normal numbers (Box and Muller 1958), two at a time.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

#[derive(Debug, Clone)]
pub(super) struct Normals {
    random: ChaCha8Rng,
    spare: Option<f64>,
}

impl Normals {
    pub(super) fn new(random: ChaCha8Rng) -> Self {
        Self { random, spare: None }
    }

    pub(super) fn next(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // 53 bits each; the first is never zero, because its logarithm is taken.
        let unit = |bits: u64| (bits >> 11) as f64 / (1_u64 << 53) as f64;
        let radius = (-2.0 * libm::log(1.0 - unit(self.random.next_u64()))).sqrt();
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * unit(self.random.next_u64()));
        self.spare = Some(radius * sin);
        radius * cos
    }
}
