//! Nonlinear least squares with a normal prior: the most likely parameters, and their covariance.
//!
//! Gauss-Newton with Levenberg's damping on the normal equations. (The crate `levenberg-marquardt` is built on another
//! version of nalgebra than the flight code, and a second one would have to be compiled and could not share a type.)

use nalgebra::{DMatrix, DVector};

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
    /// Sum of squares of whitened residuals and prior.
    pub(super) cost: f64,
}

const ROUNDS: usize = 40;
/// Step of a derivative, as a fraction of the prior's standard deviation: a millisecond of an ignition, a quarter of one of a
/// servo. Smaller steps stay within one branch of a play, and the iteration stops at its end.
const STEP: f64 = 5e-3;
/// The iteration ends when no parameter moves by more than this fraction of its standard deviation.
const SMALL: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e9;

/// The most likely parameters for whitened residuals; `None` if they are not finite or no step helps at the start.
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
        let jacobian = derivatives(&values, priors, &residuals, now.len());
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
    Some(Solution { values, covariance, cost })
}

/// Widens a solution where its residuals say that the model is wrong.
///
/// Residuals that are independent, and as large as they were taken for, push the parameters as hard as the covariance says.
/// How hard they do push is summed over blocks of neighbours, within which they may be correlated (the sandwich covariance:
/// H. White, Econometrica 50, 1982; K.-Y. Liang and S. Zeger, Biometrika 73, 1986). Where that gives a larger deviation, it
/// counts; the correction for few blocks is the usual one.
pub(super) fn inflate(
    solution: &mut Solution,
    priors: &[Prior],
    residuals: impl Fn(&[f64]) -> Vec<f64>,
    block: usize,
) {
    let now = residuals(&solution.values);
    let jacobian = derivatives(&solution.values, priors, &residuals, now.len());
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
    let wider: Vec<f64> = (0..count)
        .map(|place| libm::sqrt((sandwich[(place, place)] / solution.covariance[(place, place)]).max(1.0)))
        .collect();
    for row in 0..count {
        for column in 0..count {
            solution.covariance[(row, column)] *= wider[row] * wider[column];
        }
    }
}

/// Central differences.
fn derivatives(
    values: &[f64],
    priors: &[Prior],
    residuals: &impl Fn(&[f64]) -> Vec<f64>,
    rows: usize,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(rows, values.len());
    for (place, prior) in priors.iter().enumerate() {
        let step = STEP * prior.sigma;
        let beside = |by: f64| {
            let mut moved = values.to_vec();
            moved[place] += by;
            residuals(&moved)
        };
        let (ahead, behind) = (beside(step), beside(-step));
        for (row, (ahead, behind)) in ahead.iter().zip(&behind).enumerate() {
            jacobian[(row, place)] = (ahead - behind) / (2.0 * step);
        }
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line through (0, 1), (1, 3), (2, 5.3) with a noise of 0.1 and a prior that says nothing: the normal equations
    /// give 0.95 + 2.15 x, and the covariance is 0.01 [5/6, -1/2; -1/2, 1/2].
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

    /// A sample of 3 with a noise of 1 and a prior of 0 with 2: the mean is 3 * 4 / 5, the variance 4 / 5.
    #[test]
    fn val_hand_a_prior_and_a_sample() {
        let found = solve(&[Prior { mean: 0.0, sigma: 2.0 }], |values| vec![values[0] - 3.0]).unwrap();
        // As exactly as the iteration ends.
        assert!((found.values[0] - 2.4).abs() < SMALL, "{found:?}");
        assert!((found.covariance[(0, 0)] - 0.8).abs() < 1e-9);
    }

    /// A mean of 40 samples that come in pairs of equal ones, +1 and -1 in turn: as independent numbers they have a
    /// variance of 1 / 40, as 20 pairs one of 1 / 20; few blocks add 20 / 19.
    #[test]
    fn val_hand_correlated_residuals_widen_the_interval() {
        let prior = [Prior { mean: 0.0, sigma: 1e6 }];
        let samples: Vec<f64> = (0..40).map(|k| if (k / 2) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let residuals = |mean: &[f64]| samples.iter().map(|sample| mean[0] - sample).collect::<Vec<_>>();
        let mut found = solve(&prior, residuals).unwrap();
        assert!((found.covariance[(0, 0)] - 1.0 / 40.0).abs() < 1e-9);
        inflate(&mut found, &prior, residuals, 2);
        assert!((found.covariance[(0, 0)] - 20.0 / 19.0 / 20.0).abs() < 1e-9, "{:?}", found.covariance);
    }

    #[test]
    fn a_curved_model_is_solved_and_nonsense_is_not() {
        let prior = [Prior { mean: 1.0, sigma: 1.0 }];
        let found = solve(&prior, |values| vec![(libm::exp(values[0]) - 7.389_056) / 1e-4]).unwrap();
        assert!((found.values[0] - 2.0).abs() < 1e-5, "{found:?}");
        assert!(solve(&prior, |_| vec![f64::NAN]).is_none());
    }
}
