//! The optimality conditions of a solution, evaluated without the solver's own code.

use super::polynomial::Polynomial;
use crate::{Model, Workspace};

/// The largest errors of the optimality conditions, and what they hold for.
#[derive(Debug, Default)]
pub(super) struct Optimality {
    /// Gradient of the Lagrangian.
    pub(super) gradient: f64,
    /// Defects of the dynamics.
    pub(super) defect: f64,
    /// Limits and conditions broken, multipliers out of range, slacks times multipliers.
    pub(super) complementarity: f64,
    /// Number of inputs at a limit.
    pub(super) at_limit: usize,
    /// Number of inequalities that hold as equations.
    pub(super) held: usize,
}

impl Optimality {
    pub(super) fn of<const NX: usize, const NU: usize>(
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
            let least = if condition.equality { -model.price } else { 0.0 };
            worse(&mut found.complementarity, over * (multiplier - least));
            worse(&mut found.complementarity, under * (model.price - multiplier));
            worse(&mut found.complementarity, (multiplier - least).min(0.0));
            worse(&mut found.complementarity, (model.price - multiplier).min(0.0));
            found.held += usize::from(!condition.equality && value.abs() < NEAR);
        }
        for gradient in gradients.iter().skip(1).flatten() {
            worse(&mut found.gradient, *gradient);
        }
        found
    }

    pub(super) fn assert_within(&self, tolerance: f64) {
        let Self { gradient, defect, complementarity, .. } = self;
        assert!(gradient.max(*defect).max(*complementarity) < tolerance, "{self:?}");
    }
}
