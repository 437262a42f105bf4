//! The quadratic subproblem: a positive definite model of the Lagrangian's curvature, and its solution, by Clarabel or exactly
//! on a guessed active set, which is corrected until it is the right one.
//!
//! ```text
//! minimise    p' H p / 2 + g' p + penalty * (sum of elastics)
//! subject to  c_i + a_i' p = e_i+ - e_i-      equalities
//!             c_i + a_i' p + e_i >= 0         inequalities
//!             lower <= p <= upper,  e >= 0
//! ```
//!
//! The conditions are elastic, so the subproblem always has a solution and no multiplier exceeds the penalty.
//!
//! Near a solution the active set of the last iteration is almost right, and a few linear systems replace an
//! interior-point run. Far from it, the interior-point solution shows the set. Its own multipliers have an error of its
//! tolerance times the size of the data, which is more than the outer tolerance.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use nmpc::problem::Condition;

use super::linearised::Linearised;

/// One linearised condition.
pub(super) struct QpRow {
    pub(super) value: f64,
    pub(super) gradient: Vec<f64>,
    pub(super) equality: bool,
}

impl QpRow {
    /// The linearised condition after a step.
    pub(super) fn after(&self, step: &[f64]) -> f64 {
        self.value + self.gradient.iter().zip(step).map(|(slope, component)| slope * component).sum::<f64>()
    }
}

/// The subproblem; `hessian` must be positive definite.
pub(super) struct Qp<'a> {
    pub(super) hessian: &'a DMatrix<f64>,
    pub(super) gradient: &'a DVector<f64>,
    pub(super) lower: &'a [f64],
    pub(super) upper: &'a [f64],
    pub(super) rows: &'a [QpRow],
    pub(super) penalty: f64,
    pub(super) max_iterations: u32,
}

/// The subproblem's solution.
pub(super) struct QpSolution {
    pub(super) step: Vec<f64>,
    /// One for each row, from -penalty (equalities) or 0 to penalty.
    pub(super) multipliers: Vec<f64>,
    pub(super) iterations: u32,
}

/// The interior-point tolerance: small enough to show the active set, on which the solution is polished.
const TOLERANCE: f64 = 1e-8;

impl Qp<'_> {
    /// Solves the subproblem; `None` if Clarabel gives no finite answer.
    pub(super) fn solve(&self) -> Option<QpSolution> {
        let (a, b, cones) = self.constraints();
        let elastics: usize = self.rows.iter().map(|row| if row.equality { 2 } else { 1 }).sum();
        let mut linear: Vec<f64> = self.gradient.iter().copied().collect();
        linear.extend(core::iter::repeat_n(self.penalty, elastics));
        let mut solver =
            DefaultSolver::new(&self.quadratic(elastics), &linear, &a, &b, &cones, self.settings()).ok()?;
        solver.solve();
        let solution = &solver.solution;
        let usable = matches!(
            solution.status,
            SolverStatus::Solved
                | SolverStatus::AlmostSolved
                | SolverStatus::InsufficientProgress
                | SolverStatus::MaxIterations
        );
        let count = self.gradient.len();
        let step: Vec<f64> = solution.x.iter().take(count).copied().collect();
        let multipliers = self.multipliers(&solution.z);
        let finite = step.iter().chain(&multipliers).all(|value| value.is_finite());
        (usable && finite).then_some(QpSolution { step, multipliers, iterations: solution.iterations })
    }

    fn settings(&self) -> DefaultSettings<f64> {
        DefaultSettings {
            max_iter: self.max_iterations,
            // A clock must not change the result.
            time_limit: f64::INFINITY,
            verbose: false,
            max_threads: 1,
            direct_solve_method: "qdldl".to_owned(),
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            presolve_enable: false,
            ..DefaultSettings::default()
        }
    }

    /// The upper triangle of the Hessian, without quadratic terms in the elastics.
    fn quadratic(&self, elastics: usize) -> CscMatrix<f64> {
        let count = self.gradient.len();
        let mut columns = vec![0];
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for column in 0..count {
            for row in 0..=column {
                rows.push(row);
                values.push(self.hessian[(row, column)]);
            }
            columns.push(rows.len());
        }
        columns.extend(core::iter::repeat_n(rows.len(), elastics));
        CscMatrix::new(count + elastics, count + elastics, columns, rows, values)
    }

    /// `A [p; e] + s = b`: equalities in a zero cone first, then inequalities, input limits and elastic signs.
    fn constraints(&self) -> (CscMatrix<f64>, Vec<f64>, Vec<SupportedConeT<f64>>) {
        let count = self.gradient.len();
        let equalities = self.rows.iter().filter(|row| row.equality).count();
        let inequalities = self.rows.len() - equalities;
        let elastics = 2 * equalities + inequalities;
        let places = self.row_places();
        let first_bound = equalities + inequalities;
        let first_sign = first_bound + 2 * count;

        let mut b = vec![0.0; first_sign + elastics];
        for (row, place) in self.rows.iter().zip(&places) {
            b[*place] = if row.equality { -row.value } else { row.value };
        }
        for (j, (lower, upper)) in self.lower.iter().zip(self.upper).enumerate() {
            b[first_bound + j] = *upper;
            b[first_bound + count + j] = -lower;
        }

        let mut columns = vec![0];
        let (mut row_indices, mut values) = (Vec::new(), Vec::new());
        for j in 0..count {
            let mut entries: Vec<(usize, f64)> = self
                .rows
                .iter()
                .zip(&places)
                .map(|(row, place)| (*place, if row.equality { row.gradient[j] } else { -row.gradient[j] }))
                .collect();
            entries.sort_by_key(|(place, _)| *place);
            entries.push((first_bound + j, 1.0));
            entries.push((first_bound + count + j, -1.0));
            for (place, value) in entries {
                row_indices.push(place);
                values.push(value);
            }
            columns.push(row_indices.len());
        }
        // The elastics' columns, in the order of the rows. Each relaxes its row and must not be negative.
        let mut sign = first_sign;
        for (row, place) in self.rows.iter().zip(&places) {
            let relaxations: &[f64] = if row.equality { &[-1.0, 1.0] } else { &[-1.0] };
            for relaxation in relaxations {
                row_indices.extend([*place, sign]);
                values.extend([*relaxation, -1.0]);
                columns.push(row_indices.len());
                sign += 1;
            }
        }
        let a = CscMatrix::new(first_sign + elastics, count + elastics, columns, row_indices, values);
        let cones = vec![
            SupportedConeT::ZeroConeT(equalities),
            SupportedConeT::NonnegativeConeT(first_sign + elastics - equalities),
        ];
        (a, b, cones)
    }

    /// The position of each row in `A`: equalities first.
    fn row_places(&self) -> Vec<usize> {
        let equalities = self.rows.iter().filter(|row| row.equality).count();
        let (mut equality, mut inequality) = (0, equalities);
        self.rows
            .iter()
            .map(|row| {
                let place = if row.equality { &mut equality } else { &mut inequality };
                *place += 1;
                *place - 1
            })
            .collect()
    }

    /// Multipliers in the sense of `gradient - sum multiplier * row gradient`, from Clarabel's duals.
    fn multipliers(&self, duals: &[f64]) -> Vec<f64> {
        self.rows
            .iter()
            .zip(self.row_places())
            .map(|(row, place)| {
                let dual = duals.get(place).copied().unwrap_or(f64::NAN);
                if row.equality { -dual } else { dual }
            })
            .collect()
    }
}

/// Curvature added across the conditions that hold, relative to the largest of the inputs.
const STIFFNESSES: [f64; 2] = [1.0, 10.0];

/// A multiplier this close to zero or to its penalty, relative to the penalty, does not show that its condition holds.
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
    penalty: f64,
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
            multiplier.abs() < penalty * (1.0 - UNSETTLED)
                && (conditions[*row].equality || multiplier > penalty * UNSETTLED)
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

/// Largest number of changes of the active set.
const ROUNDS: u32 = 12;

/// An interior-point step this close to an input's limit (rad) counts as on it.
const ON_LIMIT_RAD: f64 = 1e-6;

/// A multiplier this close to zero or to its penalty, relative to the penalty, counts as there.
const AT_PENALTY: f64 = 1e-6;

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
    /// Broken upwards or downwards: multiplier at its penalty, of this sign.
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
            .map(|(row, multiplier)| Role::of(row.equality, *multiplier, qp.penalty))
            .collect();
        Self { places, roles }
    }
}

impl Role {
    /// The role a multiplier shows.
    pub(super) fn of(equality: bool, multiplier: f64, penalty: f64) -> Self {
        if multiplier >= penalty * (1.0 - AT_PENALTY) {
            Self::Broken(1.0)
        } else if equality && multiplier <= penalty * (AT_PENALTY - 1.0) {
            Self::Broken(-1.0)
        } else if !equality && multiplier <= penalty * AT_PENALTY {
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
            Role::Broken(sign) => sign * qp.penalty,
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
                Role::Held if *multiplier > qp.penalty => Role::Broken(1.0),
                Role::Held if row.equality && *multiplier < -qp.penalty => Role::Broken(-1.0),
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

    use super::*;

    /// Clarabel's solution, and the solution polished from its active set.
    fn both(
        root: &[f64],
        gradient: &[f64],
        rows: &[(f64, Vec<f64>, bool)],
        penalty: f64,
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
            penalty,
            max_iterations: 100,
        };
        let rough = qp.solve().unwrap();
        let polished = polished(&qp, ActiveSet::of(&qp, &rough));
        (rough, polished)
    }

    #[test]
    fn the_multiplier_of_an_unreachable_condition_is_at_its_penalty() {
        // p <= 1 cannot make p - 3 zero. A penalty of 5 per unit exceeds the curvature, so p goes to its limit.
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
