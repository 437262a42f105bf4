//! The solver on problems of several sizes: 2 states and 1 input, 4 and 2, 5 and 3, 13 and 3; and
//! the optimality conditions, evaluated without the solver's code.

mod double_integrator;
mod linear_quadratic;
mod polynomial;
mod rigid_body;

use self::polynomial::Polynomial;
use crate::{Model, Outcome, Start, Status, Workspace};

/// Solves, and expects convergence.
fn solved<M: Model<NX, NU>, const NX: usize, const NU: usize>(model: &M) -> (Workspace<M, NX, NU>, Outcome) {
    let mut workspace = Workspace::default();
    let outcome = workspace.solve(model, None);
    assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
    (workspace, outcome)
}

/// A stored solution.
struct Solution<const NX: usize, const NU: usize> {
    states: Vec<[f64; NX]>,
    inputs: Vec<[f64; NU]>,
    costates: Vec<[f64; NX]>,
    limit_multipliers: Vec<[[f64; 2]; NU]>,
    condition_multipliers: Vec<f64>,
}

impl<const NX: usize, const NU: usize> Solution<NX, NU> {
    fn of<M: Model<NX, NU>>(workspace: &Workspace<M, NX, NU>) -> Self {
        Self {
            states: workspace.states().to_vec(),
            inputs: workspace.inputs().to_vec(),
            costates: workspace.costates().to_vec(),
            limit_multipliers: workspace.limit_multipliers().collect(),
            condition_multipliers: workspace.condition_multipliers().collect(),
        }
    }

    fn start(&self) -> Start<'_, NX, NU> {
        let Self { states, inputs, costates, limit_multipliers, condition_multipliers } = self;
        Start { states, inputs, costates, limit_multipliers, condition_multipliers }
    }

    /// Largest difference between the inputs.
    fn farthest_input(&self, other: &Self) -> f64 {
        let pairs = self.inputs.as_flattened().iter().zip(other.inputs.as_flattened());
        pairs.fold(0.0, |most, (one, other)| most.max((one - other).abs()))
    }
}

// The optimality conditions of a solution, evaluated without the solver's code.

/// The largest errors of the optimality conditions.
#[derive(Debug, Default)]
struct Optimality {
    /// Gradient of the Lagrangian.
    gradient: f64,
    /// Defects of the dynamics.
    defect: f64,
    /// Limits and conditions broken, multipliers out of range, slacks times multipliers.
    complementarity: f64,
    /// Sum of the slacks times multipliers.
    gap: f64,
    /// Number of inputs at a limit.
    at_limit: usize,
    /// Number of inequalities that hold as equations.
    held: usize,
}

impl Optimality {
    fn of<const NX: usize, const NU: usize>(
        model: &Polynomial<NX, NU>,
        solved: &Workspace<Polynomial<NX, NU>, NX, NU>,
    ) -> Self {
        const NEAR: f64 = 1e-5;
        let mut found = Self::default();
        let (states, inputs, costates) = (solved.states(), solved.inputs(), solved.costates());
        let mut gradients: Vec<[f64; NX]> =
            states.iter().enumerate().map(|(node, state)| model.state_slope(node, state)).collect();
        let worse = |most: &mut f64, error: f64| {
            assert!(error.is_finite(), "{error}");
            *most = most.max(error.abs());
        };
        for (k, limits) in solved.limit_multipliers().enumerate() {
            let (end, a, b) = model.step(&states[k], &inputs[k]);
            let mut input_gradient = model.input_slope(k, &inputs[k]);
            for i in 0..NX {
                worse(&mut found.defect, end[i] - states[k + 1][i]);
                gradients[k + 1][i] -= costates[k + 1][i];
                for j in 0..NX {
                    gradients[k][j] += a[i][j] * costates[k + 1][i];
                }
                for j in 0..NU {
                    input_gradient[j] += b[i][j] * costates[k + 1][i];
                }
            }
            for i in 0..NU {
                let [lower, upper] = limits[i];
                let (input, range) = (inputs[k][i], model.ranges[i]);
                let (below, above) = (input - range.lower, range.upper - input);
                worse(&mut found.gradient, input_gradient[i] - lower + upper);
                for (slack, multiplier) in [(below, lower), (above, upper)] {
                    worse(&mut found.complementarity, slack * multiplier);
                    found.gap += (slack * multiplier).abs();
                    worse(&mut found.complementarity, slack.min(0.0));
                    worse(&mut found.complementarity, multiplier.min(0.0));
                    found.at_limit += usize::from(slack < NEAR);
                }
            }
        }
        for (condition, multiplier) in model.conditions.iter().zip(solved.condition_multipliers()) {
            gradients[condition.node][condition.component] -= condition.sign * multiplier;
            let value = condition.value(states);
            let (over, under) = (value.max(0.0), (-value).max(0.0));
            let least = if condition.equality { -model.penalty } else { 0.0 };
            worse(&mut found.complementarity, over * (multiplier - least));
            worse(&mut found.complementarity, under * (model.penalty - multiplier));
            found.gap += (over * (multiplier - least)).abs() + (under * (model.penalty - multiplier)).abs();
            worse(&mut found.complementarity, (multiplier - least).min(0.0));
            worse(&mut found.complementarity, (model.penalty - multiplier).min(0.0));
            found.held += usize::from(!condition.equality && value.abs() < NEAR);
        }
        for gradient in gradients.iter().skip(1).flatten() {
            worse(&mut found.gradient, *gradient);
        }
        found
    }

    fn assert_within(&self, tolerance: f64) {
        let Self { gradient, defect, complementarity, .. } = self;
        assert!(gradient.max(*defect).max(*complementarity) < tolerance, "{self:?}");
    }
}
