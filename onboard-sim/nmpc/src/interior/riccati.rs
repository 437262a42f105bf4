//! The Newton step by one backward and one forward sweep over the stages.
//!
//! ```text
//! minimise    sum over the nodes of (w_k dx^2 / 2 + s_k dx) + (curvature and input terms of every interval)
//! subject to  dx_{k+1} = A_k dx_k + b_k dd_k + r_k,   dx_0 = 0
//! ```
//!
//! The value function of the stages from `k` on is `dx' P dx / 2 + p' dx`. It contains the conditions with the
//! stiffness of their barrier. So `P` loses digits across the conditions, but only the curvature along them is needed.
//! The costates come from their own recursion, which does not use `P`.
//!
//! With one input the system has the right inertia exactly if `b' P b` plus the input's own curvature, one scalar per
//! stage, is positive at every stage.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use alloc::vec::Vec;

use pulp::{Arch, NullaryFnOnce};

use super::block::pair;
use super::iterate::Iterate;
use super::lanes::LANES;
use super::rows::{D, Interval, Q, T, U, W, WIDE, X, Z};

/// Smallest curvature by an input that counts as positive, relative to the input's own terms.
const LEAST_CURVATURE: f64 = 1e-11;

/// The feedback of the input at a stage: `dd = -(offset + gain' dx)`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Feedback {
    gain: [f64; 6],
    offset: f64,
    /// Second derivative by state and input, and the inverse of the second derivative by the input:
    /// `gain = cross * inverse`.
    cross: [f64; 6],
    inverse: f64,
}

/// The Newton step and its data.
#[derive(Debug, Clone, Default)]
pub(super) struct Sweep {
    /// Second derivative of the objective at each node, diagonal.
    pub(super) weights: Vec<[f64; 6]>,
    /// First derivative of the objective at each node.
    pub(super) slopes: Vec<[f64; 6]>,
    /// Second and first derivative of the objective by each input.
    pub(super) input_terms: Vec<(f64, f64)>,
    feedbacks: Vec<Feedback>,
    /// `P` of the node after each interval.
    values: Vec<[[f64; 6]; 6]>,
    /// Change of each state.
    pub(super) states: Vec<[f64; 6]>,
    /// Change of each input.
    pub(super) inputs: Vec<f64>,
    /// The costates after the step.
    pub(super) costates: Vec<[f64; 6]>,
    /// Fraction of the dynamics' curvature in the step.
    share: f64,
}

/// The backward sweep, in the widest vectors that the machine has.
struct Backward<'a> {
    sweep: &'a mut Sweep,
    iterate: &'a Iterate,
    step_s: f64,
}

impl NullaryFnOnce for Backward<'_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.sweep.eliminate(self.iterate, self.step_s)
    }
}

/// The backward sweep of the slopes alone, in the same vectors.
struct Again<'a> {
    sweep: &'a mut Sweep,
    iterate: &'a Iterate,
    step_s: f64,
}

impl NullaryFnOnce for Again<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.sweep.eliminate_again(self.iterate, self.step_s);
    }
}

/// The forward sweep, in the same vectors.
struct Forward<'a> {
    sweep: &'a mut Sweep,
    iterate: &'a Iterate,
    step_s: f64,
}

impl NullaryFnOnce for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.sweep.substitute(self.iterate, self.step_s);
    }
}

impl Sweep {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(super) fn resize(&mut self, intervals: usize) {
        self.weights.resize(intervals + 1, [0.0; 6]);
        self.slopes.resize(intervals + 1, [0.0; 6]);
        self.input_terms.resize(intervals, (0.0, 0.0));
        self.feedbacks.resize(intervals, Feedback::default());
        self.values.resize(intervals, [[0.0; 6]; 6]);
        self.states.resize(intervals + 1, [0.0; 6]);
        self.inputs.resize(intervals, 0.0);
        self.costates.resize(intervals + 1, [0.0; 6]);
    }

    /// The backward sweep with a fraction of the dynamics' curvature; returns whether the inertia is right.
    pub(super) fn backward(&mut self, iterate: &Iterate, step_s: f64, share: f64) -> bool {
        self.share = share;
        Arch::new().dispatch(Backward { sweep: self, iterate, step_s })
    }

    /// The backward sweep for new slopes and defects with the second derivatives of the last sweep.
    pub(super) fn backward_again(&mut self, iterate: &Iterate, step_s: f64) {
        Arch::new().dispatch(Again { sweep: self, iterate, step_s });
    }

    /// The forward sweep: states, inputs, and then the costates, backwards again.
    pub(super) fn forward(&mut self, iterate: &Iterate, step_s: f64) {
        Arch::new().dispatch(Forward { sweep: self, iterate, step_s });
    }

    /// [`backward`](Self::backward) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(super) fn eliminate(&mut self, iterate: &Iterate, step_s: f64) -> bool {
        let share = self.share;
        let count = self.inputs.len();
        let mut p = [[0.0; 6]; 6];
        for (i, weight) in self.weights[count].iter().enumerate() {
            p[i][i] = *weight;
        }
        let mut slope = self.slopes[count];

        for k in (0..count).rev() {
            let block = &iterate.blocks[k / LANES];
            let lane = k % LANES;
            let interval = Interval::of(block, lane, step_s);
            let residual = iterate.defect(k);
            self.values[k] = p;
            // P (A, b) by rows, P r + p, and (A, b)' P (A, b) by rows.
            let mut m = [[0.0; WIDE]; 6];
            for (product, row) in m.iter_mut().zip(&p) {
                *product = interval.pull(row);
            }
            let mut g = slope;
            for j in 0..6 {
                for i in 0..6 {
                    g[i] += p[j][i] * residual[j];
                }
            }
            let pulled = interval.pull(&g);
            let across = interval.square(&m);
            let h = |i: usize, j: usize| share * block.curvature[pair(i, j)].0[lane];
            let (own_curvature, own_slope) = self.input_terms[k];
            let curvature = across[D][D] + h(D, D) + own_curvature;
            let positive = curvature > LEAST_CURVATURE * (1.0 + own_curvature);
            if !positive {
                return false;
            }
            let inverse = 1.0 / curvature;
            let cross = [
                m[X][D],
                m[Z][D],
                across[D][0] + h(0, D),
                across[D][1] + h(1, D),
                across[D][2] + h(2, D),
                across[D][3] + h(3, D),
            ];
            let mut gain = cross;
            for entry in &mut gain {
                *entry *= inverse;
            }
            let offset = (own_slope + pulled[D]) * inverse;
            self.feedbacks[k] = Feedback { gain, offset, cross, inverse };
            if k == 0 {
                break;
            }

            let mut next = [
                [p[X][X], p[X][Z], m[X][0], m[X][1], m[X][2], m[X][3]],
                [p[Z][X], p[Z][Z], m[Z][0], m[Z][1], m[Z][2], m[Z][3]],
                [m[X][0], m[Z][0], across[0][0], across[0][1], across[0][2], across[0][3]],
                [m[X][1], m[Z][1], across[1][0], across[1][1], across[1][2], across[1][3]],
                [m[X][2], m[Z][2], across[2][0], across[2][1], across[2][2], across[2][3]],
                [m[X][3], m[Z][3], across[3][0], across[3][1], across[3][2], across[3][3]],
            ];
            for i in 0..4 {
                for j in 0..4 {
                    next[2 + i][2 + j] += if i <= j { h(i, j) } else { h(j, i) };
                }
            }
            for i in 0..6 {
                for j in 0..6 {
                    next[i][j] -= gain[i] * cross[j];
                }
            }
            for (i, weight) in self.weights[k].iter().enumerate() {
                next[i][i] += weight;
            }
            p = next;
            let slopes = &self.slopes[k];
            let g = [g[X], g[Z], pulled[0], pulled[1], pulled[2], pulled[3]];
            for i in 0..6 {
                slope[i] = slopes[i] + g[i] - cross[i] * offset;
            }
        }
        true
    }

    /// [`backward_again`](Self::backward_again) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(super) fn eliminate_again(&mut self, iterate: &Iterate, step_s: f64) {
        let count = self.inputs.len();
        let mut slope = self.slopes[count];
        for k in (0..count).rev() {
            let interval = Interval::of(&iterate.blocks[k / LANES], k % LANES, step_s);
            let residual = iterate.defect(k);
            let mut g = slope;
            for (row, gap) in self.values[k].iter().zip(&residual) {
                for (sum, entry) in g.iter_mut().zip(row) {
                    *sum += entry * gap;
                }
            }
            let pulled = interval.pull(&g);
            // The correction for the dynamics' change since then, because their first derivatives are the old ones,
            // too.
            let block = &iterate.blocks[k / LANES];
            let before = interval.pull(&iterate.costates[k + 1]);
            let turned = |j: usize| block.pulled[j].0[k % LANES] - before[j];
            self.input_terms[k].1 += turned(D);
            let slopes = &mut self.slopes[k];
            for (i, entry) in slopes.iter_mut().enumerate().skip(T) {
                *entry += turned(i - T);
            }
            let feedback = &mut self.feedbacks[k];
            feedback.offset = (self.input_terms[k].1 + pulled[D]) * feedback.inverse;
            let g = [g[X], g[Z], pulled[0], pulled[1], pulled[2], pulled[3]];
            for i in 0..6 {
                slope[i] = slopes[i] + g[i] - feedback.cross[i] * feedback.offset;
            }
        }
    }

    /// The change of the states by the defects alone, without a change of the inputs.
    pub(super) fn drift(&self, iterate: &Iterate, step_s: f64, drifts: &mut [[f64; 6]]) {
        let mut dx = [0.0; 6];
        for (k, drift) in drifts.iter_mut().enumerate() {
            *drift = dx;
            if k == self.inputs.len() {
                break;
            }
            let moved = Interval::of(&iterate.blocks[k / LANES], k % LANES, step_s).push(&dx, 0.0);
            let residual = iterate.defect(k);
            dx = core::array::from_fn(|i| moved[i] + residual[i]);
        }
    }

    /// The optimality residual of input `k` after the step: only rounding, unless the sweeps are wrong.
    #[cfg(test)]
    pub(super) fn input_residual(&self, iterate: &Iterate, step_s: f64, k: usize) -> f64 {
        let (block, lane) = (&iterate.blocks[k / LANES], k % LANES);
        let dx = &self.states[k];
        let moved = [dx[T], dx[U], dx[W], dx[Q], self.inputs[k]];
        let bent: f64 = (0..super::block::DIRECTIONS)
            .map(|j| self.share * block.curvature[pair(j, D)].0[lane] * moved[j])
            .sum();
        let pulled = Interval::of(block, lane, step_s).pull(&self.costates[k + 1])[D];
        let (curvature, slope) = self.input_terms[k];
        curvature * self.inputs[k] + slope + bent + pulled
    }

    /// [`forward`](Self::forward) in the vectors of the function it is inlined into.
    #[inline(always)]
    pub(super) fn substitute(&mut self, iterate: &Iterate, step_s: f64) {
        let count = self.inputs.len();
        let mut dx = [0.0; 6];
        self.states[0] = dx;
        for k in 0..count {
            let Feedback { gain, offset, .. } = self.feedbacks[k];
            let answer = (gain[X] * dx[X] + gain[Z] * dx[Z])
                + (gain[T] * dx[T] + gain[U] * dx[U])
                + (gain[W] * dx[W] + gain[Q] * dx[Q]);
            let dd = -(offset + answer);
            let interval = Interval::of(&iterate.blocks[k / LANES], k % LANES, step_s);
            let moved = interval.push(&dx, dd);
            let residual = iterate.defect(k);
            dx = core::array::from_fn(|i| moved[i] + residual[i]);
            self.inputs[k] = dd;
            self.states[k + 1] = dx;
        }

        let mut costate: [f64; 6] =
            core::array::from_fn(|i| self.slopes[count][i] + self.weights[count][i] * dx[i]);
        self.costates[count] = costate;
        for k in (1..count).rev() {
            let block = &iterate.blocks[k / LANES];
            let lane = k % LANES;
            let interval = Interval::of(block, lane, step_s);
            let pulled = interval.pull(&costate);
            let dx = &self.states[k];
            let moved = [dx[T], dx[U], dx[W], dx[Q], self.inputs[k]];
            let mut bent = [0.0; 4];
            for (i, sum) in bent.iter_mut().enumerate() {
                for (j, direction) in moved.iter().enumerate() {
                    let h = block.curvature[if i <= j { pair(i, j) } else { pair(j, i) }].0[lane];
                    *sum += self.share * h * direction;
                }
            }
            let before = [
                costate[X],
                costate[Z],
                pulled[0] + bent[0],
                pulled[1] + bent[1],
                pulled[2] + bent[2],
                pulled[3] + bent[3],
            ];
            costate = core::array::from_fn(|i| before[i] + self.slopes[k][i] + self.weights[k][i] * dx[i]);
            self.costates[k] = costate;
        }
    }
}
