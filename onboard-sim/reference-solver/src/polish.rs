//! Solves the subproblem exactly on a guessed active set, which is corrected until it is the right one.
//!
//! Near a solution the active set of the last iteration is almost right, and a few linear systems replace an
//! interior-point run. Far from it, the interior-point solution shows the set. Its own multipliers have an error of its
//! tolerance times the size of the data, which is more than the outer tolerance.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::qp::{Qp, QpSolution};

/// Largest number of changes of the active set.
const ROUNDS: u32 = 12;

/// An interior-point step this close to an input's limit (rad) counts as on it.
const ON_LIMIT_RAD: f64 = 1e-6;

/// A multiplier this close to zero or to its price, relative to the price, counts as there.
const AT_PRICE: f64 = 1e-6;

/// Conditions whose triangular factor falls to this, relative to the largest, depend on the others.
const DEPENDENT: f64 = 1e-11;

/// Violations up to this, relative to the size of the data, are rounding errors.
const ROUNDING: f64 = 1e-9;

/// The place of an input's step.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// Between its limits.
    Free,
    /// On its lower limit.
    Lower,
    /// On its upper limit.
    Upper,
}

/// The role of a condition.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Role {
    /// Holds exactly; its multiplier is unknown.
    Held,
    /// Not broken and not needed: multiplier zero.
    Slack,
    /// Broken upwards or downwards: multiplier at its price, of this sign.
    Broken(f64),
}

/// A guess of which limits and conditions are active.
#[derive(Clone, PartialEq)]
pub(super) struct ActiveSet {
    pub(super) places: Vec<Place>,
    pub(super) roles: Vec<Role>,
}

impl ActiveSet {
    /// The active set a solution shows.
    pub(super) fn of(qp: &Qp<'_>, solution: &QpSolution) -> Self {
        let places = solution
            .step
            .iter()
            .enumerate()
            .map(|(j, step)| {
                if qp.upper[j] - step <= ON_LIMIT_RAD {
                    Place::Upper
                } else if step - qp.lower[j] <= ON_LIMIT_RAD {
                    Place::Lower
                } else {
                    Place::Free
                }
            })
            .collect();
        let roles = qp
            .rows
            .iter()
            .zip(&solution.multipliers)
            .map(|(row, multiplier)| Role::of(row.equality, *multiplier, qp.price))
            .collect();
        Self { places, roles }
    }
}

impl Role {
    /// The role a multiplier shows.
    pub(super) fn of(equality: bool, multiplier: f64, price: f64) -> Self {
        if multiplier >= price * (1.0 - AT_PRICE) {
            Self::Broken(1.0)
        } else if equality && multiplier <= price * (AT_PRICE - 1.0) {
            Self::Broken(-1.0)
        } else if !equality && multiplier <= price * AT_PRICE {
            Self::Slack
        } else {
            Self::Held
        }
    }
}

/// The exact solution, if corrections of the guess find the right active set within a few rounds.
pub(super) fn polished(qp: &Qp<'_>, mut guess: ActiveSet) -> Option<QpSolution> {
    for round in 1..=ROUNDS {
        let solution = solved_on(qp, &guess, round)?;
        let mended = mended(qp, &guess, &solution);
        if mended == guess {
            return Some(solution);
        }
        guess = mended;
    }
    None
}

/// The subproblem's minimum on an active set; `None` if the Hessian is not positive definite in the free directions, or
/// the conditions depend on each other.
fn solved_on(qp: &Qp<'_>, set: &ActiveSet, round: u32) -> Option<QpSolution> {
    let count = qp.gradient.len();
    let free: Vec<usize> = (0..count).filter(|j| set.places[*j] == Place::Free).collect();
    let held: Vec<usize> = (0..set.roles.len()).filter(|row| set.roles[*row] == Role::Held).collect();
    if free.len() < held.len() {
        return None;
    }
    let mut step: Vec<f64> = (0..count)
        .map(|j| match set.places[j] {
            Place::Free => 0.0,
            Place::Lower => qp.lower[j],
            Place::Upper => qp.upper[j],
        })
        .collect();
    let mut multipliers: Vec<f64> = set
        .roles
        .iter()
        .map(|role| match role {
            Role::Held | Role::Slack => 0.0,
            Role::Broken(sign) => sign * qp.price,
        })
        .collect();

    // On the free inputs: A p = -value, and H p + slope = A' y. With A' = Q R split into the range Y of A' and its
    // null space Z, p = Y p_y + Z p_z: the conditions fix p_y, the reduced Hessian Z' H Z gives p_z.
    let slope = lagrangian_slope(qp, &step, &multipliers);
    let slope = DVector::from_fn(free.len(), |i, _| slope[free[i]]);
    let hessian = DMatrix::from_fn(free.len(), free.len(), |i, j| qp.hessian[(free[i], free[j])]);
    let rows = DMatrix::from_fn(free.len(), held.len(), |i, j| qp.rows[held[j]].gradient[free[i]]);
    let values = DVector::from_fn(held.len(), |i, _| qp.rows[held[i]].after(&step));
    let factors = rows.qr();
    let triangle = factors.r();
    let mut transposed = DMatrix::identity(free.len(), free.len());
    factors.q_tr_mul(&mut transposed);
    let range = transposed.rows(0, held.len()).transpose();
    let null = transposed.rows(held.len(), free.len() - held.len()).transpose();
    let diagonal = triangle.diagonal();
    if diagonal.iter().any(|entry| entry.abs() <= DEPENDENT * diagonal.amax()) {
        return None;
    }
    let along_range = triangle.tr_solve_upper_triangular(&-values)?;
    let mut free_step = &range * along_range;
    if null.ncols() > 0 {
        let bent = hessian.clone() * &null;
        let reduced = Cholesky::new(null.transpose() * bent)?;
        let along_null = reduced.solve(&(-null.transpose() * (&slope + &hessian * &free_step)));
        free_step += &null * along_null;
    }
    let unknown = triangle.solve_upper_triangular(&(range.transpose() * (&slope + &hessian * &free_step)))?;
    for (row, multiplier) in held.iter().zip(unknown.iter()) {
        multipliers[*row] = *multiplier;
    }
    for (j, value) in free.iter().zip(free_step.iter()) {
        step[*j] = *value;
    }
    let finite = step.iter().chain(&multipliers).all(|value| value.is_finite());
    finite.then_some(QpSolution { step, multipliers, iterations: round })
}

/// Gradient of the subproblem's Lagrangian.
fn lagrangian_slope(qp: &Qp<'_>, step: &[f64], multipliers: &[f64]) -> DVector<f64> {
    let mut slope = qp.gradient + qp.hessian * DVector::from_column_slice(step);
    for (row, multiplier) in qp.rows.iter().zip(multipliers) {
        if *multiplier != 0.0 {
            for (entry, gradient) in slope.iter_mut().zip(&row.gradient) {
                *entry -= multiplier * gradient;
            }
        }
    }
    slope
}

/// The active set after a change of every limit and condition that the solution contradicts.
fn mended(qp: &Qp<'_>, set: &ActiveSet, solution: &QpSolution) -> ActiveSet {
    let slope = lagrangian_slope(qp, &solution.step, &solution.multipliers);
    let size = 1.0 + qp.gradient.amax();
    let places = set
        .places
        .iter()
        .enumerate()
        .map(|(j, place)| match place {
            Place::Free if solution.step[j] > qp.upper[j] + ROUNDING => Place::Upper,
            Place::Free if solution.step[j] < qp.lower[j] - ROUNDING => Place::Lower,
            Place::Upper if slope[j] > ROUNDING * size => Place::Free,
            Place::Lower if slope[j] < -ROUNDING * size => Place::Free,
            kept => *kept,
        })
        .collect();
    let roles = set
        .roles
        .iter()
        .zip(qp.rows)
        .zip(&solution.multipliers)
        .map(|((role, row), multiplier)| {
            let value = row.after(&solution.step);
            match role {
                Role::Held if *multiplier > qp.price => Role::Broken(1.0),
                Role::Held if row.equality && *multiplier < -qp.price => Role::Broken(-1.0),
                Role::Held if !row.equality && *multiplier < 0.0 => Role::Slack,
                Role::Slack if value < -ROUNDING => Role::Held,
                Role::Broken(sign) if sign * value > ROUNDING => Role::Held,
                kept => *kept,
            }
        })
        .collect();
    ActiveSet { places, roles }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::qp::QpRow;
    use super::*;

    /// Clarabel's solution, and the solution polished from its active set.
    fn both(
        root: &[f64],
        gradient: &[f64],
        rows: &[(f64, Vec<f64>, bool)],
        price: f64,
    ) -> (QpSolution, Option<QpSolution>) {
        let count = gradient.len();
        let root = DMatrix::from_row_slice(count, count, root);
        let hessian = &root * root.transpose() + DMatrix::identity(count, count);
        let gradient = DVector::from_column_slice(gradient);
        let rows: Vec<QpRow> = rows
            .iter()
            .map(|(value, gradient, equality)| QpRow {
                value: *value,
                gradient: gradient.clone(),
                equality: *equality,
            })
            .collect();
        let qp = Qp {
            hessian: &hessian,
            gradient: &gradient,
            lower: &vec![-1.0; count],
            upper: &vec![1.0; count],
            rows: &rows,
            price,
            max_iterations: 100,
        };
        let rough = qp.solve().unwrap();
        let polished = polished(&qp, ActiveSet::of(&qp, &rough));
        (rough, polished)
    }

    #[test]
    fn the_multiplier_of_an_unreachable_condition_is_at_its_price() {
        // p <= 1 cannot make p - 3 zero. A price of 5 per unit exceeds the curvature, so p goes to its limit.
        let (_, polished) = both(&[0.0], &[0.0], &[(-3.0, vec![1.0], true)], 5.0);
        let polished = polished.unwrap();
        assert!((polished.step[0] - 1.0).abs() < 1e-12 && (polished.multipliers[0] - 5.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn val_clarabel_agrees_with_the_active_set_solution(
            root in prop::collection::vec(-2.0..2.0_f64, 36),
            gradient in prop::collection::vec(-5.0..5.0_f64, 6),
            rows in prop::collection::vec(
                (-1.0..1.0_f64, prop::collection::vec(-1.0..1.0_f64, 6), any::<bool>()), 0..4,
            ),
        ) {
            let (rough, polished) = both(&root, &gradient, &rows, 20.0);
            // Clarabel stops at a relative gap of 1e-8 of objectives up to about 100; with curvature of at least one
            // its step is within sqrt(2 * 1e-6). A degenerate active set may not be found; then Clarabel's solution
            // is used.
            if let Some(polished) = polished {
                for (exact, approximate) in polished.step.iter().zip(&rough.step) {
                    prop_assert!((exact - approximate).abs() < 1.5e-3, "{exact} {approximate}");
                }
            }
        }
    }
}
