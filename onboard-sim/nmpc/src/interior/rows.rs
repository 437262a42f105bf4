//! One interval's derivatives, as rows for the sweeps.
#![expect(clippy::inline_always, reason = "fixed-size kernels of a few dozen instructions")]

use super::block::{Block, DIRECTIONS};

/// Indices of the states.
pub(super) const X: usize = 0;
pub(super) const Z: usize = 1;
pub(super) const T: usize = 2;
pub(super) const U: usize = 3;
pub(super) const W: usize = 4;
pub(super) const Q: usize = 5;

/// Index of the input among the directions.
pub(super) const D: usize = 4;

/// Number of directions, filled up to whole vectors.
pub(super) const WIDE: usize = DIRECTIONS + 1;

/// One interval's derivatives, from its block.
///
/// The rows of `(A, b)` over the directions, filled up with a zero to whole vectors: x, z, u and w, then theta and q.
pub(super) struct Interval {
    pub(super) tangent: [[f64; WIDE]; 4],
    theta: [f64; WIDE],
    q: [f64; WIDE],
}

impl Interval {
    #[inline(always)]
    pub(super) fn of(block: &Block, lane: usize, step_s: f64) -> Self {
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
        }
    }

    /// `(A, b)' g` without its x and z.
    #[inline(always)]
    pub(super) fn pull(&self, g: &[f64; 6]) -> [f64; WIDE] {
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
    pub(super) fn square(&self, m: &[[f64; WIDE]; 6]) -> [[f64; WIDE]; DIRECTIONS] {
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

    /// `A dx + b dd`.
    #[inline(always)]
    pub(super) fn push(&self, dx: &[f64; 6], dd: f64) -> [f64; 6] {
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
}
