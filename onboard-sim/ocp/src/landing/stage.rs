//! One interval as the sweeps read it.
//!
//! The five accelerations of an interval, of the place and of the leans, carry everything that is
//! not linear. With the shift `E` (places and leans grow by velocity and rates), the gain `G` of an
//! acceleration held over the interval, and the accelerations' derivative `D` by the ten
//! [`DIRECTIONS`],
//!
//! ```text
//! (A, B) = E + G D
//! (A, B)' P (A, B) = E' P E + Y' D + D' Y,   Y = G' P E + (G' P G) D / 2
//! ```
//!
//! which is half the arithmetic of full matrices, in half of their memory.
#![expect(clippy::inline_always, reason = "inlined into the sweeps, to be compiled for their vectors")]

use crate::intervals::add_times;
use crate::{Curvature, Feedback, Interval, Intervals, Stage, add_multiple};
use alloc::vec::Vec;

use super::{INPUTS, STATES, State};

/// Places: nothing depends on them.
const PLACES: usize = 3;

/// Variables of the accelerations: velocity, leans and rates, in the states' order, and the inputs.
pub(super) const DIRECTIONS: usize = MOVING + INPUTS;
const MOVING: usize = STATES - PLACES;

/// A row by states and inputs, whole vectors long.
const WIDE: usize = (STATES + INPUTS).next_multiple_of(4);

/// Accelerations of the place, and of the leans.
pub(super) const ACCELERATIONS: usize = 5;

/// The state that each acceleration is the second derivative of, and the one of its first.
const DRIVEN: [[usize; 2]; ACCELERATIONS] = [[0, 3], [1, 4], [2, 5], [6, 8], [7, 9]];

/// Derivatives of a scalar by all directions, twice.
pub(super) type Bend = [[f64; DIRECTIONS]; DIRECTIONS];

/// One interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandingInterval {
    pub(super) step_s: f64,
    /// `F`.
    pub(super) end: State,
    /// `A' lambda` and `B' lambda`.
    pub(super) pulled: (State, [f64; INPUTS]),
    /// `D`.
    pub(super) by: [[f64; DIRECTIONS]; ACCELERATIONS],
    /// Second derivative of `lambda' F`.
    pub(super) bend: Bend,
}

impl LandingInterval {
    pub(super) const ZERO: Self = Self {
        step_s: 0.0,
        end: [0.0; STATES],
        pulled: ([0.0; STATES], [0.0; INPUTS]),
        by: [[0.0; DIRECTIONS]; ACCELERATIONS],
        bend: [[0.0; DIRECTIONS]; DIRECTIONS],
    };

    /// `G' row`.
    #[inline(always)]
    fn drawn(&self, row: &State) -> [f64; ACCELERATIONS] {
        let h = self.step_s;
        let mut drawn = [0.0; ACCELERATIONS];
        for (sum, [first, second]) in drawn.iter_mut().zip(DRIVEN) {
            *sum = 0.5 * h * h * row[first] + h * row[second];
        }
        drawn
    }

    /// `E' row`.
    #[inline(always)]
    fn shifted(&self, mut row: State) -> State {
        for [first, second] in DRIVEN {
            row[second] += self.step_s * row[first];
        }
        row
    }
}

/// All intervals of a horizon.
#[derive(Debug, Clone, Default)]
pub struct LandingIntervals(pub(super) Vec<LandingInterval>);

impl Intervals<STATES, INPUTS> for LandingIntervals {
    const INTEGRALS: usize = PLACES;

    type Interval<'a> = &'a LandingInterval;

    fn resize(&mut self, intervals: usize) {
        self.0.resize(intervals, LandingInterval::ZERO);
    }

    #[inline(always)]
    fn end(&self, k: usize) -> State {
        self.0[k].end
    }

    #[inline(always)]
    fn pulled(&self, k: usize, _: &State) -> (State, [f64; INPUTS]) {
        self.0[k].pulled
    }

    #[inline(always)]
    fn interval(&self, k: usize) -> &LandingInterval {
        &self.0[k]
    }
}

/// The products of a matrix' rows with a vector.
#[inline(always)]
fn products<const M: usize, const N: usize>(rows: &[[f64; N]; M], vector: &[f64; N]) -> [f64; M] {
    let mut products = [0.0; M];
    for (product, row) in products.iter_mut().zip(rows) {
        for (entry, value) in row.iter().zip(vector) {
            *product += entry * value;
        }
    }
    products
}

/// The directions of a state and an input.
#[inline(always)]
fn directions(x: &State, u: &[f64; INPUTS]) -> [f64; DIRECTIONS] {
    let mut directions = [0.0; DIRECTIONS];
    directions[..MOVING].copy_from_slice(&x[PLACES..]);
    directions[MOVING..].copy_from_slice(u);
    directions
}

impl Interval<STATES, INPUTS> for &LandingInterval {
    #[inline(always)]
    fn pull(&self, g: &State) -> (State, [f64; INPUTS]) {
        let mut by = [0.0; DIRECTIONS];
        for (factor, row) in self.drawn(g).iter().zip(&self.by) {
            add_multiple(&mut by, *factor, row);
        }
        let mut by_state = self.shifted(*g);
        for (sum, value) in by_state[PLACES..].iter_mut().zip(&by) {
            *sum += value;
        }
        let [.., first, second, fins] = by;
        (by_state, [first, second, fins])
    }

    #[inline(always)]
    fn push(&self, dx: &State, du: &[f64; INPUTS]) -> State {
        let h = self.step_s;
        let accelerations = products(&self.by, &directions(dx, du));
        let mut moved = *dx;
        for ([first, second], acceleration) in DRIVEN.into_iter().zip(accelerations) {
            moved[first] += h * dx[second] + 0.5 * h * h * acceleration;
            moved[second] += h * acceleration;
        }
        moved
    }

    #[inline(always)]
    fn eliminate<C: Curvature<STATES>, R: Curvature<INPUTS>>(
        &self,
        stage: &Stage<C, R, STATES, INPUTS>,
        after: &[[f64; STATES]; STATES],
        before: &mut [[f64; STATES]; STATES],
        slope: &mut State,
    ) -> Option<Feedback<STATES, INPUTS>> {
        add_times(after, &stage.defect, slope);
        let pulled = self.pull(slope);
        let h = self.step_s;

        // Y, with the places' columns of G' P E before it.
        let mut y = [[0.0; WIDE]; ACCELERATIONS];
        for (row, [first, second]) in y.iter_mut().zip(DRIVEN) {
            let mut drawn = [0.0; STATES];
            for j in 0..STATES {
                drawn[j] = 0.5 * h * h * after[first][j] + h * after[second][j];
            }
            let mut half = [0.0; DIRECTIONS];
            for (weight, by) in self.drawn(&drawn).iter().zip(&self.by) {
                add_multiple(&mut half, 0.5 * weight, by);
            }
            row[..STATES].copy_from_slice(&self.shifted(drawn));
            for (sum, value) in row[PLACES..].iter_mut().zip(&half) {
                *sum += value;
            }
        }

        // D' Y, E' P E, and their sum.
        let mut product = [[0.0; WIDE]; DIRECTIONS];
        for (c, product) in product.iter_mut().enumerate() {
            let mut sum = [0.0; WIDE];
            for (by, y) in self.by.iter().zip(&y) {
                add_multiple(&mut sum, by[c], y);
            }
            *product = sum;
        }
        *before = *after;
        let xx = before;
        for [first, second] in DRIVEN {
            let row = xx[first];
            add_multiple(&mut xx[second], h, &row);
        }
        for row in &mut *xx {
            *row = self.shifted(*row);
        }
        let (mut ux, mut uu) = ([[0.0; STATES]; INPUTS], [[0.0; INPUTS]; INPUTS]);
        let sum = |c: usize, d: usize| {
            product[c][PLACES + d] + product[d][PLACES + c] + stage.share * self.bend[c][d]
        };
        for c in 0..MOVING {
            for d in 0..=c {
                let sum = sum(c, d);
                xx[PLACES + c][PLACES + d] += sum;
                if d < c {
                    xx[PLACES + d][PLACES + c] += sum;
                }
            }
            for i in 0..PLACES {
                xx[PLACES + c][i] += product[c][i];
                xx[i][PLACES + c] += product[c][i];
            }
        }
        for (i, (by_state, by_input)) in ux.iter_mut().zip(&mut uu).enumerate() {
            let (to_places, to_moving) = by_state.split_at_mut(PLACES);
            to_places.copy_from_slice(&product[MOVING + i][..PLACES]);
            for (d, entry) in to_moving.iter_mut().chain(by_input).enumerate() {
                *entry = sum(MOVING + i, d);
            }
        }
        stage.without_inputs(xx, ux, uu, &pulled, slope)
    }

    #[inline(always)]
    fn curve(&self, share: f64, dx: &State, du: &[f64; INPUTS]) -> (State, [f64; INPUTS]) {
        let bent = products(&self.bend, &directions(dx, du));
        let mut by_state = [0.0; STATES];
        for (sum, value) in by_state[PLACES..].iter_mut().zip(&bent) {
            *sum = share * value;
        }
        let [.., first, second, fins] = bent;
        (by_state, [share * first, share * second, share * fins])
    }
}
