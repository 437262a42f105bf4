//! The quadratic subproblem, solved by Clarabel.
//!
//! ```text
//! minimise    p' H p / 2 + g' p + price * (sum of elastics)
//! subject to  c_i + a_i' p = e_i+ - e_i-      equalities
//!             c_i + a_i' p + e_i >= 0         inequalities
//!             lower <= p <= upper,  e >= 0
//! ```
//!
//! The conditions are elastic, so the subproblem always has a solution and no multiplier exceeds the price.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::{DMatrix, DVector};

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
    pub(super) price: f64,
    pub(super) max_iterations: u32,
}

/// The subproblem's solution.
pub(super) struct QpSolution {
    pub(super) step: Vec<f64>,
    /// One for each row, from -price (equalities) or 0 to price.
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
        linear.extend(core::iter::repeat_n(self.price, elastics));
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
