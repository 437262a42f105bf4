//! One interval's derivatives, as rows for the sweeps.
#![expect(clippy::inline_always, reason = "fixed-size kernels of a few dozen instructions")]

use stages::Hessian;

use super::block::{Block, D, DIRECTIONS, pair};

/// Indices of the states.
const X: usize = 0;
const Z: usize = 1;
const T: usize = 2;
const U: usize = 3;
const W: usize = 4;
const Q: usize = 5;

/// Number of directions, filled up to whole vectors.
const WIDE: usize = DIRECTIONS + 1;

/// One interval's derivatives, from its block.
///
/// The rows of `(A, b)` over the directions, filled up with a zero to whole vectors: x, z, u and w, then theta and q.
pub struct Rows<'a> {
    tangent: [[f64; WIDE]; 4],
    theta: [f64; WIDE],
    q: [f64; WIDE],
    block: &'a Block,
    lane: usize,
}

impl<'a> Rows<'a> {
    #[inline(always)]
    pub(super) fn of(block: &'a Block, lane: usize, step_s: f64) -> Self {
        let turn = block.turn.0[lane];
        let mut tangent = [[0.0; WIDE]; 4];
        for (row, lanes) in tangent.iter_mut().zip(&block.tangent) {
            for (entry, value) in row.iter_mut().zip(lanes) {
                *entry = value.0[lane];
            }
        }
        Self {
            tangent,
            theta: [1.0, 0.0, 0.0, step_s, 0.5 * step_s * turn, 0.0],
            q: [0.0, 0.0, 0.0, 1.0, turn, 0.0],
            block,
            lane,
        }
    }

    /// `(A, b)' g` without its x and z.
    #[inline(always)]
    fn pull_along(&self, g: &[f64; 6]) -> [f64; WIDE] {
        let a = &self.tangent;
        let mut pulled = [0.0; WIDE];
        for j in 0..WIDE {
            pulled[j] = (a[0][j] * g[X] + a[1][j] * g[Z])
                + (a[2][j] * g[U] + a[3][j] * g[W])
                + (self.theta[j] * g[T] + self.q[j] * g[Q]);
        }
        pulled
    }

    /// `(A, b)' M` without its x and z, for the rows of an `M` over the directions.
    #[inline(always)]
    fn square_along(&self, m: &[[f64; WIDE]; 6]) -> [[f64; WIDE]; DIRECTIONS] {
        let a = &self.tangent;
        let mut square = [[0.0; WIDE]; DIRECTIONS];
        for (i, row) in square.iter_mut().enumerate() {
            for j in 0..WIDE {
                row[j] = (a[0][i] * m[X][j] + a[1][i] * m[Z][j]) + (a[2][i] * m[U][j] + a[3][i] * m[W][j]);
            }
        }
        for j in 0..WIDE {
            square[0][j] += m[T][j];
            square[3][j] += self.theta[3] * m[T][j] + m[Q][j];
            square[D][j] += self.theta[D] * m[T][j] + self.q[D] * m[Q][j];
        }
        square
    }

    /// A share of the curvature by two directions.
    #[inline(always)]
    fn bent(&self, share: f64, i: usize, j: usize) -> f64 {
        share * self.block.curvature[if i <= j { pair(i, j) } else { pair(j, i) }].0[self.lane]
    }
}

impl stages::Interval<6, 1> for Rows<'_> {
    #[inline(always)]
    fn pull(&self, g: &[f64; 6]) -> ([f64; 6], [f64; 1]) {
        let pulled = self.pull_along(g);
        ([g[X], g[Z], pulled[0], pulled[1], pulled[2], pulled[3]], [pulled[D]])
    }

    #[inline(always)]
    fn push(&self, dx: &[f64; 6], [dd]: &[f64; 1]) -> [f64; 6] {
        let a = &self.tangent;
        let row = |i: usize| {
            (a[i][0] * dx[T] + a[i][1] * dx[U]) + (a[i][2] * dx[W] + a[i][3] * dx[Q]) + a[i][D] * dd
        };
        [
            dx[X] + row(0),
            dx[Z] + row(1),
            dx[T] + self.theta[3] * dx[Q] + self.theta[D] * dd,
            row(2),
            row(3),
            dx[Q] + self.q[D] * dd,
        ]
    }

    #[inline(always)]
    fn square(&self, p: &[[f64; 6]; 6], share: f64) -> Hessian<6, 1> {
        let mut m = [[0.0; WIDE]; 6];
        for (product, row) in m.iter_mut().zip(p) {
            *product = self.pull_along(row);
        }
        let across = self.square_along(&m);
        let h = |i: usize, j: usize| self.bent(share, i, j);
        let ux = [
            m[X][D],
            m[Z][D],
            across[D][0] + h(0, D),
            across[D][1] + h(1, D),
            across[D][2] + h(2, D),
            across[D][3] + h(3, D),
        ];
        let mut xx = [
            [p[X][X], p[X][Z], m[X][0], m[X][1], m[X][2], m[X][3]],
            [p[Z][X], p[Z][Z], m[Z][0], m[Z][1], m[Z][2], m[Z][3]],
            [m[X][0], m[Z][0], across[0][0], across[0][1], across[0][2], across[0][3]],
            [m[X][1], m[Z][1], across[1][0], across[1][1], across[1][2], across[1][3]],
            [m[X][2], m[Z][2], across[2][0], across[2][1], across[2][2], across[2][3]],
            [m[X][3], m[Z][3], across[3][0], across[3][1], across[3][2], across[3][3]],
        ];
        for i in 0..4 {
            for j in 0..4 {
                xx[T + i][T + j] += h(i, j);
            }
        }
        Hessian { xx, ux: [ux], uu: [[across[D][D] + h(D, D)]] }
    }

    #[inline(always)]
    fn curve(&self, share: f64, dx: &[f64; 6], [dd]: &[f64; 1]) -> ([f64; 6], [f64; 1]) {
        let moved = [dx[T], dx[U], dx[W], dx[Q], *dd];
        let mut bent = [0.0; DIRECTIONS];
        for (i, sum) in bent.iter_mut().enumerate() {
            for (j, direction) in moved.iter().enumerate() {
                *sum += self.bent(share, i, j) * direction;
            }
        }
        ([0.0, 0.0, bent[0], bent[1], bent[2], bent[3]], [bent[D]])
    }
}
