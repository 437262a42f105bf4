//! A lot's posterior: the mean and the scatter of a motor's property, from few burns and the scatter that a set of
//! dispersions has.
//!
//! Normal values with an unknown mean and an unknown variance, with the conjugate normal-inverse-gamma prior; the next
//! value has a Student t distribution (A. Gelman et al., Bayesian Data Analysis, 3rd edition, section 3.3). The errors of the
//! fits count as scatter: they are a tenth of it and widen it by half a per cent.

use core::f64::consts::TAU;

use rand::Rng as _;
use rand_chacha::ChaCha12Rng;
use serde::Serialize;

/// The prior counts as this many burns for the mean: a lot's mean differs from the certified value as much as motors within
/// the lot differ from each other. (The certified curves of one motor, which are of different lots, differ by 3.75 % of
/// impulse; the set `field` has 2.5 % for the two together.)
const PRIOR_BURNS: f64 = 1.0;
/// Half the degrees of freedom of the prior's scatter: the fewest with which the next value has a variance, so that the
/// lot's own burns count soon.
const PRIOR_ALPHA: u32 = 2;

/// What is known of a normal distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lot {
    /// Expected mean.
    pub mean: f64,
    /// How many values the knowledge of the mean is worth.
    pub worth: f64,
    /// Degrees of freedom of the scatter, and of the next value's Student t.
    pub freedom: u32,
    /// Sum of squares that belongs to the degrees of freedom.
    pub squares: f64,
}

impl Lot {
    /// Before any burn: the next value has this mean and this standard deviation.
    pub fn prior(mean: f64, sigma: f64) -> Self {
        let alpha = f64::from(PRIOR_ALPHA);
        // The variance of the next value is squares / (2 alpha - 2) (1 + 1 / worth).
        let squares = 2.0 * sigma * sigma * (alpha - 1.0) / (1.0 + 1.0 / PRIOR_BURNS);
        Self { mean, worth: PRIOR_BURNS, freedom: 2 * PRIOR_ALPHA, squares }
    }

    /// With some values more.
    #[must_use]
    pub fn with(self, values: &[f64]) -> Self {
        values.iter().fold(self, |lot, value| {
            let missed = value - lot.mean;
            let worth = lot.worth + 1.0;
            Self {
                mean: lot.mean + missed / worth,
                worth,
                freedom: lot.freedom + 1,
                squares: lot.squares + missed * missed * lot.worth / worth,
            }
        })
    }

    /// Standard deviation of the next value.
    pub fn next_sigma(&self) -> f64 {
        libm::sqrt(self.squares / (f64::from(self.freedom) - 2.0) * (1.0 + 1.0 / self.worth))
    }

    /// Expected standard deviation within the lot (the root of the expected variance).
    pub fn scatter(&self) -> f64 {
        libm::sqrt(self.squares / (f64::from(self.freedom) - 2.0))
    }

    /// Standard deviation of the mean.
    pub fn mean_sigma(&self) -> f64 {
        self.scatter() / libm::sqrt(self.worth)
    }

    /// A mean and a standard deviation that the lot may have.
    pub fn draw(&self, chance: &mut Chance) -> (f64, f64) {
        let chi_squared: f64 = (0..self.freedom).map(|_| libm::pow(chance.normal(), 2.0)).sum();
        let sigma = libm::sqrt(self.squares / chi_squared.max(1e-9));
        (self.mean + sigma / libm::sqrt(self.worth) * chance.normal(), sigma)
    }
}

/// Random numbers on `libm`, the same on every machine.
pub struct Chance(pub ChaCha12Rng);

impl Chance {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        libm::sqrt(-2.0 * libm::log(1.0 - self.unit())) * libm::cos(TAU * self.unit())
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    /// A prior of 1 with 0.02, worth one value, 4 degrees: squares 0.0004. Values 1.02 and 0.99: the mean is (1 + 1.02 +
    /// 0.99) / 3; the squares grow by 0.02^2 / 2 and by 0.02^2 2/3.
    #[test]
    fn val_hand_two_burns() {
        let prior = Lot::prior(1.0, 0.02);
        assert!((prior.next_sigma() - 0.02).abs() < 1e-12 && (prior.squares - 0.0004).abs() < 1e-15);
        let lot = prior.with(&[1.02, 0.99]);
        assert!((lot.mean - 3.01 / 3.0).abs() < 1e-12);
        assert_eq!(lot.freedom, 6);
        assert!((lot.squares - (0.0004 + 0.0004 / 2.0 + 0.0004 * 2.0 / 3.0)).abs() < 1e-12, "{lot:?}");
        assert!((lot.next_sigma() - libm::sqrt(lot.squares / 4.0 * 4.0 / 3.0)).abs() < 1e-15);
    }

    /// Draws of a mean and a scatter, and then of a value, have the next value's variance.
    #[test]
    fn val_student_draws() {
        let mut chance = Chance(ChaCha12Rng::seed_from_u64(1));
        let lot = Lot::prior(0.0, 1.0).with(&[0.3, -0.2, 0.1, 0.5, -0.6, 0.2, 0.1, -0.4]);
        let count = 20_000;
        let squares = (0..count).map(|_| {
            let (mean, sigma) = lot.draw(&mut chance);
            libm::pow(mean + sigma * chance.normal() - lot.mean, 2.0)
        });
        let found = libm::sqrt(squares.sum::<f64>() / f64::from(count));
        assert!((found / lot.next_sigma() - 1.0).abs() < 0.03, "{found} {}", lot.next_sigma());
    }
}
