//! Makes a positive definite model of the Lagrangian's curvature.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::condense::Linearised;
use nmpc::problem::Condition;

/// Curvature added across the conditions that hold, relative to the largest of the inputs.
const STIFFNESSES: [f64; 2] = [1.0, 10.0];

/// A multiplier this close to zero or to its price, relative to the price, does not show that its condition holds.
const UNSETTLED: f64 = 1e-6;

/// Smallest curvature of a convexified model, relative to its largest.
const SMALLEST_CURVATURE: f64 = 1e-9;

/// Largest curvature that damping adds to directions with less, relative to the largest of the inputs.
const LARGEST_DAMPING: f64 = 1e-2;

/// Largest number of sweeps of the eigenvalue iteration.
const EIGEN_SWEEPS: usize = 10_000;

/// A positive definite Hessian and its gradient, or `None` if the data are not finite.
///
/// First, curvature is added along the pinned inputs and across the conditions that hold. The subproblem cannot move
/// there, so the model still gives the exact Newton step. If that is not enough, the remaining negative curvature is
/// mirrored, so that the model bends up as sharply as the true function bends down. Weaker curvature is then raised
/// towards it, because near negative curvature the other directions are not reliable over long steps either.
pub(super) fn convexified(
    exact: &DMatrix<f64>,
    linear: &Linearised,
    conditions: &[Condition],
    multipliers: &[f64],
    pinned: &[bool],
    price: f64,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let largest = exact.diagonal().amax();
    let mut plain = exact.clone();
    for (i, pinned) in pinned.iter().enumerate() {
        if *pinned {
            plain[(i, i)] += largest;
        }
    }
    if Cholesky::new(plain.clone()).is_some() {
        return Some((plain, linear.gradient.clone()));
    }

    let held: Vec<usize> = (0..conditions.len())
        .filter(|row| {
            let multiplier = multipliers[*row];
            multiplier.abs() < price * (1.0 - UNSETTLED)
                && (conditions[*row].equality || multiplier > price * UNSETTLED)
        })
        .collect();
    let mut hessian = plain.clone();
    let mut gradient = linear.gradient.clone();
    for stiffness in STIFFNESSES {
        hessian.copy_from(&plain);
        gradient.copy_from(&linear.gradient);
        for row in &held {
            let slopes = linear.rows.row(*row).transpose();
            let square = slopes.norm_squared();
            if square > 0.0 {
                let curvature = stiffness * largest / square;
                hessian.ger(curvature, &slopes, &slopes, 1.0);
                gradient.axpy(curvature * linear.values[*row], &slopes, 1.0);
            }
        }
        if Cholesky::new(hessian.clone()).is_some() {
            return Some((hessian, gradient));
        }
    }

    let eigen = SymmetricEigen::try_new(hessian, f64::EPSILON, EIGEN_SWEEPS)?;
    let damping = (-eigen.eigenvalues.min()).min(LARGEST_DAMPING * largest);
    let least = damping.max(SMALLEST_CURVATURE * eigen.eigenvalues.amax());
    let bent_up = eigen.eigenvalues.map(|curvature| curvature.abs().max(least));
    let convex = &eigen.eigenvectors * DMatrix::from_diagonal(&bent_up) * eigen.eigenvectors.transpose();
    Cholesky::new(convex.clone()).map(|_| (convex, gradient))
}
