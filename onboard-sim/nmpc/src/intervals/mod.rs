//! The planar dynamics in every interval, with exact first and second derivatives: several intervals at once in vector
//! registers (`lanes`).
//!
//! * `block`: inputs and results of an evaluation.
//! * `step`: the RK4 step and its adjoint; `tangent`: its tangent and curvature.
//! * `line`: one interval's derivatives, out of the lanes; `rows`: as the sweeps of the solver need them, with `four` for
//!   vectors and `split` for the value function.
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

mod block;
mod four;
mod lanes;
mod line;
mod rows;
mod split;
mod step;
mod tangent;

use alloc::vec::Vec;
use core::array::from_fn;

use pulp::{Arch, NullaryFnOnce};

use crate::Problem;
use block::{Block, Constants, D, Points};
use lanes::LANES;
use line::Line;
use rows::Rows;
use split::Split;
use step::evaluate;

/// The intervals of a horizon.
#[derive(Debug, Clone, Default)]
pub struct Blocks {
    /// Several intervals to a block.
    evaluated: Vec<Block>,
    /// Those of each block's intervals.
    lines: Vec<[Line; LANES]>,
    step_s: f64,
}

impl Blocks {
    /// Evaluates every interval, with tangents and curvature if asked for.
    pub(crate) fn evaluate<const DERIVATIVES: bool>(
        &mut self,
        problem: &Problem,
        states: &[[f64; 6]],
        inputs_rad: &[[f64; 1]],
        costates: &[[f64; 6]],
    ) {
        let constants = &Constants::of(&problem.model, problem.step_s);
        let count = inputs_rad.len();
        let (thrust_n, mass_kg) = (&problem.thrust_n, &problem.mass_kg);
        let across = constants.pushed_across();
        let mut points = Points::rest(constants);
        let arch = Arch::new();
        self.step_s = problem.step_s;
        for (index, (block, lines)) in self.evaluated.iter_mut().zip(&mut self.lines).enumerate() {
            for lane in 0..LANES {
                // Lanes beyond the end repeat the last interval.
                let k = (index * LANES + lane).min(count - 1);
                for i in 0..6 {
                    points.state[i].0[lane] = states[k][i];
                    points.costate[i].0[lane] = costates[k + 1][i];
                }
                points.gimbal.0[lane] = inputs_rad[k][0];
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
            if DERIVATIVES {
                line::write(block, lines);
            }
        }
    }
}

impl stages::Intervals<6, 1> for Blocks {
    /// Nothing depends on x and z.
    const INTEGRALS: usize = 2;

    type Value = Split;
    type Interval<'a> = Rows<'a>;

    fn resize(&mut self, intervals: usize) {
        self.evaluated.resize(intervals.div_ceil(LANES), Block::EMPTY);
        self.lines.resize(intervals.div_ceil(LANES), [Line::EMPTY; LANES]);
    }

    #[inline(always)]
    fn end(&self, k: usize) -> [f64; 6] {
        let after = &self.evaluated[k / LANES].after;
        from_fn(|i| after[i].0[k % LANES])
    }

    #[inline(always)]
    fn pulled(&self, k: usize, lambda: &[f64; 6]) -> ([f64; 6], [f64; 1]) {
        let block = &self.evaluated[k / LANES];
        let pulled = |direction: usize| block.pulled[direction].0[k % LANES];
        ([lambda[0], lambda[1], pulled(0), pulled(1), pulled(2), pulled(3)], [pulled(D)])
    }

    #[inline(always)]
    fn interval(&self, k: usize) -> Rows<'_> {
        Rows::of(&self.evaluated[k / LANES], &self.lines[k / LANES][k % LANES], k % LANES, self.step_s)
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

#[cfg(test)]
mod tests;
