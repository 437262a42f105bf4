//! An iterate: the states, inputs and multipliers of every node, with the intervals evaluated
//! there, and its distance from optimality.

use alloc::vec::Vec;
use core::array::from_fn;

use crate::barrier::{Elastic, Limits};
use crate::intervals::Intervals;
use crate::model::{Condition, Model};

/// A point of the primal-dual space.
#[derive(Debug, Clone)]
pub(crate) struct Iterate<M: Model<NX, NU>, const NX: usize, const NU: usize> {
    /// States at the nodes, one more than inputs; the first is that of the model.
    pub(crate) states: Vec<[f64; NX]>,
    /// Inputs of each interval.
    pub(crate) inputs: Vec<[f64; NU]>,
    /// Multiplier of the dynamics into each node; the first is not used.
    pub(crate) costates: Vec<[f64; NX]>,
    /// Multipliers of each input's limits.
    pub(crate) limits: Vec<[Limits; NU]>,
    /// Slacks and multiplier of each condition.
    pub(crate) elastics: Vec<Elastic>,
    pub(crate) intervals: M::Intervals,
}

empty!(Iterate { states, inputs, costates, limits, elastics, intervals });

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Iterate<M, NX, NU> {
    /// Makes room for the point, not for its intervals; allocates only if no earlier problem was
    /// this long.
    pub(crate) fn resize(&mut self, intervals: usize, conditions: usize) {
        self.states.resize(intervals + 1, [0.0; NX]);
        self.inputs.resize(intervals, [0.0; NU]);
        self.costates.resize(intervals + 1, [0.0; NX]);
        self.limits.resize(intervals, [Limits::default(); NU]);
        self.elastics.resize(conditions, Elastic::default());
    }

    /// Moves to the point of another iterate of the same size. The intervals there are not
    /// evaluated yet.
    pub(crate) fn move_to(&mut self, point: &Self) {
        self.states.copy_from_slice(&point.states);
        self.inputs.copy_from_slice(&point.inputs);
        self.costates.copy_from_slice(&point.costates);
        self.limits.copy_from_slice(&point.limits);
        self.elastics.copy_from_slice(&point.elastics);
    }

    /// Evaluates every interval at the iterate, with derivatives if requested.
    pub(crate) fn evaluate(&mut self, model: &M, derivatives: bool) {
        model.evaluate(&self.states, &self.inputs, &self.costates, derivatives, &mut self.intervals);
    }

    /// The defect: the difference between the end of interval `k` and the next node.
    #[inline]
    pub(crate) fn defect(&self, k: usize) -> [f64; NX] {
        let end = self.intervals.end(k);
        let next = &self.states[k + 1];
        from_fn(|i| end[i] - next[i])
    }

    /// Sum of all defects' magnitudes.
    pub(crate) fn infeasibility(&self) -> f64 {
        (0..self.inputs.len()).map(|k| self.defect(k).iter().map(|gap| gap.abs()).sum::<f64>()).sum()
    }

    /// The cost without penalties.
    pub(crate) fn cost(&self, model: &M) -> f64 {
        model.cost(&self.states, &self.inputs)
    }

    /// Cost plus the penalty of every broken condition.
    pub(crate) fn merit(&self, model: &M, conditions: &[Condition]) -> f64 {
        let broken: f64 = conditions.iter().map(|row| row.violation(row.value(&self.states))).sum();
        self.cost(model) + model.settings().penalty * broken
    }

    /// The largest violation of any condition.
    pub(crate) fn worst_violation(&self, conditions: &[Condition]) -> f64 {
        conditions.iter().map(|row| row.violation(row.value(&self.states))).fold(0.0, f64::max)
    }

    /// The objective of the barrier problem: cost, elastics at their penalty and the logarithms of
    /// all slacks.
    pub(crate) fn barrier_objective(&self, model: &M, barrier: f64) -> f64 {
        /// Number of factors per logarithm, small enough that their product does not underflow.
        const FACTORS: usize = 8;
        let ranges = model.input_ranges();
        let per_square = ranges.map(|range| 1.0 / (range.reach() * range.reach()));
        let mut logarithms = 0.0;
        for inputs in self.inputs.chunks((FACTORS / NU).max(1)) {
            let mut product = 1.0;
            for input in inputs {
                for i in 0..NU {
                    product *= ranges[i].above(input[i]) * ranges[i].below(input[i]) * per_square[i];
                }
            }
            logarithms += libm::log(product);
        }
        let mut broken = 0.0;
        for elastics in self.elastics.chunks(FACTORS) {
            let product: f64 = elastics.iter().map(|elastic| elastic.above * elastic.below).product();
            logarithms += libm::log(product);
            broken += elastics.iter().map(Elastic::broken).sum::<f64>();
        }
        self.cost(model) + model.settings().penalty * broken - barrier * logarithms
    }

    /// Rolls the inputs out from the first state; the states then have no defects.
    pub(crate) fn roll_out(&mut self, model: &M) {
        for (k, input) in self.inputs.iter().enumerate() {
            self.states[k + 1] = model.next(k, &self.states[k], input);
        }
    }
}

// The distance of an iterate from optimality.

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

    /// The residuals at an evaluated iterate; `pushes` is scratch for the objective's slope at each
    /// node.
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
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, in one instruction.
#[inline]
pub fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
