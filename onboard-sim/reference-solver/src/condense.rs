//! Condenses cost, conditions and curvature onto the inputs.

use nalgebra::{DMatrix, DVector};

use super::sensitivity::Interval;
use nmpc::dynamics::INPUT_INDEX;
use nmpc::problem::{Condition, Problem};
use nmpc::rollout::Trajectory;

/// A path linearised about its inputs.
pub(super) struct Linearised {
    intervals: Vec<Interval>,
    /// `sensitivities[k][j]`: derivative of the state at node `k` by input `j`, for `j < k`.
    sensitivities: Vec<Vec<[f64; 6]>>,
    /// Gradient of the cost by the inputs.
    pub(super) gradient: DVector<f64>,
    /// Value of each condition.
    pub(super) values: Vec<f64>,
    /// Gradient of each condition by the inputs, one row each.
    pub(super) rows: DMatrix<f64>,
}

impl Linearised {
    pub(super) fn about(
        problem: &Problem,
        conditions: &[Condition],
        trajectory: &Trajectory,
        inputs_rad: &[f64],
    ) -> Self {
        let count = inputs_rad.len();
        let intervals: Vec<Interval> = inputs_rad
            .iter()
            .zip(&trajectory.states)
            .enumerate()
            .map(|(k, (gimbal_rad, state))| Interval::about(problem, k, state, *gimbal_rad))
            .collect();

        let mut sensitivities: Vec<Vec<[f64; 6]>> = Vec::with_capacity(count + 1);
        let mut columns: Vec<[f64; 6]> = Vec::with_capacity(count);
        sensitivities.push(Vec::new());
        for interval in &intervals {
            for column in &mut columns {
                *column = core::array::from_fn(|i| {
                    interval.step[i].iter().zip(column.iter()).map(|(entry, value)| entry * value).sum()
                });
            }
            columns.push(core::array::from_fn(|i| interval.step[i][INPUT_INDEX]));
            sensitivities.push(columns.clone());
        }

        let mut rows = DMatrix::zeros(conditions.len(), count);
        for (index, condition) in conditions.iter().enumerate() {
            for (j, column) in sensitivities.get(condition.node).into_iter().flatten().enumerate() {
                rows[(index, j)] = condition.sign * column[condition.component];
            }
        }
        let values = conditions.iter().map(|row| row.value(&trajectory.states)).collect();
        let gradient = Self::pull_back(problem, &intervals, &[], &[], |_, _| ());
        Self { intervals, sensitivities, gradient, values, rows }
    }

    /// Gradient by the inputs of the cost minus the conditions times their multipliers, in one backward pass. `visit`
    /// gets each interval's backward result.
    fn pull_back(
        problem: &Problem,
        intervals: &[Interval],
        conditions: &[Condition],
        multipliers: &[f64],
        mut visit: impl FnMut(usize, &super::sensitivity::Backward),
    ) -> DVector<f64> {
        let count = intervals.len();
        // Each condition adds to the adjoint of its node.
        let mut pushes = vec![[0.0; 6]; count + 1];
        for (condition, multiplier) in conditions.iter().zip(multipliers) {
            if let Some(push) = pushes.get_mut(condition.node) {
                push[condition.component] -= multiplier * condition.sign;
            }
        }
        let mut gradient = DVector::zeros(count);
        let mut adjoint = [0.0; 6];
        for (k, interval) in intervals.iter().enumerate().rev() {
            for (sum, term) in adjoint.iter_mut().zip(&pushes[k + 1]) {
                *sum += term;
            }
            let backward = interval.backward(problem, &adjoint);
            gradient[k] = backward.input_gradient;
            adjoint = backward.adjoint;
            visit(k, &backward);
        }
        gradient
    }

    /// Gradient of the Lagrangian, cost minus conditions times multipliers, by the inputs.
    pub(super) fn lagrangian_gradient(&self, multipliers: &[f64]) -> DVector<f64> {
        let mut gradient = self.gradient.clone();
        for (index, multiplier) in multipliers.iter().enumerate().take(self.rows.nrows()) {
            if *multiplier != 0.0 {
                for (entry, row) in gradient.iter_mut().zip(self.rows.row(index).iter()) {
                    *entry -= multiplier * row;
                }
            }
        }
        gradient
    }

    /// Exact Hessian of the Lagrangian by the inputs.
    pub(super) fn lagrangian_hessian(
        &self,
        problem: &Problem,
        conditions: &[Condition],
        multipliers: &[f64],
    ) -> DMatrix<f64> {
        let count = self.intervals.len();
        let mut hessian = DMatrix::zeros(count, count);
        let mut curved: Vec<[f64; 6]> = Vec::with_capacity(count);
        Self::pull_back(problem, &self.intervals, conditions, multipliers, |k, backward| {
            let stage = self.intervals[k].hessian(problem, backward);
            let columns = &self.sensitivities[k];
            curved.clear();
            curved.extend(columns.iter().map(|column| -> [f64; 6] {
                core::array::from_fn(|i| {
                    stage[i].iter().zip(column).map(|(entry, value)| entry * value).sum()
                })
            }));
            for (j, curved_column) in curved.iter().enumerate() {
                for (i, column) in columns.iter().enumerate().take(j + 1) {
                    let term: f64 = column.iter().zip(curved_column).map(|(left, right)| left * right).sum();
                    hessian[(i, j)] += term;
                }
            }
            let input_row = &stage[INPUT_INDEX];
            for (j, column) in columns.iter().enumerate() {
                let term: f64 = input_row.iter().zip(column).map(|(left, right)| left * right).sum();
                hessian[(j, k)] += term;
            }
            hessian[(k, k)] += input_row[INPUT_INDEX];
        });
        hessian.fill_lower_triangle_with_upper_triangle();
        hessian
    }
}
