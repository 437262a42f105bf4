//! Nonlinear least squares with a normal prior: the most likely parameters, and their covariance.
//!
//! Gauss-Newton with Levenberg's damping on the normal equations. (The crate `levenberg-marquardt`
//! is built on another version of nalgebra than the flight code, and a second one would have to be
//! compiled and could not share a type.)

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// What is known of a parameter before the flight: a normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    pub(super) mean: f64,
    pub(super) sigma: f64,
}

/// The result.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub(super) values: Vec<f64>,
    /// Of the posterior, from data and prior.
    pub(super) covariance: DMatrix<f64>,
    /// What was known before.
    pub(super) priors: Vec<Prior>,
    /// Sum of squares of whitened residuals and prior.
    pub(super) cost: f64,
}

const ROUNDS: usize = 40;
/// Step of a derivative, as a fraction of the prior's standard deviation: a millisecond of an
/// ignition, a quarter of one of a servo. Smaller steps stay within one branch of a play, and the
/// iteration stops at its end.
const STEP: f64 = 5e-3;
/// The iteration ends when no parameter moves by more than this fraction of its standard deviation.
const SMALL: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e9;

/// The most likely parameters for whitened residuals; `None` if they are not finite or no step
/// helps at the start.
pub(super) fn solve(priors: &[Prior], residuals: impl Fn(&[f64]) -> Vec<f64>) -> Option<Solution> {
    let start: Vec<f64> = priors.iter().map(|prior| prior.mean).collect();
    solve_from(&start, priors, residuals)
}

/// As [`solve`], from other values than the prior's.
pub(super) fn solve_from(
    start: &[f64],
    priors: &[Prior],
    residuals: impl Fn(&[f64]) -> Vec<f64>,
) -> Option<Solution> {
    let cost_of = |values: &[f64], residuals: &[f64]| {
        let of_prior = values.iter().zip(priors).map(|(value, prior)| (value - prior.mean) / prior.sigma);
        residuals.iter().copied().chain(of_prior).map(|whitened| whitened * whitened).sum::<f64>()
    };
    let mut values = start.to_vec();
    let mut now = residuals(&values);
    let mut cost = cost_of(&values, &now);
    if !cost.is_finite() {
        return None;
    }
    let mut damping = 1e-4;
    let mut information = DMatrix::zeros(0, 0);
    for _ in 0..ROUNDS {
        let jacobian = derivatives(&values, priors, &residuals);
        let mut gradient = jacobian.tr_mul(&DVector::from_column_slice(&now));
        information = jacobian.tr_mul(&jacobian);
        for (place, prior) in priors.iter().enumerate() {
            information[(place, place)] += 1.0 / (prior.sigma * prior.sigma);
            gradient[place] += (values[place] - prior.mean) / (prior.sigma * prior.sigma);
        }
        let mut moved_by = 0.0;
        while damping < MOST_DAMPING {
            let mut damped = information.clone();
            for place in 0..priors.len() {
                damped[(place, place)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&gradient);
            let tried: Vec<f64> = values.iter().zip(step.iter()).map(|(value, step)| value - step).collect();
            let found = residuals(&tried);
            let new_cost = cost_of(&tried, &found);
            if new_cost.is_finite() && new_cost <= cost {
                moved_by = (0..priors.len())
                    .map(|place| step[place].abs() * libm::sqrt(information[(place, place)]))
                    .fold(0.0, f64::max);
                (values, now, cost) = (tried, found, new_cost);
                damping = (damping * 0.1).max(1e-9);
                break;
            }
            damping *= 10.0;
        }
        // A step that damping has made small is no sign of the end.
        if moved_by < SMALL && !(1e-2..MOST_DAMPING).contains(&damping) {
            break;
        }
    }
    let covariance = information.cholesky()?.inverse();
    Some(Solution { values, covariance, priors: priors.to_vec(), cost })
}

/// Widens a solution where its residuals say that the model is wrong.
///
/// Residuals that are independent, and as large as they were taken for, push the parameters as hard
/// as the covariance says. How hard they do push is summed over blocks of neighbours, within which
/// they may be correlated (the sandwich covariance: H. White, Econometrica 50, 1982; K.-Y. Liang
/// and S. Zeger, Biometrika 73, 1986). Where that gives a larger deviation, it counts; the
/// correction for few blocks is the usual one.
pub(super) fn inflate(solution: &mut Solution, residuals: impl Fn(&[f64]) -> Vec<f64>, block: usize) {
    let Solution { values, priors, .. } = &*solution;
    let now = residuals(values);
    let jacobian = derivatives(values, priors, &residuals);
    let count = priors.len();
    let mut pushed = DMatrix::zeros(count, count);
    let mut blocks = 0_u32;
    for from in (0..now.len()).step_by(block.max(1)) {
        let rows = block.min(now.len() - from);
        let push = jacobian.rows(from, rows).tr_mul(&DVector::from_column_slice(&now[from..from + rows]));
        pushed += &push * push.transpose();
        blocks += 1;
    }
    if blocks as usize <= count {
        return;
    }
    pushed *= f64::from(blocks) / (f64::from(blocks) - count as f64);
    for (place, prior) in priors.iter().enumerate() {
        pushed[(place, place)] += 1.0 / (prior.sigma * prior.sigma);
    }
    let sandwich = &solution.covariance * pushed * &solution.covariance;
    let wider = sandwich.diagonal().zip_map(&solution.covariance.diagonal(), |sandwich, covariance| {
        libm::sqrt((sandwich / covariance).max(1.0))
    });
    solution.covariance.component_mul_assign(&(&wider * wider.transpose()));
}

/// Central differences.
fn derivatives(values: &[f64], priors: &[Prior], residuals: &impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
    let column = |(place, prior): (usize, &Prior)| {
        let step = STEP * prior.sigma;
        let beside = |by: f64| {
            let mut moved = values.to_vec();
            moved[place] += by;
            DVector::from_vec(residuals(&moved))
        };
        (beside(step) - beside(-step)) / (2.0 * step)
    };
    DMatrix::from_columns(&priors.iter().enumerate().map(column).collect::<Vec<_>>())
}

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

/// The place of the lowest value of a function with one minimum between two ends, by the golden
/// section.
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

    /// A line through (0, 1), (1, 3), (2, 5.3) with a noise of 0.1 and a prior that says nothing:
    /// the normal equations give 0.95 + 2.15 x, and the covariance is 0.01 [5/6, -1/2; -1/2, 1/2].
    #[test]
    fn val_hand_a_straight_line() {
        let priors = [Prior { mean: 0.0, sigma: 1e4 }; 2];
        let points = [(0.0, 1.0), (1.0, 3.0), (2.0, 5.3)];
        let found =
            solve(&priors, |line| points.map(|(x, y)| (line[0] + line[1] * x - y) / 0.1).to_vec()).unwrap();
        assert!((found.values[0] - 0.95).abs() < 1e-6 && (found.values[1] - 2.15).abs() < 1e-6, "{found:?}");
        for (place, expected) in [((0, 0), 5.0 / 6.0), ((0, 1), -0.5), ((1, 1), 0.5)] {
            assert!((found.covariance[place] - 0.01 * expected).abs() < 1e-6, "{:?}", found.covariance);
        }
    }

    /// A sample of 3 with a noise of 1 and a prior of 0 with 2: the mean is 3 * 4 / 5, the variance
    /// 4 / 5.
    #[test]
    fn val_hand_a_prior_and_a_sample() {
        let found = solve(&[Prior { mean: 0.0, sigma: 2.0 }], |values| vec![values[0] - 3.0]).unwrap();
        // As exactly as the iteration ends.
        assert!((found.values[0] - 2.4).abs() < SMALL, "{found:?}");
        assert!((found.covariance[(0, 0)] - 0.8).abs() < 1e-9);
    }

    /// A mean of 40 samples that come in pairs of equal ones, +1 and -1 in turn: as independent
    /// numbers they have a variance of 1 / 40, as 20 pairs one of 1 / 20; few blocks add 20 / 19.
    #[test]
    fn val_hand_correlated_residuals_widen_the_interval() {
        let prior = [Prior { mean: 0.0, sigma: 1e6 }];
        let samples: Vec<f64> = (0..40).map(|k| if (k / 2) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let residuals = |mean: &[f64]| samples.iter().map(|sample| mean[0] - sample).collect::<Vec<_>>();
        let mut found = solve(&prior, residuals).unwrap();
        assert!((found.covariance[(0, 0)] - 1.0 / 40.0).abs() < 1e-9);
        inflate(&mut found, residuals, 2);
        assert!((found.covariance[(0, 0)] - 20.0 / 19.0 / 20.0).abs() < 1e-9, "{:?}", found.covariance);
    }

    #[test]
    fn a_curved_model_is_solved_and_nonsense_is_not() {
        let prior = [Prior { mean: 1.0, sigma: 1.0 }];
        let found = solve(&prior, |values| vec![(libm::exp(values[0]) - 7.389_056) / 1e-4]).unwrap();
        assert!((found.values[0] - 2.0).abs() < 1e-5, "{found:?}");
        assert!(solve(&prior, |_| vec![f64::NAN]).is_none());
    }

    /// A process with variance 1 and correlation 1/2 from sample to sample, seen without noise: the
    /// first innovation is the value, the next is the value less half of the one before, over the
    /// root of 3/4.
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
