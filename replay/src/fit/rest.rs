//! The process of the rotation that the model does not explain (gusts, what the exhaust does to the fins): how strong it is,
//! how long it lasts and how rough it is, and what that uncertainty adds to the parameters.
//!
//! One burn shows only a few gusts, so the strength of the rest is known badly, and an interval made with its most likely
//! value is too narrow. Its three numbers are judged by the restricted likelihood, in which the parameters are integrated
//! out (H. D. Patterson and R. Thompson, Biometrika 58, 1971; D. A. Harville, Journal of the American Statistical Association
//! 72, 1977), and the parameters' posterior is the mixture over a grid of them, each point with its weight: mean `sum w x`,
//! covariance `sum w (C + (x - mean)(x - mean)')`.

use flight::computer::FRAME_S;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::least_squares::{Prior, Solution};
use super::whiten::{NoiseStep, Whitener};

/// The three numbers of the process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rest {
    pub(super) sigma_rad_s2: f64,
    pub(super) lasts_s: f64,
    /// Density of what has no memory, rad/s^2/sqrt(Hz).
    pub(super) rough: f64,
}

/// Where the numbers are looked for, as logarithms: sigma, duration, roughness. All of it is about equally likely beforehand.
const LOWEST: [f64; 3] = [0.01, 0.02, 1e-4];
const HIGHEST: [f64; 3] = [30.0, 5.0, 1.0];
/// Points of the grid on each side of the most likely one, and their spacing in standard deviations.
const SIDE: i32 = 2;
const SPACING: f64 = 1.0;
/// Step of the curvature of the likelihood, as a logarithm.
const CURVATURE_STEP: f64 = 0.2;
/// The likelihood may be flat: no standard deviation of a logarithm counts as more.
const WIDEST: f64 = 1.5;

impl Rest {
    pub(super) fn whitener(&self, frames: usize, white: f64) -> Whitener {
        let kept = libm::exp(-FRAME_S / self.lasts_s);
        let variance = self.sigma_rad_s2 * self.sigma_rad_s2;
        let steps = (0..frames).map(|frame| NoiseStep {
            transition: Matrix2::new(1.0, FRAME_S, 0.0, kept),
            process: Matrix2::new(
                self.rough * self.rough * FRAME_S,
                0.0,
                0.0,
                variance * (1.0 - kept * kept),
            ),
            // The rate at the beginning, and the gyro's bias with it, is free.
            begins: (frame == 0).then(|| Matrix2::new(1.0, 0.0, 0.0, variance)),
            // The gyro has the mean over the frame.
            seen: Vector2::new(1.0, -0.5 * FRAME_S),
            white,
        });
        Whitener::new(steps)
    }

    fn of(logarithms: [f64; 3]) -> Self {
        let [sigma_rad_s2, lasts_s, rough] = core::array::from_fn(|place| {
            let (low, high): (f64, f64) = (LOWEST[place], HIGHEST[place]);
            libm::exp(logarithms[place].clamp(libm::log(low), libm::log(high)))
        });
        Self { sigma_rad_s2, lasts_s, rough }
    }

    fn logarithms(&self) -> [f64; 3] {
        [self.sigma_rad_s2, self.lasts_s, self.rough].map(libm::log)
    }
}

/// The model as a straight line around some values: residuals of the two axes and their slopes, not whitened, and what has no
/// process (feedback), whitened.
pub(super) struct Line<'a> {
    pub(super) values: &'a [f64],
    pub(super) priors: &'a [Prior],
    pub(super) missed: [Vec<f64>; 2],
    /// One column a parameter.
    pub(super) slopes: [DMatrix<f64>; 2],
    pub(super) other: Vec<f64>,
    pub(super) other_slopes: DMatrix<f64>,
    /// Variance of a gyro's sample.
    pub(super) white: f64,
}

/// The posterior of the parameters' changes with a known process.
struct Known {
    change: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Twice the negative logarithm of the restricted likelihood, without its constant.
    surprise: f64,
}

impl Line<'_> {
    fn known(&self, rest: Rest) -> Option<Known> {
        let count = self.priors.len();
        let whitener = rest.whitener(self.missed[0].len(), self.white);
        let mut information = self.other_slopes.tr_mul(&self.other_slopes);
        let mut gradient = self.other_slopes.tr_mul(&DVector::from_column_slice(&self.other));
        let mut surprise = 0.0;
        for (missed, slopes) in self.missed.iter().zip(&self.slopes) {
            surprise += whitener.surprise(missed);
            let missed = DVector::from_vec(whitener.apply(missed));
            let columns: Vec<DVector<f64>> = slopes
                .column_iter()
                .map(|column| DVector::from_vec(whitener.apply(column.as_slice())))
                .collect();
            let slopes = DMatrix::from_columns(&columns);
            information += slopes.tr_mul(&slopes);
            gradient += slopes.tr_mul(&missed);
        }
        for place in 0..count {
            let prior = self.priors[place];
            let precision = 1.0 / (prior.sigma * prior.sigma);
            information[(place, place)] += precision;
            gradient[place] += (self.values[place] - prior.mean) * precision;
        }
        let factor = information.cholesky()?;
        let change = -factor.solve(&gradient);
        let spread = 2.0 * factor.l().diagonal().iter().map(|value| libm::log(*value)).sum::<f64>();
        surprise += gradient.dot(&change) + spread;
        surprise.is_finite().then(|| Known { change, covariance: factor.inverse(), surprise })
    }

    fn surprise(&self, logarithms: [f64; 3]) -> f64 {
        self.known(Rest::of(logarithms)).map_or(f64::INFINITY, |known| known.surprise)
    }

    /// The most likely process, from a first guess: each number in turn, in steps that are halved.
    pub(super) fn most_likely(&self, from: Rest) -> Rest {
        let mut at = from.logarithms();
        let mut lowest = self.surprise(at);
        let mut step = 1.0;
        while step > 0.05 {
            let before = lowest;
            for place in 0..3 {
                for by in [step, -step] {
                    let mut tried = at;
                    tried[place] =
                        (at[place] + by).clamp(libm::log(LOWEST[place]), libm::log(HIGHEST[place]));
                    let found = self.surprise(tried);
                    if found < lowest {
                        (at, lowest) = (tried, found);
                        break;
                    }
                }
            }
            if before - lowest < 0.01 {
                step *= 0.5;
            }
        }
        Rest::of(at)
    }

    /// The posterior, with the process integrated out around its most likely numbers.
    pub(super) fn posterior(&self, most_likely: Rest) -> Option<Solution> {
        let centre = most_likely.logarithms();
        let lowest = self.surprise(centre);
        let spread: [f64; 3] = core::array::from_fn(|place| {
            let beside = |by: f64| {
                let mut at = centre;
                at[place] += by;
                self.surprise(at)
            };
            let curvature = (beside(CURVATURE_STEP) + beside(-CURVATURE_STEP) - 2.0 * lowest)
                / (2.0 * CURVATURE_STEP * CURVATURE_STEP);
            // Half of the second derivative of twice the logarithm is one over the variance.
            if curvature > 1.0 / (WIDEST * WIDEST) { 1.0 / libm::sqrt(curvature) } else { WIDEST }
        });
        let side = || -SIDE..=SIDE;
        let points = side().flat_map(|a| side().flat_map(move |b| side().map(move |c| [a, b, c])));
        let known: Vec<Known> = points
            .filter_map(|point| {
                let at: [f64; 3] =
                    core::array::from_fn(|k| centre[k] + SPACING * f64::from(point[k]) * spread[k]);
                let inside = (0..3)
                    .all(|k| at[k] >= libm::log(LOWEST[k]) - 1e-9 && at[k] <= libm::log(HIGHEST[k]) + 1e-9);
                if inside { self.known(Rest::of(at)) } else { None }
            })
            .collect();
        let least = known.iter().map(|known| known.surprise).fold(f64::INFINITY, f64::min);
        let weight = |known: &Known| libm::exp(-0.5 * (known.surprise - least));
        let total: f64 = known.iter().map(weight).sum();
        let count = self.priors.len();
        let zero = DVector::zeros(count);
        let change = known.iter().fold(zero, |sum, known| sum + &known.change * (weight(known) / total));
        let covariance = known.iter().fold(DMatrix::zeros(count, count), |sum, known| {
            let off = &known.change - &change;
            sum + (&known.covariance + &off * off.transpose()) * (weight(known) / total)
        });
        let values = self.values.iter().zip(change.iter()).map(|(value, change)| value + change).collect();
        (total.is_finite() && total > 0.0).then_some(Solution { values, covariance, cost: least })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A constant acceleration in a rest of a known kind, many times over: the interval of the acceleration holds zero as often
    /// as it says.
    #[test]
    fn the_interval_of_a_constant_among_gusts_is_as_wide_as_it_says() {
        use rand::{RngExt as _, SeedableRng as _};
        const FRAMES: usize = 500;
        const SERIES: usize = 200;
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        // The sum of twelve uniform numbers less six is normal enough here.
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let (sigma, lasts_s, white) = (1.0, 0.4, 1e-5);
        let kept = libm::exp(-FRAME_S / lasts_s);
        let priors = [Prior { mean: 0.0, sigma: 10.0 }];
        let slope: Vec<f64> = (0..FRAMES).map(|frame| -FRAME_S * (frame as f64 + 0.5)).collect();
        let mut held = 0;
        for _ in 0..SERIES {
            let series = [0, 1].map(|_| {
                let (mut gust, mut rate) = (sigma * normal(), 0.0);
                (0..FRAMES)
                    .map(|_| {
                        let before = rate;
                        rate += gust * FRAME_S;
                        gust = kept * gust + sigma * libm::sqrt(1.0 - kept * kept) * normal();
                        f64::midpoint(before, rate) + libm::sqrt(white) * normal()
                    })
                    .collect::<Vec<f64>>()
            });
            let slopes = [0, 1].map(|_| DMatrix::from_column_slice(FRAMES, 1, &slope));
            let line = Line {
                values: &[0.0],
                priors: &priors,
                missed: series,
                slopes,
                other: Vec::new(),
                other_slopes: DMatrix::zeros(0, 1),
                white,
            };
            let rest = line.most_likely(Rest { sigma_rad_s2: 1.0, lasts_s: 0.3, rough: 0.01 });
            let found = line.posterior(rest).unwrap();
            held += usize::from(found.values[0].abs() < 1.96 * libm::sqrt(found.covariance[(0, 0)]));
        }
        // 95 % of 200, plus and minus three standard deviations of a count.
        assert!((181..=199).contains(&held), "{held} of {SERIES}");
    }
}
