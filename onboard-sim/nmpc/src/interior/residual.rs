//! The distance of an iterate from optimality.

use super::iterate::Iterate;
use super::lanes::LANES;
use crate::Problem;
use crate::problem::Condition;

/// Residuals of the optimality conditions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Residual {
    /// Largest component of the Lagrangian's gradient by states and inputs.
    pub(super) stationarity: f64,
    /// Largest defect of the dynamics.
    pub(super) defect: f64,
    /// Sum of the defects' magnitudes.
    pub(super) infeasibility: f64,
    /// Smallest and largest product of a slack and its multiplier.
    products: (f64, f64),
}

impl Residual {
    /// The largest possible residuals.
    pub(super) const NONE: Self = Self {
        stationarity: f64::INFINITY,
        defect: f64::INFINITY,
        infeasibility: f64::INFINITY,
        products: (f64::INFINITY, f64::INFINITY),
    };

    /// The residuals at an evaluated iterate; `pushes` is scratch for the objective's slope at each node.
    pub(super) fn of(
        problem: &Problem,
        conditions: &[Condition],
        iterate: &Iterate,
        pushes: &mut [[f64; 6]],
    ) -> Self {
        let limit = problem.gimbal_limit_rad;
        let count = iterate.inputs_rad.len();
        let weights = problem.state_weights.map(|weight| weight * problem.step_s);
        let input_weight = problem.input_weight * problem.step_s;
        let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
        for (push, (state, costate)) in pushes.iter_mut().zip(iterate.states.iter().zip(&iterate.costates)) {
            let deviation = problem.deviation(state);
            *push = core::array::from_fn(|i| weights[i] * deviation[i] - costate[i]);
        }
        for (condition, elastic) in conditions.iter().zip(&iterate.elastics) {
            pushes[condition.node][condition.component] -= condition.sign * elastic.multiplier();
            for product in elastic.products() {
                (least, largest) = (least.min(product), largest.max(product));
            }
        }
        let mut slopes = [0.0_f64; 6];
        let mut defects = [0.0_f64; 6];
        let mut sums = [0.0_f64; 6];
        let mut input_slope = 0.0_f64;
        for (slope, push) in slopes.iter_mut().zip(&pushes[count]) {
            *slope = push.abs();
        }
        for (k, push) in pushes.iter().enumerate().take(count) {
            let (block, lane) = (&iterate.blocks[k / LANES], k % LANES);
            let gaps = iterate.defect(k);
            for i in 0..6 {
                defects[i] = larger(defects[i], gaps[i].abs());
                sums[i] += gaps[i].abs();
            }
            let pulled = |j: usize| block.pulled[j].0[lane];
            let (lower, upper) = (iterate.limits[k].lower, iterate.limits[k].upper);
            let input = iterate.inputs_rad[k];
            input_slope = larger(input_slope, (input_weight * input + pulled(4) - lower + upper).abs());
            let (below, above) = (lower * (limit + input), upper * (limit - input));
            least = smaller(least, smaller(below, above));
            largest = larger(largest, larger(below, above));
            if k > 0 {
                let later = &iterate.costates[k + 1];
                let before = [later[0], later[1], pulled(0), pulled(1), pulled(2), pulled(3)];
                for i in 0..6 {
                    slopes[i] = larger(slopes[i], (push[i] + before[i]).abs());
                }
            }
        }
        // Comparisons ignore NaN; a sum does not.
        let infeasibility: f64 = sums.iter().sum();
        if !infeasibility.is_finite() {
            return Self::NONE;
        }
        Self {
            stationarity: slopes.into_iter().fold(input_slope, larger),
            defect: defects.into_iter().fold(0.0, larger),
            infeasibility,
            products: (least, largest),
        }
    }

    /// Largest distance of a product of a slack and its multiplier from the barrier.
    pub(super) fn complementarity(&self, barrier: f64) -> f64 {
        (self.products.1 - barrier).max(barrier - self.products.0)
    }

    /// The largest of the residuals of the barrier problem.
    pub(super) fn largest(&self, barrier: f64) -> f64 {
        self.stationarity.max(self.defect).max(self.complementarity(barrier))
    }
}

/// The larger of two numbers, in one instruction.
#[inline]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, in one instruction.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
