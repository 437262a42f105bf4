//! An iterate: the states, inputs and multipliers of every node, with the intervals evaluated there.
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

use alloc::vec::Vec;

use pulp::{Arch, NullaryFnOnce};

use super::barrier::{Elastic, Limits};
use super::block::{Block, Constants, Points, blocks_for};
use super::interval::evaluate;
use super::lanes::LANES;
use crate::Problem;
use crate::problem::Condition;
use crate::rollout::stages;

/// A point of the primal-dual space.
#[derive(Debug, Clone, Default)]
pub(super) struct Iterate {
    /// States at the nodes, one more than inputs; the first is the problem's own.
    pub(super) states: Vec<[f64; 6]>,
    /// Gimbal angle of each interval, rad.
    pub(super) inputs_rad: Vec<f64>,
    /// Multiplier of the dynamics into each node; the first is not used.
    pub(super) costates: Vec<[f64; 6]>,
    /// Multipliers of each input's limits.
    pub(super) limits: Vec<Limits>,
    /// Slacks and multiplier of each condition.
    pub(super) elastics: Vec<Elastic>,
    /// The intervals, several to a block.
    pub(super) blocks: Vec<Block>,
}

impl Iterate {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(super) fn resize(&mut self, intervals: usize, conditions: usize) {
        self.states.resize(intervals + 1, [0.0; 6]);
        self.inputs_rad.resize(intervals, 0.0);
        self.costates.resize(intervals + 1, [0.0; 6]);
        self.limits.resize(intervals, Limits::default());
        self.elastics.resize(conditions, Elastic::default());
        self.blocks.resize(blocks_for(intervals), Block::EMPTY);
    }

    /// Evaluates every interval at the iterate, with tangents and curvature if asked for.
    pub(super) fn evaluate<const DERIVATIVES: bool>(&mut self, constants: &Constants, problem: &Problem) {
        let count = self.inputs_rad.len();
        let (thrust_n, mass_kg) = (&problem.thrust_n, &problem.mass_kg);
        let across = constants.pushed_across();
        let mut points = Points::rest(constants);
        let arch = Arch::new();
        for (index, block) in self.blocks.iter_mut().enumerate() {
            for lane in 0..LANES {
                // Lanes beyond the end repeat the last interval.
                let k = (index * LANES + lane).min(count - 1);
                for i in 0..6 {
                    points.state[i].0[lane] = self.states[k][i];
                    points.costate[i].0[lane] = self.costates[k + 1][i];
                }
                points.gimbal.0[lane] = self.inputs_rad[k];
                points.thrust.0[lane] = thrust_n[k];
                if let Some(mass_kg) = mass_kg.get(k) {
                    points.inverse_mass.0[lane] = 1.0 / mass_kg;
                    points.lightness.0[lane] = constants.mass_kg / mass_kg;
                }
            }
            let points = &points;
            match (constants.printed, across) {
                (true, _) => Kernel::<DERIVATIVES, true, false> { constants, points, block }.run(arch),
                (false, true) => Kernel::<DERIVATIVES, false, true> { constants, points, block }.run(arch),
                (false, false) => Kernel::<DERIVATIVES, false, false> { constants, points, block }.run(arch),
            }
        }
    }

    /// The defect: the difference between the end of interval `k` and the next node.
    #[inline]
    pub(super) fn defect(&self, k: usize) -> [f64; 6] {
        let after = &self.blocks[k / LANES].after;
        let next = &self.states[k + 1];
        core::array::from_fn(|i| after[i].0[k % LANES] - next[i])
    }

    /// Sum of all defects' magnitudes.
    pub(super) fn infeasibility(&self) -> f64 {
        (0..self.inputs_rad.len()).map(|k| self.defect(k).iter().map(|gap| gap.abs()).sum::<f64>()).sum()
    }

    /// Running cost (Eq. 28 of the landing paper).
    pub(super) fn cost(&self, problem: &Problem) -> f64 {
        let mut squares = [0.0; 6];
        for state in &self.states[1..] {
            let deviation = problem.deviation(state);
            for (sum, value) in squares.iter_mut().zip(&deviation) {
                *sum += value * value;
            }
        }
        let state_part: f64 =
            squares.iter().zip(&problem.state_weights).map(|(sum, weight)| sum * weight).sum();
        let input_part: f64 = self.inputs_rad.iter().map(|input| input * input).sum();
        0.5 * problem.step_s * (state_part + problem.input_weight * input_part)
    }

    /// Cost plus the price of every broken condition.
    pub(super) fn price(&self, problem: &Problem, conditions: &[Condition]) -> f64 {
        let broken: f64 = conditions.iter().map(|row| row.violation(row.value(&self.states))).sum();
        self.cost(problem) + problem.solver.terminal_penalty * broken
    }

    /// The largest violation of any condition, m, rad, m/s or rad/s.
    pub(super) fn worst_violation(&self, conditions: &[Condition]) -> f64 {
        conditions.iter().map(|row| row.violation(row.value(&self.states))).fold(0.0, f64::max)
    }

    /// The objective of the barrier problem: cost, elastics at their price and the logarithms of all slacks.
    pub(super) fn barrier_objective(&self, problem: &Problem, barrier: f64) -> f64 {
        /// Number of factors per logarithm, small enough that their product does not underflow.
        const FACTORS: usize = 8;
        let limit = problem.gimbal_limit_rad;
        let per_square = 1.0 / (limit * limit);
        let mut logarithms = 0.0;
        for inputs in self.inputs_rad.chunks(FACTORS) {
            let product: f64 =
                inputs.iter().map(|input| (limit - input) * (limit + input) * per_square).product();
            logarithms += libm::log(product);
        }
        let mut priced = 0.0;
        for elastics in self.elastics.chunks(FACTORS) {
            let product: f64 = elastics.iter().map(|elastic| elastic.above * elastic.below).product();
            logarithms += libm::log(product);
            priced += elastics.iter().map(Elastic::broken).sum::<f64>();
        }
        self.cost(problem) + problem.solver.terminal_penalty * priced - barrier * logarithms
    }

    /// Rolls the inputs out from the first state; the states then have no defects.
    pub(super) fn roll_out(&mut self, problem: &Problem) {
        for k in 0..self.inputs_rad.len() {
            let (_, next) = stages(problem, k, &self.states[k], self.inputs_rad[k]);
            self.states[k + 1] = next;
        }
    }
}

/// One block, evaluated in the widest vectors that the machine has.
struct Kernel<'a, const DERIVATIVES: bool, const PRINTED: bool, const ACROSS: bool> {
    constants: &'a Constants,
    points: &'a Points,
    block: &'a mut Block,
}

impl<const DERIVATIVES: bool, const PRINTED: bool, const ACROSS: bool> NullaryFnOnce
    for Kernel<'_, DERIVATIVES, PRINTED, ACROSS>
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        evaluate::<DERIVATIVES, PRINTED, ACROSS>(self.constants, self.points, self.block);
    }
}

impl<const DERIVATIVES: bool, const PRINTED: bool, const ACROSS: bool>
    Kernel<'_, DERIVATIVES, PRINTED, ACROSS>
{
    fn run(self, arch: Arch) {
        arch.dispatch(self);
    }
}
