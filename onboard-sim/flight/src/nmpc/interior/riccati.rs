//! The Newton step by one backward and one forward sweep over the stages.
//!
//! ```text
//! minimise    sum over the nodes of (w_k dx^2 / 2 + s_k dx) + (curvature and input terms of every interval)
//! subject to  dx_{k+1} = A_k dx_k + b_k dd_k + r_k,   dx_0 = 0
//! ```
//!
//! The value function of the stages from `k` on is `dx' P dx / 2 + p' dx`. Conditions are in it as stiff as their
//! barrier makes them: `P` then loses digits across them, but the curvature that counts, along them, is asked for
//! only there. The costates come from their own recursion, which does not involve `P`.
//!
//! With one input the system has the right inertia exactly if `b' P b` plus the input's own curvature, one scalar a
//! stage, is positive throughout.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use super::interval::{Block, DIRECTIONS, pair};
use super::iterate::Iterate;
use super::lanes::LANES;

const X: usize = 0;
const Z: usize = 1;
const T: usize = 2;
const U: usize = 3;
const W: usize = 4;
const Q: usize = 5;
/// The input among the directions.
const D: usize = 4;

/// Least curvature by an input that counts as positive, relative to the input's own terms.
const LEAST_CURVATURE: f64 = 1e-11;

/// How the input answers at a stage: `dd = -(offset + gain' dx)`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Feedback {
    gain: [f64; 6],
    offset: f64,
}

/// One interval's derivatives, out of its block.
struct Interval {
    tangent: [[f64; DIRECTIONS]; 4],
    theta_by_input: f64,
    q_by_input: f64,
}

impl Interval {
    #[inline(always)]
    fn of(block: &Block, lane: usize, step_s: f64) -> Self {
        let turn = block.turn.0[lane];
        Self {
            tangent: core::array::from_fn(|i| core::array::from_fn(|j| block.tangent[i][j].0[lane])),
            theta_by_input: 0.5 * step_s * turn,
            q_by_input: turn,
        }
    }

    /// Each direction's column times a vector: `A' g` without its x and z, and `b' g`.
    #[inline(always)]
    fn pull(&self, g: &[f64; 6], step_s: f64) -> [f64; DIRECTIONS] {
        let a = &self.tangent;
        let mut pulled: [f64; DIRECTIONS] =
            core::array::from_fn(|j| (a[0][j] * g[X] + a[1][j] * g[Z]) + (a[2][j] * g[U] + a[3][j] * g[W]));
        pulled[0] += g[T];
        pulled[3] += step_s * g[T] + g[Q];
        pulled[D] += self.theta_by_input * g[T] + self.q_by_input * g[Q];
        pulled
    }

    /// `A dx + b dd`.
    #[inline(always)]
    fn push(&self, dx: &[f64; 6], dd: f64, step_s: f64) -> [f64; 6] {
        let a = &self.tangent;
        let row = |i: usize| {
            (a[i][0] * dx[T] + a[i][1] * dx[U]) + (a[i][2] * dx[W] + a[i][3] * dx[Q]) + a[i][D] * dd
        };
        [
            dx[X] + row(0),
            dx[Z] + row(1),
            dx[T] + step_s * dx[Q] + self.theta_by_input * dd,
            row(2),
            row(3),
            dx[Q] + self.q_by_input * dd,
        ]
    }
}

/// The Newton step and what it is made from.
#[derive(Debug, Clone, Default)]
pub(super) struct Sweep {
    /// Second derivative of the objective at each node, diagonal.
    pub(super) weights: Vec<[f64; 6]>,
    /// First derivative of the objective at each node.
    pub(super) slopes: Vec<[f64; 6]>,
    /// Second and first derivative of the objective by each input.
    pub(super) input_terms: Vec<(f64, f64)>,
    feedbacks: Vec<Feedback>,
    /// Change of each state.
    pub(super) states: Vec<[f64; 6]>,
    /// Change of each input.
    pub(super) inputs: Vec<f64>,
    /// The costates after the step.
    pub(super) costates: Vec<[f64; 6]>,
    /// Share of the dynamics' curvature that is in the step.
    share: f64,
}

impl Sweep {
    /// Makes room for a problem; allocates only if none was ever as long.
    pub(super) fn resize(&mut self, intervals: usize) {
        self.weights.resize(intervals + 1, [0.0; 6]);
        self.slopes.resize(intervals + 1, [0.0; 6]);
        self.input_terms.resize(intervals, (0.0, 0.0));
        self.feedbacks.resize(intervals, Feedback::default());
        self.states.resize(intervals + 1, [0.0; 6]);
        self.inputs.resize(intervals, 0.0);
        self.costates.resize(intervals + 1, [0.0; 6]);
    }

    /// The backward sweep with a share of the dynamics' curvature; whether the inertia is right.
    pub(super) fn backward(&mut self, iterate: &Iterate, step_s: f64, share: f64) -> bool {
        self.share = share;
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
            let a = &interval.tangent;

            // Columns of P A and P b, and P r + p.
            let mut m = [[0.0; 6]; DIRECTIONS];
            for j in 0..DIRECTIONS {
                for i in 0..6 {
                    m[j][i] =
                        (p[X][i] * a[0][j] + p[Z][i] * a[1][j]) + (p[U][i] * a[2][j] + p[W][i] * a[3][j]);
                }
            }
            for i in 0..6 {
                m[0][i] += p[T][i];
                m[3][i] += step_s * p[T][i] + p[Q][i];
                m[D][i] += interval.theta_by_input * p[T][i] + interval.q_by_input * p[Q][i];
            }
            let mut g = slope;
            for j in 0..6 {
                for i in 0..6 {
                    g[i] += p[j][i] * residual[j];
                }
            }

            let by_input = interval.pull(&m[D], step_s);
            let pulled = interval.pull(&g, step_s);
            let h = |i: usize, j: usize| share * block.curvature[pair(i, j)].0[lane];
            let (own_curvature, own_slope) = self.input_terms[k];
            let curvature = by_input[D] + h(D, D) + own_curvature;
            let positive = curvature > LEAST_CURVATURE * (1.0 + own_curvature);
            if !positive {
                return false;
            }
            let inverse = 1.0 / curvature;
            let cross = [
                m[D][X],
                m[D][Z],
                by_input[0] + h(0, D),
                by_input[1] + h(1, D),
                by_input[2] + h(2, D),
                by_input[3] + h(3, D),
            ];
            let gain = cross.map(|entry| entry * inverse);
            let offset = (own_slope + pulled[D]) * inverse;
            self.feedbacks[k] = Feedback { gain, offset };
            if k == 0 {
                break;
            }

            let mut next = [[0.0; 6]; 6];
            next[X][X] = p[X][X];
            next[X][Z] = p[X][Z];
            next[Z][Z] = p[Z][Z];
            for j in 0..4 {
                next[X][2 + j] = m[j][X];
                next[Z][2 + j] = m[j][Z];
                let across = interval.pull(&m[j], step_s);
                for i in 0..=j {
                    next[2 + i][2 + j] = across[i] + h(i, j);
                }
            }
            for i in 0..6 {
                for j in i..6 {
                    let entry = next[i][j] - gain[i] * cross[j];
                    next[i][j] = entry;
                    next[j][i] = entry;
                }
            }
            let weights = &self.weights[k];
            let slopes = &self.slopes[k];
            for i in 0..6 {
                next[i][i] += weights[i];
            }
            p = next;
            let g = [g[X], g[Z], pulled[0], pulled[1], pulled[2], pulled[3]];
            for i in 0..6 {
                slope[i] = slopes[i] + g[i] - cross[i] * offset;
            }
        }
        true
    }

    /// What is left of the optimality of input `k` after the step; rounding, unless the sweeps are wrong.
    #[cfg(test)]
    pub(super) fn input_residual(&self, iterate: &Iterate, step_s: f64, k: usize) -> f64 {
        let (block, lane) = (&iterate.blocks[k / LANES], k % LANES);
        let dx = &self.states[k];
        let moved = [dx[T], dx[U], dx[W], dx[Q], self.inputs[k]];
        let bent: f64 =
            (0..DIRECTIONS).map(|j| self.share * block.curvature[pair(j, D)].0[lane] * moved[j]).sum();
        let pulled = Interval::of(block, lane, step_s).pull(&self.costates[k + 1], step_s)[D];
        let (curvature, slope) = self.input_terms[k];
        curvature * self.inputs[k] + slope + bent + pulled
    }

    /// The forward sweep: states, inputs, and then the costates, backwards again.
    pub(super) fn forward(&mut self, iterate: &Iterate, step_s: f64) {
        let count = self.inputs.len();
        let mut dx = [0.0; 6];
        self.states[0] = dx;
        for k in 0..count {
            let Feedback { gain, offset } = self.feedbacks[k];
            let answer = (gain[X] * dx[X] + gain[Z] * dx[Z])
                + (gain[T] * dx[T] + gain[U] * dx[U])
                + (gain[W] * dx[W] + gain[Q] * dx[Q]);
            let dd = -(offset + answer);
            let interval = Interval::of(&iterate.blocks[k / LANES], k % LANES, step_s);
            let moved = interval.push(&dx, dd, step_s);
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
            let pulled = interval.pull(&costate, step_s);
            let dx = &self.states[k];
            let moved = [dx[T], dx[U], dx[W], dx[Q], self.inputs[k]];
            let bent: [f64; 4] = core::array::from_fn(|i| {
                let h = |j: usize| {
                    self.share * block.curvature[if i <= j { pair(i, j) } else { pair(j, i) }].0[lane]
                };
                (h(0) * moved[0] + h(1) * moved[1]) + (h(2) * moved[2] + h(3) * moved[3]) + h(4) * moved[4]
            });
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
