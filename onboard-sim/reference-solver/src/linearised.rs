//! Exact first and second derivatives of one interval, which is the RK4 step and the cost at its end; and cost, conditions
//! and curvature condensed onto the inputs.
//!
//! Notation as in the step itself: `X_1..X_4` the stage states, `k_i = f(X_i, delta)`. Tangents are by the seven
//! stage variables, the state at the interval's beginning and its input. The step is a composition in which only
//! `f` is nonlinear, so the second derivative of `adjoint . step` is the sum over the stages of (tangent of the
//! stage)^T (second derivative of the adjoint-weighted `f`) (tangent of the stage).

use nalgebra::{DMatrix, DVector};
use nmpc::dynamics::{INPUT_INDEX, PlanarModel, StageHessian, StageJacobian};
use nmpc::problem::{Condition, Problem};
use nmpc::rollout::{STAGE_STEPS, STAGE_WEIGHTS, Trajectory, stages};

/// The linearised interval.
#[derive(Debug, Clone)]
pub(super) struct Interval {
    points: [[f64; 6]; 4],
    gimbal_rad: f64,
    thrust_n: f64,
    model: PlanarModel,
    /// Derivative of each stage's slope by its own state and the input.
    jacobians: [StageJacobian; 4],
    /// Derivative of each stage's state by the stage variables.
    tangents: [StageJacobian; 4],
    /// The state after the interval.
    after: [f64; 6],
    /// Derivative of the state after the interval by the stage variables.
    pub(super) step: StageJacobian,
}

/// The result of a backward pass over an interval.
pub(super) struct Backward {
    /// Adjoint of the state at the interval's beginning.
    pub(super) adjoint: [f64; 6],
    /// Derivative by the interval's input.
    pub(super) input_gradient: f64,
    /// Adjoint of each stage's slope.
    slope_adjoints: [[f64; 6]; 4],
}

impl Interval {
    /// Linearises interval `k` about a state and an input.
    pub(super) fn about(problem: &Problem, k: usize, state: &[f64; 6], gimbal_rad: f64) -> Self {
        let (points, after) = stages(problem, k, state, gimbal_rad);
        let (thrust_n, model) = (problem.thrust_n[k], problem.model_at(k));
        let jacobians = points.map(|point| model.jacobian(&point, gimbal_rad, thrust_n));
        let mut identity = [[0.0; 7]; 6];
        for (row, line) in identity.iter_mut().enumerate() {
            line[row] = 1.0;
        }
        let mut tangents = [identity; 4];
        let mut step = identity;
        for stage in 0..4 {
            let slope = slope_tangent(&jacobians[stage], &tangents[stage]);
            add_scaled(&mut step, &slope, STAGE_WEIGHTS[stage] * problem.step_s);
            if let Some(along_step) = STAGE_STEPS.get(stage) {
                add_scaled(&mut tangents[stage + 1], &slope, along_step * problem.step_s);
            }
        }
        Self { points, gimbal_rad, thrust_n, model, jacobians, tangents, after, step }
    }

    /// Pulls the adjoint of the state after the interval, and the interval's own cost, back to its beginning.
    pub(super) fn backward(&self, problem: &Problem, adjoint_after: &[f64; 6]) -> Backward {
        let step_s = problem.step_s;
        let deviation = problem.deviation(&self.after);
        let after: [f64; 6] =
            core::array::from_fn(|i| adjoint_after[i] + step_s * problem.state_weights[i] * deviation[i]);
        let mut slope_adjoints = [[0.0; 6]; 4];
        let mut adjoint = after;
        let mut input_gradient = step_s * problem.input_weight * self.gimbal_rad;
        let mut later_point_adjoint = [0.0; 6];
        for stage in (0..4).rev() {
            let weight_s = STAGE_WEIGHTS[stage] * step_s;
            // No later stage depends on the slope of the last stage.
            let along_s = STAGE_STEPS.get(stage).map_or(0.0, |along| along * step_s);
            let slope_adjoint: [f64; 6] =
                core::array::from_fn(|i| weight_s * after[i] + along_s * later_point_adjoint[i]);
            let jacobian = &self.jacobians[stage];
            let pulled = |column: usize| -> f64 {
                slope_adjoint.iter().zip(jacobian).map(|(weight, row)| weight * row[column]).sum()
            };
            let point_adjoint: [f64; 6] = core::array::from_fn(pulled);
            input_gradient += pulled(INPUT_INDEX);
            for (sum, term) in adjoint.iter_mut().zip(&point_adjoint) {
                *sum += term;
            }
            slope_adjoints[stage] = slope_adjoint;
            later_point_adjoint = point_adjoint;
        }
        Backward { adjoint, input_gradient, slope_adjoints }
    }

    /// Second derivative, by the stage variables, of the interval's cost plus the adjoint times its step.
    pub(super) fn hessian(&self, problem: &Problem, backward: &Backward) -> StageHessian {
        let mut sum = [[0.0; 7]; 7];
        for (weight, row) in problem.state_weights.iter().zip(&self.step) {
            add_square(&mut sum, row, problem.step_s * weight);
        }
        sum[INPUT_INDEX][INPUT_INDEX] += problem.step_s * problem.input_weight;
        for stage in 0..4 {
            let inner = self.model.weighted_hessian(
                &self.points[stage],
                self.gimbal_rad,
                self.thrust_n,
                &backward.slope_adjoints[stage],
            );
            add_congruence(&mut sum, &inner, &self.tangents[stage]);
        }
        sum
    }
}

/// Derivative of a slope by the stage variables: its own Jacobian after the stage's tangent.
fn slope_tangent(jacobian: &StageJacobian, tangent: &StageJacobian) -> StageJacobian {
    let mut product = [[0.0; 7]; 6];
    for (line, row) in product.iter_mut().zip(jacobian) {
        for (factor, tangent_row) in row.iter().zip(tangent) {
            for (entry, term) in line.iter_mut().zip(tangent_row) {
                *entry += factor * term;
            }
        }
        line[INPUT_INDEX] += row[INPUT_INDEX];
    }
    product
}

fn add_scaled(sum: &mut StageJacobian, term: &StageJacobian, scale: f64) {
    for (line, term_line) in sum.iter_mut().zip(term) {
        for (entry, value) in line.iter_mut().zip(term_line) {
            *entry += scale * value;
        }
    }
}

/// `sum += scale * row^T row`.
fn add_square(sum: &mut StageHessian, row: &[f64; 7], scale: f64) {
    for (line, left) in sum.iter_mut().zip(row) {
        for (entry, right) in line.iter_mut().zip(row) {
            *entry += scale * left * right;
        }
    }
}

/// `sum += [tangent; e_input]^T inner [tangent; e_input]`.
fn add_congruence(sum: &mut StageHessian, inner: &StageHessian, tangent: &StageJacobian) {
    let mut right = [[0.0; 7]; 7];
    for (line, row) in right.iter_mut().zip(inner) {
        for (factor, tangent_row) in row.iter().zip(tangent) {
            for (entry, term) in line.iter_mut().zip(tangent_row) {
                *entry += factor * term;
            }
        }
        line[INPUT_INDEX] += row[INPUT_INDEX];
    }
    for (row, right_row) in right.iter().enumerate() {
        if row == INPUT_INDEX {
            for (entry, value) in sum[INPUT_INDEX].iter_mut().zip(right_row) {
                *entry += value;
            }
            continue;
        }
        for (column, factor) in tangent[row].iter().enumerate() {
            for (entry, value) in sum[column].iter_mut().zip(right_row) {
                *entry += factor * value;
            }
        }
    }
}

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
        mut visit: impl FnMut(usize, &Backward),
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

#[cfg(test)]
mod tests {
    use nmpc::dynamics::{ModelKind, PlanarState};
    use proptest::prelude::*;

    use super::*;

    const VARIABLES: usize = 7;

    fn problem(kind: ModelKind) -> Problem {
        let mut problem = nmpc::paper::problem(PlanarState::default(), 1);
        problem.model.kind = kind;
        problem
    }

    fn moved(point: &[f64; VARIABLES], variable: usize, by: f64) -> ([f64; 6], f64) {
        let mut point = *point;
        point[variable] += by;
        let [x, z, theta, u, w, q, delta] = point;
        ([x, z, theta, u, w, q], delta)
    }

    fn interval_cost(problem: &Problem, state: &[f64; 6], delta: f64) -> f64 {
        problem.step_s * problem.cost_rate(&stages(problem, 0, state, delta).1, delta)
    }

    fn gradient(problem: &Problem, state: &[f64; 6], delta: f64, adjoint: &[f64; 6]) -> [f64; VARIABLES] {
        let backward = Interval::about(problem, 0, state, delta).backward(problem, adjoint);
        let [x, z, theta, u, w, q] = backward.adjoint;
        [x, z, theta, u, w, q, backward.input_gradient]
    }

    fn point() -> impl Strategy<Value = [f64; VARIABLES]> {
        (-20.0..20.0, 0.0..20.0, 0.5..2.6, -6.0..-1.0, -3.0..3.0, -1.0..1.0, -0.34..0.34)
            .prop_map(|(x, z, theta, u, w, q, delta)| [x, z, theta, u, w, q, delta])
    }

    proptest! {
        #[test]
        fn val_finite_differences_step_tangent(point in point()) {
            let step = 1e-5;
            for kind in [ModelKind::Consistent, ModelKind::AsPrinted] {
                let problem = problem(kind);
                let (state, delta) = moved(&point, 0, 0.0);
                let interval = Interval::about(&problem, 0, &state, delta);
                for variable in 0..VARIABLES {
                    let at = |by| {
                        let (state, delta) = moved(&point, variable, by);
                        stages(&problem, 0, &state, delta).1
                    };
                    let (ahead, behind) = (at(step), at(-step));
                    for row in 0..6 {
                        let expected = (ahead[row] - behind[row]) / (2.0 * step);
                        let error = (interval.step[row][variable] - expected).abs();
                        prop_assert!(error < 1e-8 * (1.0 + expected.abs()), "[{row}][{variable}] {error}");
                    }
                }
            }
        }

        #[test]
        fn val_finite_differences_interval_gradient_and_hessian(
            point in point(),
            adjoint in prop::array::uniform6(-50.0..50.0_f64),
        ) {
            let step = 1e-5;
            for kind in [ModelKind::Consistent, ModelKind::AsPrinted] {
                let problem = problem(kind);
                let (state, delta) = moved(&point, 0, 0.0);
                let interval = Interval::about(&problem, 0, &state, delta);
                let backward = interval.backward(&problem, &adjoint);
                let hessian = interval.hessian(&problem, &backward);
                let analytic = gradient(&problem, &state, delta, &adjoint);
                let value = |by, variable| {
                    let (state, delta) = moved(&point, variable, by);
                    let after = stages(&problem, 0, &state, delta).1;
                    let adjoint_part: f64 = adjoint.iter().zip(after).map(|(weight, value)| weight * value).sum();
                    adjoint_part + interval_cost(&problem, &state, delta)
                };
                for variable in 0..VARIABLES {
                    let expected = (value(step, variable) - value(-step, variable)) / (2.0 * step);
                    let error = (analytic[variable] - expected).abs();
                    prop_assert!(error < 1e-6 * (1.0 + expected.abs()), "gradient [{variable}] {error}");

                    let at = |by| {
                        let (state, delta) = moved(&point, variable, by);
                        gradient(&problem, &state, delta, &adjoint)
                    };
                    let (ahead, behind) = (at(step), at(-step));
                    for row in 0..VARIABLES {
                        let expected = (ahead[row] - behind[row]) / (2.0 * step);
                        let error = (hessian[row][variable] - expected).abs();
                        prop_assert!(error < 1e-5 * (1.0 + expected.abs()), "[{row}][{variable}] {error}");
                    }
                }
            }
        }
    }
}
