//! One interval's derivatives, as the sweeps use them, and the value function.
#![expect(clippy::inline_always, reason = "fixed-size kernels of a few dozen instructions")]

use ocp::{Curvature, Feedback, Stage, Value};
use pulp::{Scalar, Simd};

use super::lanes::{Four, LANES, Lanes};
use super::{Block, D, DIRECTIONS, pair};

/// Indices of the states.
const X: usize = 0;
const Z: usize = 1;
const T: usize = 2;
const U: usize = 3;
const W: usize = 4;
const Q: usize = 5;

/// One interval's derivatives. A vector is over theta, u, w and q, which are the last four states; the gimbal angle is apart.
pub struct Rows<'a> {
    line: &'a Line,
    /// Derivatives of theta and q after the interval, which the line leaves out.
    theta: Lanes,
    q: Lanes,
    /// Derivatives by the gimbal angle of x, z, u and w, of theta and of q after the interval.
    gimbal: [f64; 4],
    theta_gimbal: f64,
    q_gimbal: f64,
    /// Second derivative by the gimbal angle.
    gimbal_twice: f64,
}

impl<'a> Rows<'a> {
    /// Those of the interval in a lane of a block.
    #[inline(always)]
    pub(super) fn of(block: &Block, line: &'a Line, lane: usize, step_s: f64) -> Self {
        let turn = block.turn.0[lane];
        let [x, z, u, w] = &block.tangent;
        Self {
            line,
            theta: Lanes([1.0, 0.0, 0.0, step_s]),
            q: Lanes([0.0, 0.0, 0.0, 1.0]),
            gimbal: [x[D].0[lane], z[D].0[lane], u[D].0[lane], w[D].0[lane]],
            theta_gimbal: 0.5 * step_s * turn,
            q_gimbal: turn,
            gimbal_twice: block.curvature[pair(D, D)].0[lane],
        }
    }

    /// `A' g` without its x and z, and `b' g`.
    #[inline(always)]
    fn pull_in<S: Simd>(&self, simd: S, g: &[f64; 6]) -> (Four<S>, f64) {
        let a = |i: usize| Four(simd, self.line.tangent[i]);
        let (theta, q, b) = (Four(simd, self.theta), Four(simd, self.q), &self.gimbal);
        let along = (a(0) * g[X] + a(1) * g[Z]) + (a(2) * g[U] + a(3) * g[W]) + (theta * g[T] + q * g[Q]);
        let by_gimbal = (b[0] * g[X] + b[1] * g[Z])
            + (b[2] * g[U] + b[3] * g[W])
            + (self.theta_gimbal * g[T] + self.q_gimbal * g[Q]);
        (along, by_gimbal)
    }
}

/// The last four of the states' values.
#[inline(always)]
fn rest([_, _, rest @ ..]: &[f64; 6]) -> Lanes {
    Lanes(*rest)
}

impl ocp::Interval<6, 1> for Rows<'_> {
    type Value = Split;

    #[inline(always)]
    fn pull(&self, g: &[f64; 6]) -> ([f64; 6], [f64; 1]) {
        let (along, by_gimbal) = self.pull_in(Scalar, g);
        let [theta, u, w, q] = along.1.0;
        ([g[X], g[Z], theta, u, w, q], [by_gimbal])
    }

    #[inline(always)]
    fn push(&self, dx: &[f64; 6], [dd]: &[f64; 1]) -> [f64; 6] {
        let row = |i: usize| {
            let [theta, u, w, q] = self.line.tangent[i].0;
            (theta * dx[T] + u * dx[U]) + (w * dx[W] + q * dx[Q]) + self.gimbal[i] * dd
        };
        [
            dx[X] + row(0),
            dx[Z] + row(1),
            dx[T] + self.theta.0[3] * dx[Q] + self.theta_gimbal * dd,
            row(2),
            row(3),
            dx[Q] + self.q_gimbal * dd,
        ]
    }

    /// With `A` and `b` the derivatives by all states and by the gimbal angle, `m = P A` (its rows are vectors) and `n = P b`:
    /// `before = A' m - (A' n) (A' n)' / b' n`, both with the curvature. Straight lines, no loops: the compiler would keep the
    /// rows in memory.
    #[inline(always)]
    fn eliminate<S: Simd, C: Curvature<6>, R: Curvature<1>>(
        &self,
        simd: S,
        stage: &Stage<C, R, 6, 1>,
        after: &Split,
        before: &mut Split,
        slope: &mut [f64; 6],
    ) -> Option<Feedback<6, 1>> {
        let four = |lanes: Lanes| Four(simd, lanes);
        let Line { tangent, curvature } = self.line;
        let b = &self.gimbal;

        // The slope at the end of the interval, and pulled back.
        let (r, Split { x, z, rest: y }) = (&stage.defect, after);
        let gx = slope[X] + x[X] * r[X] + x[Z] * r[Z] + x[T] * r[T] + x[U] * r[U] + x[W] * r[W] + x[Q] * r[Q];
        let gz = slope[Z] + z[X] * r[X] + z[Z] * r[Z] + z[T] * r[T] + z[U] * r[U] + z[W] * r[W] + z[Q] * r[Q];
        let g = four(rest(slope)) + four(y[X]) * r[X] + four(y[Z]) * r[Z] + four(y[T]) * r[T];
        let g = g + four(y[U]) * r[U] + four(y[W]) * r[W] + four(y[Q]) * r[Q];
        let [gt, gu, gw, gq] = g.1.0;
        let (pulled, by_gimbal) = self.pull_in(simd, &[gx, gz, gt, gu, gw, gq]);
        let pushed = stage.input_terms.1[0] + by_gimbal;

        let product = |i: usize| self.pull_in(simd, &after.row(i));
        let ((mx, nx), (mz, nz), (mt, nt)) = (product(X), product(Z), product(T));
        let ((mu, nu), (mw, nw), (mq, nq)) = (product(U), product(W), product(Q));

        let mut twice = (b[0] * nx + b[1] * nz) + (b[2] * nu + b[3] * nw);
        twice += self.theta_gimbal * nt + self.q_gimbal * nq;
        twice += stage.share * self.gimbal_twice;
        let factor = stage.factor([[twice]])?;
        let [inverse] = *factor.inverse();
        let mut crossed = (mx * b[0] + mz * b[1]) + (mu * b[2] + mw * b[3]);
        crossed += mt * self.theta_gimbal + mq * self.q_gimbal;
        crossed += four(curvature[D]) * stage.share;
        let (gain_x, gain_z, gain) = (nx * inverse, nz * inverse, crossed * inverse);
        let offset = pushed * inverse;

        let (own_curvature, own_slope) = stage.state_terms;
        macro_rules! row {
            ($i:literal, $more:expr, $own:expr) => {{
                let [x, z, u, w] = tangent.map(|row| row.0[$i]);
                let square = (mx * x + mz * z) + (mu * u + mw * w);
                let square = $more(square) + four(curvature[$i]) * stage.share;
                before.rest[T + $i] = (square - crossed * gain.1.0[$i] + four(Lanes($own))).1;
            }};
        }
        let own = |i: usize| own_curvature.diagonal(i);
        row!(0, |square| square + mt, [own(T), 0.0, 0.0, 0.0]);
        row!(1, |square| square, [0.0, own(U), 0.0, 0.0]);
        row!(2, |square| square, [0.0, 0.0, own(W), 0.0]);
        row!(3, |square| square + (mt * self.theta.0[3] + mq), [0.0, 0.0, 0.0, own(Q)]);
        before.rest[X] = (mx - crossed * gain_x).1;
        before.rest[Z] = (mz - crossed * gain_z).1;
        let [t, u, w, turn] = (mx - gain * nx).1.0;
        before.x = [x[X] - gain_x * nx + own(X), x[Z] - gain_z * nx, t, u, w, turn];
        let [t, u, w, turn] = (mz - gain * nz).1.0;
        before.z = [z[X] - gain_x * nz, z[Z] - gain_z * nz + own(Z), t, u, w, turn];

        let [t, u, w, turn] = (four(rest(own_slope)) + pulled - crossed * offset).1.0;
        *slope = [own_slope[X] + gx - nx * offset, own_slope[Z] + gz - nz * offset, t, u, w, turn];
        let ([t, u, w, turn], [by_t, by_u, by_w, by_q]) = (crossed.1.0, gain.1.0);
        Some(Feedback {
            gain: [[gain_x, gain_z, by_t, by_u, by_w, by_q]],
            offset: [offset],
            reduced: [[nx, nz, t, u, w, turn]],
            factor,
        })
    }

    #[inline(always)]
    fn curve(&self, share: f64, dx: &[f64; 6], [dd]: &[f64; 1]) -> ([f64; 6], [f64; 1]) {
        let moved = [dx[T], dx[U], dx[W], dx[Q], *dd];
        // The curvature is symmetric: its rows are its columns.
        let (mut bent, mut by_gimbal) = (Lanes::ZERO, 0.0);
        for (row, direction) in self.line.curvature.iter().zip(moved) {
            bent += *row * share * direction;
        }
        let crossed = self.line.curvature[D] * share;
        for (entry, direction) in crossed.0.iter().zip(moved) {
            by_gimbal += entry * direction;
        }
        by_gimbal += share * self.gimbal_twice * dd;
        let [theta, u, w, q] = bent.0;
        ([0.0, 0.0, theta, u, w, q], [by_gimbal])
    }
}

// One interval's evaluation, turned from the lanes of its block into rows that the sweeps load whole.

/// One interval's derivatives by theta, u, w and q, row by row. Its block has those that are by the gimbal angle alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Of x, z, u and w after the interval.
    pub(super) tangent: [Lanes; 4],
    /// Of the derivatives of `lambda . step` by theta, u, w, q and the gimbal angle.
    pub(super) curvature: [Lanes; 5],
}

impl Line {
    pub(super) const EMPTY: Self = Self { tangent: [Lanes::ZERO; 4], curvature: [Lanes::ZERO; 5] };
}

/// Lane by lane, four values.
#[inline]
fn transposed(a: &Lanes, b: &Lanes, c: &Lanes, d: &Lanes) -> [Lanes; LANES] {
    [
        Lanes([a.0[0], b.0[0], c.0[0], d.0[0]]),
        Lanes([a.0[1], b.0[1], c.0[1], d.0[1]]),
        Lanes([a.0[2], b.0[2], c.0[2], d.0[2]]),
        Lanes([a.0[3], b.0[3], c.0[3], d.0[3]]),
    ]
}

/// Writes the lines of a block's intervals. It is not inlined: within the evaluation the compiler would give up the vectors there,
/// which takes 2.4 times as long.
#[inline(never)]
pub(super) fn write(block: &Block, lines: &mut [Line; LANES]) {
    for (row, tangent) in block.tangent.iter().enumerate() {
        let turned = transposed(&tangent[0], &tangent[1], &tangent[2], &tangent[3]);
        for lane in 0..LANES {
            lines[lane].tangent[row] = turned[lane];
        }
    }
    let bent = |i: usize, j: usize| &block.curvature[if i <= j { pair(i, j) } else { pair(j, i) }];
    for row in 0..DIRECTIONS {
        let turned = transposed(bent(row, 0), bent(row, 1), bent(row, 2), bent(row, 3));
        for lane in 0..LANES {
            lines[lane].curvature[row] = turned[lane];
        }
    }
}

// The quadratic part of the value function, split where its vectors are.

/// A symmetric matrix over the states: for each state its entries by x, by z, and by theta, u, w and q.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    pub(super) x: [f64; 6],
    pub(super) z: [f64; 6],
    pub(super) rest: [Lanes; 6],
}

impl Split {
    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> [f64; 6] {
        let [theta, u, w, q] = self.rest[i].0;
        [self.x[i], self.z[i], theta, u, w, q]
    }
}

impl Value<6> for Split {
    const ZERO: Self = Self { x: [0.0; 6], z: [0.0; 6], rest: [Lanes::ZERO; 6] };

    #[inline(always)]
    fn add<C: Curvature<6>>(&mut self, curvature: &C) {
        let mut whole = core::array::from_fn(|i| self.row(i));
        curvature.add_to(&mut whole);
        for (i, [x, z, rest @ ..]) in whole.into_iter().enumerate() {
            (self.x[i], self.z[i], self.rest[i]) = (x, z, Lanes(rest));
        }
    }

    #[inline(always)]
    fn add_times(&self, vector: &[f64; 6], sum: &mut [f64; 6]) {
        for (i, value) in vector.iter().enumerate() {
            for (entry, column) in sum.iter_mut().zip(&self.row(i)) {
                *entry += column * value;
            }
        }
    }
}
