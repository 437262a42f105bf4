//! One interval's evaluation, turned from the lanes of its block into rows that the sweeps load whole.

use super::block::{Block, DIRECTIONS, pair};
use super::lanes::{LANES, Lanes};

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
