//! How far an iterate is from optimal.

use super::iterate::Iterate;
use super::lanes::LANES;
use crate::nmpc::Problem;
use crate::nmpc::problem::Condition;

/// Residuals of the optimality conditions of the barrier problem.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Residual {
    /// Largest component of the Lagrangian's gradient by states and inputs.
    pub(super) stationarity: f64,
    /// Largest defect of the dynamics.
    pub(super) defect: f64,
    /// Largest complementarity product, less the barrier.
    pub(super) complementarity: f64,
}

impl Residual {
    /// The residuals at an evaluated iterate; `pushes` is scratch for the conditions' share at each node.
    pub(super) fn of(
        problem: &Problem,
        conditions: &[Condition],
        iterate: &Iterate,
        barrier: f64,
        pushes: &mut [[f64; 6]],
    ) -> Self {
        let limit = problem.gimbal_limit_rad;
        let count = iterate.inputs_rad.len();
        let weights = problem.state_weights.map(|weight| weight * problem.step_s);
        let input_weight = problem.input_weight * problem.step_s;
        let mut complementarity = 0.0_f64;
        for (push, state) in pushes.iter_mut().zip(&iterate.states) {
            let deviation = Problem::deviation(state);
            *push = core::array::from_fn(|i| weights[i] * deviation[i]);
        }
        for (condition, elastic) in conditions.iter().zip(&iterate.elastics) {
            pushes[condition.node][condition.component] -= condition.sign * elastic.multiplier();
            complementarity = complementarity.max(elastic.complementarity(barrier));
        }
        let (mut stationarity, mut defect) = (0.0_f64, 0.0_f64);
        for i in 0..6 {
            stationarity = stationarity.max((pushes[count][i] - iterate.costates[count][i]).abs());
        }
        for k in 0..count {
            let (block, lane) = (&iterate.blocks[k / LANES], k % LANES);
            for gap in iterate.defect(k) {
                defect = defect.max(gap.abs());
            }
            let pulled = |j: usize| block.pulled[j].0[lane];
            let (lower, upper) = (iterate.limits[k].lower, iterate.limits[k].upper);
            let input = iterate.inputs_rad[k];
            let slope = input_weight * input + pulled(4) - lower + upper;
            stationarity = stationarity.max(slope.abs());
            let products = [lower * (limit + input), upper * (limit - input)];
            for product in products {
                complementarity = complementarity.max((product - barrier).abs());
            }
            if k > 0 {
                let later = &iterate.costates[k + 1];
                let before = [later[0], later[1], pulled(0), pulled(1), pulled(2), pulled(3)];
                for i in 0..6 {
                    stationarity = stationarity.max((pushes[k][i] + before[i] - iterate.costates[k][i]).abs());
                }
            }
        }
        // `max` passes over what is not a number; a sum does not.
        if iterate.infeasibility().is_finite() {
            Self { stationarity, defect, complementarity }
        } else {
            Self { stationarity: f64::INFINITY, defect: f64::INFINITY, complementarity: f64::INFINITY }
        }
    }

    /// The largest of the residuals.
    pub(super) fn largest(&self) -> f64 {
        self.stationarity.max(self.defect).max(self.complementarity)
    }
}
