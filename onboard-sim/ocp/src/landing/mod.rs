//! The landing as an optimal-control problem in space, and its solver: the nose may lean in any
//! direction.
//!
//! [`solve`] takes a [`Problem`] and, if there is one, a [`Start`]; its [`Outcome`] has the status
//! of the solve, and the [`Workspace`] the path. The crate's page has the solver's formulation and
//! its references. Exact second derivatives are needed: the multiplier of the end height is large,
//! so the curvature of the dynamics counts.
//!
//! A surplus of impulse is best wasted with a lean of constant size whose direction turns once
//! around: the vehicle then never passes through upright on the way, as it must in a plane, and its
//! sideways motion ends by itself.
//!
//! Ground frame: `x`, `y` level, `z` up. The nose is `n = (sin p, cos p sin r, cos p cos r)`, so
//! `p` is the lean towards `x` and `r` the lean towards `y`, both zero upright. States are the
//! position of the feet, the velocity, `p`, `r` and their rates. Inputs are the gimbal angles that
//! turn the nose towards growing `p` and `r`, and the share of the fins' drag area that stands in
//! the air.
//!
//! ```text
//! v'  = (T/m) (n - dp e_p - dr e_r) - g e_z + drag
//! p'' = (T l / I) dp - r'^2 sin p cos p
//! r'' = ((T l / I) dr + 2 p' r' sin p) / cos p
//! ```
//!
//! with `e_p = dn/dp`, `e_r = dn/dr / cos p`: a slender axisymmetric body that does not roll. The
//! gimbal's angles are small; their second order in the thrust is left out (0.3 % at 4.5 degrees).

mod interval;
mod stage;
#[cfg(test)]
mod tests;

use crate::{Condition, InputRange, Interval as _, Model, Outcome, Settings, Start};
use alloc::vec::Vec;
use core::array::from_fn;
use core::f64::consts::TAU;
use serde::{Deserialize, Serialize};

use self::stage::LandingIntervals;

/// Number of states and inputs.
pub const STATES: usize = 10;
pub const INPUTS: usize = 3;

/// A state: feet (x, y, z), m; velocity, m/s; leans p and r, rad; their rates, rad/s.
pub type State = [f64; STATES];

/// Largest miss of a condition by a path that lands, m, m/s, rad or rad/s.
pub const LANDING_MISS: f64 = 1e-3;

/// Barrier of a cold solve's first iteration. A cold solve takes 56 iterations (geometric mean of
/// 200 starts, penalty 1000) with 1000 and 46 with 30.
const FIRST_BARRIER: f64 = 30.0;

/// Termination limits of a solve, and the cost of a broken condition.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SolverLimits {
    /// Largest number of Newton iterations of one solve.
    pub max_iterations: usize,
    /// Residual of the optimality conditions that counts as converged.
    pub kkt_tolerance: f64,
    /// Penalty of a metre of unmet end condition (exact penalty), cost units per metre.
    pub terminal_penalty: f64,
}

/// The buffers of a solve, and its result.
pub type Workspace = crate::Workspace<Problem, STATES, INPUTS>;

/// [`crate::Workspace::solve`], compiled here with the solver's settings: a program may compile its
/// callers for size.
pub fn solve(
    workspace: &mut Workspace,
    problem: &Problem,
    start: Option<&Start<'_, STATES, INPUTS>>,
) -> Outcome {
    workspace.solve(problem, start)
}

/// [`crate::Workspace::lagrangian`], compiled here as well.
pub fn lagrangian(workspace: &mut Workspace, problem: &Problem, solution: &Start<'_, STATES, INPUTS>) -> f64 {
    workspace.lagrangian(problem, solution)
}

/// Data of one interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Thrust over mass, m/s^2.
    pub thrust_m_s2: f64,
    /// Rotational acceleration of a radian of the gimbal, rad/s^2.
    pub turning_rad_s2: f64,
    /// One over the mass, 1/kg.
    pub per_kg: f64,
}

/// Half the air's density times drag areas, kg/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drag {
    /// Of the open fins, as wide as long: against the velocity.
    pub fins: f64,
    /// Along the axis.
    pub axial: f64,
    /// Across the axis.
    pub crossflow: f64,
}

/// The box of the end. A component may miss its centre by this on either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    /// Range of the vertical velocity, m/s, up positive.
    pub vertical_m_s: [f64; 2],
    pub lateral_m_s: f64,
    pub lean_rad: f64,
    pub rate_rad_s: f64,
    /// Number of last nodes inside the box, except for the vertical velocity, at least 1.
    pub settled_nodes: usize,
}

/// The weights of the running cost, per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the distance from the target, 1/m^2.
    pub place: f64,
    /// Of the height, 1/m^2.
    pub height: f64,
    /// Of the level and of the vertical velocity, s^2/m^2.
    pub velocity: [f64; 2],
    /// Of the leans, 1/rad^2.
    pub lean: f64,
    /// Of the rates, s^2/rad^2.
    pub rate: f64,
    /// Of the gimbal angles, 1/rad^2.
    pub gimbal: f64,
    /// Of the fins' distance from half open.
    pub fins: f64,
}

/// One landing: from a state now, through intervals of held gimbal angles, to the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    pub initial: State,
    pub step_s: f64,
    pub pushes: Vec<Push>,
    pub drag: Drag,
    /// Wind, m/s.
    pub wind_m_s: [f64; 2],
    pub gravity_m_s2: f64,
    /// Level place to land at, m.
    pub target_m: [f64; 2],
    pub weights: Weights,
    pub gimbal_limit_rad: f64,
    /// Largest lean `p` and `r`, rad.
    pub lean_max_rad: f64,
    pub end: End,
    /// Smallest height of the feet per second before the end, m/s.
    pub floor_rise_m_s: f64,
    /// Size of the lean of the cold guesses, rad, and its first direction from `x` towards `y`,
    /// rad.
    pub guess_lean_rad: f64,
    pub guess_towards_rad: f64,
    pub solver: SolverLimits,
}

// The nose's direction and vectors in space.

type Vector = [f64; 3];

fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + f b`.
fn plus(a: &Vector, f: f64, b: &Vector) -> Vector {
    [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]]
}

fn times(f: f64, a: &Vector) -> Vector {
    [f * a[0], f * a[1], f * a[2]]
}

/// The nose and its derivatives by the leans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nose {
    pub sin_p: f64,
    pub cos_p: f64,
    pub n: [f64; 3],
    pub e_p: [f64; 3],
    pub e_r: [f64; 3],
    /// Derivative of `e_r` by `r`.
    pub m: [f64; 3],
}

impl Nose {
    pub fn at(p: f64, r: f64) -> Self {
        let (sin_p, cos_p) = libm::sincos(p);
        let (sin_r, cos_r) = libm::sincos(r);
        Self {
            sin_p,
            cos_p,
            n: [sin_p, cos_p * sin_r, cos_p * cos_r],
            e_p: [cos_p, -sin_p * sin_r, -sin_p * cos_r],
            e_r: [0.0, cos_r, -sin_r],
            m: [0.0, -sin_r, -cos_r],
        }
    }
}

// The landing in space, as the solver reads it.

/// Opening of the fins that costs nothing: with it they can brake more or less than planned.
const HALF_OPEN: f64 = 0.5;

/// Conditions of a node in the box, of the end's vertical velocity, and of a node's lean.
const BOX: usize = 12;
const END: usize = 2;
const LEAN: usize = 4;

/// Turns of the cold guesses' lean: once around in either direction. Upright is only tried if
/// neither lands.
const TURNS: [f64; 3] = [1.0, -1.0, 0.0];
const TURNING: usize = 2;

/// Writes the conditions' multipliers of the last `remaining` of a solution's `intervals`; see
/// `append_conditions` for their order.
pub fn last_multipliers(
    all: &[f64],
    settled_nodes: usize,
    intervals: usize,
    remaining: usize,
    into: &mut Vec<f64>,
) {
    let flown = intervals - remaining;
    let lean = BOX * settled_nodes + END;
    let floor = lean + LEAN * (intervals - 1);
    into.clear();
    into.extend_from_slice(&all[..lean]);
    into.extend_from_slice(&all[lean + LEAN * flown..floor]);
    into.extend_from_slice(&all[floor + flown..]);
}

impl Problem {
    fn state_weights(&self) -> State {
        let Self { weights, step_s, .. } = self;
        let Weights { place, height, velocity: [level, vertical], lean, rate, .. } = *weights;
        [place, place, height, level, level, vertical, lean, lean, rate, rate].map(|weight| weight * step_s)
    }

    fn deviation(&self, state: &State) -> State {
        let mut deviation = *state;
        deviation[0] -= self.target_m[0];
        deviation[1] -= self.target_m[1];
        deviation
    }

    fn input_weights(&self) -> [f64; INPUTS] {
        let Self { weights, step_s, .. } = self;
        [weights.gimbal * step_s, weights.gimbal * step_s, weights.fins * step_s]
    }

    fn input_deviation(input: &[f64; INPUTS]) -> [f64; INPUTS] {
        [input[0], input[1], input[2] - HALF_OPEN]
    }
}

impl Model<STATES, INPUTS> for Problem {
    type Intervals = LandingIntervals;
    type StateCurvature = State;
    type InputCurvature = [f64; INPUTS];

    fn intervals(&self) -> usize {
        self.pushes.len()
    }

    fn initial(&self) -> State {
        self.initial
    }

    fn input_ranges(&self) -> [InputRange; INPUTS] {
        let gimbal = InputRange { lower: -self.gimbal_limit_rad, upper: self.gimbal_limit_rad, unit: 1.0 };
        [gimbal, gimbal, InputRange { lower: 0.0, upper: 1.0, unit: 0.5 }]
    }

    fn append_conditions(&self, conditions: &mut Vec<Condition>) {
        let last = self.pushes.len();
        let end = &self.end;
        let mut within = |node: usize, component: usize, lower: f64, upper: f64| {
            conditions.push(Condition { node, component, sign: 1.0, offset: lower, equality: false });
            conditions.push(Condition { node, component, sign: -1.0, offset: -upper, equality: false });
        };
        for node in last + 1 - end.settled_nodes.min(last)..=last {
            for (component, most) in [
                (3, end.lateral_m_s),
                (4, end.lateral_m_s),
                (6, end.lean_rad),
                (7, end.lean_rad),
                (8, end.rate_rad_s),
                (9, end.rate_rad_s),
            ] {
                within(node, component, -most, most);
            }
        }
        within(last, 5, end.vertical_m_s[0], end.vertical_m_s[1]);
        for node in 1..last {
            within(node, 6, -self.lean_max_rad, self.lean_max_rad);
            within(node, 7, -self.lean_max_rad, self.lean_max_rad);
        }
        for node in 1..last {
            let offset = self.floor_rise_m_s * self.step_s * (last - node) as f64;
            conditions.push(Condition { node, component: 2, sign: 1.0, offset, equality: false });
        }
        conditions.push(Condition { node: last, component: 2, sign: 1.0, offset: 0.0, equality: true });
    }

    fn settings(&self) -> Settings {
        Settings {
            max_iterations: self.solver.max_iterations,
            tolerance: self.solver.kkt_tolerance,
            penalty: self.solver.terminal_penalty,
            first_barrier: FIRST_BARRIER,
            guesses: TURNING,
            spare_guesses: TURNS.len() - TURNING,
            acceptable_miss: LANDING_MISS,
        }
    }

    /// Positions and velocities on the straight line to rest at the target, and a lean of one size
    /// that turns around.
    fn guess(&self, index: usize, states: &mut [State], inputs: &mut [[f64; INPUTS]]) {
        let last = self.pushes.len() as f64;
        let [x_m, y_m] = self.target_m;
        let to = [x_m, y_m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (k, state) in states.iter_mut().enumerate() {
            let share = k as f64 / last;
            *state = from_fn(|i| self.initial[i] + share * (to[i] - self.initial[i]));
            if k > 0 {
                // It grows from zero at the start and falls to zero at the end.
                let size = self.guess_lean_rad * 4.0 * share * (1.0 - share) * TURNS[index].abs();
                let (sin, cos) = libm::sincos(self.guess_towards_rad + TAU * TURNS[index] * share);
                state[6] += size * cos;
                state[7] += size * sin;
            }
        }
        inputs.fill([0.0, 0.0, HALF_OPEN]);
    }

    fn evaluate(
        &self,
        states: &[State],
        inputs: &[[f64; INPUTS]],
        costates: &[State],
        derivatives: bool,
        intervals: &mut Self::Intervals,
    ) {
        for (k, into) in intervals.0.iter_mut().enumerate() {
            let (state, input, costate) = (&states[k], &inputs[k], &costates[k + 1]);
            if derivatives {
                interval::evaluated(self, k, state, input, costate, into);
            } else {
                into.end = interval::end(self, k, state, input);
            }
            into.pulled = (&*into).pull(costate);
        }
    }

    fn next(&self, k: usize, state: &State, input: &[f64; INPUTS]) -> State {
        interval::end(self, k, state, input)
    }

    fn cost(&self, states: &[State], inputs: &[[f64; INPUTS]]) -> f64 {
        let weights = self.state_weights();
        let mut sum = 0.0;
        for state in &states[1..] {
            let deviation = self.deviation(state);
            for (weight, value) in weights.iter().zip(&deviation) {
                sum += weight * value * value;
            }
        }
        let weights = self.input_weights();
        for input in inputs {
            for (weight, value) in weights.iter().zip(Self::input_deviation(input)) {
                sum += weight * value * value;
            }
        }
        0.5 * sum
    }

    fn state_slope(&self, _: usize, state: &State) -> State {
        let (weights, deviation) = (self.state_weights(), self.deviation(state));
        from_fn(|i| weights[i] * deviation[i])
    }

    fn state_curvature(&self, _: usize, _: &State) -> State {
        self.state_weights()
    }

    fn input_slope(&self, _: usize, input: &[f64; INPUTS]) -> [f64; INPUTS] {
        let (weights, deviation) = (self.input_weights(), Self::input_deviation(input));
        from_fn(|i| weights[i] * deviation[i])
    }

    fn input_curvature(&self, _: usize, _: &[f64; INPUTS]) -> [f64; INPUTS] {
        self.input_weights()
    }
}
