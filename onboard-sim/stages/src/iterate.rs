//! An iterate: the states, inputs and multipliers of every node, with the intervals evaluated there.

use alloc::vec::Vec;
use core::array::from_fn;

use crate::barrier::{Elastic, Limits};
use crate::condition::Condition;
use crate::intervals::Intervals;
use crate::model::Model;

/// A point of the primal-dual space.
#[derive(Debug, Clone)]
pub(crate) struct Iterate<M: Model<NX, NU>, const NX: usize, const NU: usize> {
    /// States at the nodes, one more than inputs; the first is the model's own.
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

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Default for Iterate<M, NX, NU> {
    fn default() -> Self {
        Self {
            states: Vec::new(),
            inputs: Vec::new(),
            costates: Vec::new(),
            limits: Vec::new(),
            elastics: Vec::new(),
            intervals: M::Intervals::default(),
        }
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Iterate<M, NX, NU> {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(crate) fn resize(&mut self, intervals: usize, conditions: usize) {
        self.states.resize(intervals + 1, [0.0; NX]);
        self.inputs.resize(intervals, [0.0; NU]);
        self.costates.resize(intervals + 1, [0.0; NX]);
        self.limits.resize(intervals, [Limits::default(); NU]);
        self.elastics.resize(conditions, Elastic::default());
        self.intervals.resize(intervals);
    }

    /// Moves to the point of another iterate of the same size. The intervals there are not evaluated yet.
    pub(crate) fn move_to(&mut self, point: &Self) {
        self.states.copy_from_slice(&point.states);
        self.inputs.copy_from_slice(&point.inputs);
        self.costates.copy_from_slice(&point.costates);
        self.limits.copy_from_slice(&point.limits);
        self.elastics.copy_from_slice(&point.elastics);
    }

    /// Evaluates every interval at the iterate, with derivatives if asked for.
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

    /// Cost plus the price of every broken condition.
    pub(crate) fn price(&self, model: &M, conditions: &[Condition]) -> f64 {
        let broken: f64 = conditions.iter().map(|row| row.violation(row.value(&self.states))).sum();
        self.cost(model) + model.settings().price * broken
    }

    /// The largest violation of any condition.
    pub(crate) fn worst_violation(&self, conditions: &[Condition]) -> f64 {
        conditions.iter().map(|row| row.violation(row.value(&self.states))).fold(0.0, f64::max)
    }

    /// The objective of the barrier problem: cost, elastics at their price and the logarithms of all slacks.
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
        let mut priced = 0.0;
        for elastics in self.elastics.chunks(FACTORS) {
            let product: f64 = elastics.iter().map(|elastic| elastic.above * elastic.below).product();
            logarithms += libm::log(product);
            priced += elastics.iter().map(Elastic::broken).sum::<f64>();
        }
        self.cost(model) + model.settings().price * priced - barrier * logarithms
    }

    /// Rolls the inputs out from the first state; the states then have no defects.
    pub(crate) fn roll_out(&mut self, model: &M) {
        for (k, input) in self.inputs.iter().enumerate() {
            self.states[k + 1] = model.next(k, &self.states[k], input);
        }
    }
}
