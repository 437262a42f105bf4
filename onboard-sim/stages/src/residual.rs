//! The distance of an iterate from optimality.

use core::array::from_fn;

use crate::condition::Condition;
use crate::intervals::Intervals;
use crate::iterate::Iterate;
use crate::model::Model;

/// Residuals of the optimality conditions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Residual {
    /// Largest component of the Lagrangian's gradient by states and inputs.
    pub(crate) stationarity: f64,
    /// Largest defect of the dynamics.
    pub(crate) defect: f64,
    /// Sum of the defects' magnitudes.
    pub(crate) infeasibility: f64,
    /// Smallest and largest product of a slack and its multiplier.
    products: (f64, f64),
}

impl Residual {
    /// The largest possible residuals.
    pub(crate) const NONE: Self = Self {
        stationarity: f64::INFINITY,
        defect: f64::INFINITY,
        infeasibility: f64::INFINITY,
        products: (f64::INFINITY, f64::INFINITY),
    };

    /// The residuals at an evaluated iterate; `pushes` is scratch for the objective's slope at each node.
    pub(crate) fn of<M: Model<NX, NU>, const NX: usize, const NU: usize>(
        model: &M,
        conditions: &[Condition],
        iterate: &Iterate<M, NX, NU>,
        pushes: &mut [[f64; NX]],
    ) -> Self {
        let ranges = model.input_ranges();
        let count = iterate.inputs.len();
        let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
        push_nodes(model, iterate, pushes);
        for (condition, elastic) in conditions.iter().zip(&iterate.elastics) {
            pushes[condition.node][condition.component] -= condition.sign * elastic.multiplier();
            for product in elastic.products() {
                (least, largest) = (least.min(product), largest.max(product));
            }
        }
        let mut slopes = [0.0_f64; NX];
        let mut defects = [0.0_f64; NX];
        let mut sums = [0.0_f64; NX];
        let mut input_slope = 0.0_f64;
        for (slope, push) in slopes.iter_mut().zip(&pushes[count]) {
            *slope = push.abs();
        }
        for (k, push) in pushes.iter().enumerate().take(count) {
            let gaps = iterate.defect(k);
            for i in 0..NX {
                defects[i] = larger(defects[i], gaps[i].abs());
                sums[i] += gaps[i].abs();
            }
            let (before, pulled) = iterate.intervals.pulled(k, &iterate.costates[k + 1]);
            let input = &iterate.inputs[k];
            let own = model.input_slope(k, input);
            for i in 0..NU {
                let (lower, upper) = (iterate.limits[k][i].lower, iterate.limits[k][i].upper);
                input_slope = larger(input_slope, (own[i] + pulled[i] - lower + upper).abs());
                let (below, above) = (lower * ranges[i].below(input[i]), upper * ranges[i].above(input[i]));
                least = smaller(least, smaller(below, above));
                largest = larger(largest, larger(below, above));
            }
            if k > 0 {
                for i in 0..NX {
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
    pub(crate) fn complementarity(&self, barrier: f64) -> f64 {
        (self.products.1 - barrier).max(barrier - self.products.0)
    }

    /// The largest of the residuals of the barrier problem.
    pub(crate) fn largest(&self, barrier: f64) -> f64 {
        self.stationarity.max(self.defect).max(self.complementarity(barrier))
    }
}

/// Writes the slope of the cost at each node, less the costate there.
pub(crate) fn push_nodes<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    iterate: &Iterate<M, NX, NU>,
    pushes: &mut [[f64; NX]],
) {
    for (node, push) in pushes.iter_mut().enumerate() {
        let slope = model.state_slope(node, &iterate.states[node]);
        *push = from_fn(|i| slope[i] - iterate.costates[node][i]);
    }
}

/// The larger of two numbers, in one instruction.
#[inline]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, in one instruction.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
