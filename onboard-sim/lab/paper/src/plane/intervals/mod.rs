//! The planar dynamics in every interval, with exact first and second derivatives: several intervals at once in vector
//! registers (`lanes`).
//!
//! * `step`: the RK4 step, its adjoint, its tangent and its curvature.
//! * `rows`: one interval's derivatives, out of the lanes, as the sweeps of the solver need them, and the value function.
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

mod lanes;
mod rows;
mod step;
#[cfg(test)]
mod tests;

use core::array::from_fn;
use pulp::{Arch, NullaryFnOnce};

use self::lanes::{LANES, Lanes};
use self::rows::{Line, Rows, Split};
use self::step::evaluate;
use crate::plane::Problem;
use crate::plane::dynamics::{ModelKind, PlanarModel};

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
        let constants = &Constants::of(&problem.model, problem.thrust_n, problem.step_s);
        let count = inputs_rad.len();
        let mut points = Points::EMPTY;
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
            }
            let points = &points;
            if constants.printed {
                arch.dispatch(Kernel::<DERIVATIVES, true> { constants, points, block });
            } else {
                arch.dispatch(Kernel::<DERIVATIVES, false> { constants, points, block });
            }
            if DERIVATIVES {
                rows::write(block, lines);
            }
        }
    }
}

impl ocp::Intervals<6, 1> for Blocks {
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
struct Kernel<'a, const DERIVATIVES: bool, const PRINTED: bool> {
    constants: &'a Constants,
    points: &'a Points,
    block: &'a mut Block,
}

impl<const DERIVATIVES: bool, const PRINTED: bool> NullaryFnOnce for Kernel<'_, DERIVATIVES, PRINTED> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        evaluate::<DERIVATIVES, PRINTED>(self.constants, self.points, self.block);
    }
}

// The inputs and results of the evaluation of intervals, for several nodes at once.

/// Directions of differentiation: theta, u, w, q, delta.
const DIRECTIONS: usize = 5;
const TH: usize = 0;
const U: usize = 1;
const W: usize = 2;
const Q: usize = 3;
const D: usize = 4;

/// Number of entries of a symmetric matrix over the directions.
const PAIRS: usize = 15;

/// Position of each pair of directions in a packed upper triangle, row by row.
const fn pair(row: usize, column: usize) -> usize {
    row * (9 - row) / 2 + column
}

/// Sign of `w sin(theta)` in the horizontal velocity, by which the printed equations differ.
const fn lateral_sign(printed: bool) -> f64 {
    if printed { -1.0 } else { 1.0 }
}

/// The constants of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Constants {
    step_s: f64,
    /// Acceleration and pitch acceleration of the whole thrust, m/s^2 and rad/s^2.
    thrust_m_s2: f64,
    turning_rad_s2: f64,
    drag_per_m: f64,
    gravity_m_s2: f64,
    printed: bool,
}

impl Constants {
    fn of(model: &PlanarModel, thrust_n: f64, step_s: f64) -> Self {
        Self {
            step_s,
            thrust_m_s2: thrust_n * (1.0 / model.mass_kg),
            turning_rad_s2: thrust_n * (model.thrust_arm_m / model.pitch_inertia_kg_m2),
            drag_per_m: model.drag_per_m,
            gravity_m_s2: model.gravity_m_s2,
            printed: model.kind == ModelKind::AsPrinted,
        }
    }
}

/// The points of linearisation: state at the beginning of each interval, input, and the costate of the state after it.
#[derive(Debug, Clone, Copy)]
struct Points {
    state: [Lanes; 6],
    gimbal: Lanes,
    costate: [Lanes; 6],
}

impl Points {
    const EMPTY: Self = Self { state: [Lanes::ZERO; 6], gimbal: Lanes::ZERO, costate: [Lanes::ZERO; 6] };
}

/// Intervals and their derivatives.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    /// The state after the interval.
    after: [Lanes; 6],
    /// Derivative of `lambda . step` by theta, u, w, q, delta; by x and z it is lambda's own.
    pulled: [Lanes; DIRECTIONS],
    /// Derivatives of x, z, u and w after the interval by the directions.
    tangent: [[Lanes; DIRECTIONS]; 4],
    /// Derivative of q after the interval by delta; that of theta is half a step times it.
    turn: Lanes,
    /// Second derivative of `lambda . step` by the directions, packed.
    curvature: [Lanes; PAIRS],
}

impl Block {
    const EMPTY: Self = Self {
        after: [Lanes::ZERO; 6],
        pulled: [Lanes::ZERO; DIRECTIONS],
        tangent: [[Lanes::ZERO; DIRECTIONS]; 4],
        turn: Lanes::ZERO,
        curvature: [Lanes::ZERO; PAIRS],
    };
}

/// The values that are constant over the interval.
#[derive(Clone, Copy)]
struct Held {
    /// Acceleration along the nose axis and along the second body axis, m/s^2. Except for the sign, each is the
    /// derivative of the other by the gimbal angle.
    push: Lanes,
    side: Lanes,
    /// Pitch acceleration, rad/s^2, and its derivative by the gimbal angle.
    turn_acc: Lanes,
    turn_acc_d: Lanes,
}

impl Held {
    #[inline(always)]
    fn of(c: &Constants, gimbal: Lanes) -> Self {
        let (sin, cos) = gimbal.sin_cos();
        Self {
            push: cos * c.thrust_m_s2,
            side: -(sin * c.thrust_m_s2),
            turn_acc: -(sin * c.turning_rad_s2),
            turn_acc_d: -(cos * c.turning_rad_s2),
        }
    }
}

/// The values of a stage that the derivatives need.
#[derive(Clone, Copy)]
struct Stage {
    sin: Lanes,
    cos: Lanes,
    u: Lanes,
    w: Lanes,
    q: Lanes,
    x_dot: Lanes,
    z_dot: Lanes,
    u_dot: Lanes,
    w_dot: Lanes,
    /// Derivative of the drag's acceleration by u and w.
    drag_u: Lanes,
    drag_w: Lanes,
    /// u and w over the speed.
    along: Lanes,
    across: Lanes,
}

const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
/// The fraction of the step at which a stage lies, by which q and delta move its pitch and pitch rate.
const AHEAD: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
/// Fraction of half a squared step by which the pitch acceleration moves a stage's pitch.
const TURNED: [f64; 4] = [0.0, 0.0, 0.5, 1.0];
