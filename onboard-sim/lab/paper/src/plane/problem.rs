//! The landing problem, as data and as the solver reads it, and a lower bound of its touchdown
//! speed.

use core::array::from_fn;
use core::f64::consts::{FRAC_PI_2, PI};

use ocp::{Condition, DenseIntervals, InputRange, Model, Settings};

use crate::plane::LANDING_MISS;
use crate::plane::dynamics::{PlanarModel, PlanarState};
use crate::plane::intervals;

/// The box in which a planned trajectory ends, in addition to height and distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinalBox {
    /// Number of nodes at the end, one per sample, at which pitch, lateral speed and pitch rate are
    /// inside the box. With one node the vehicle may fly through the box at the last instant; with
    /// more it arrives settled.
    pub settled_nodes: usize,
    /// Largest pitch error from upright, degrees.
    pub pitch_error_deg: f64,
    /// Lowest axial velocity, m/s.
    pub u_min_m_s: f64,
    /// Highest axial velocity, m/s.
    pub u_max_m_s: f64,
    /// Largest lateral speed, m/s.
    pub w_m_s: f64,
    /// Largest pitch rate, degrees per second.
    pub pitch_rate_deg_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverLimits {
    /// Largest number of Newton iterations of one solve.
    pub max_iterations: usize,
    /// Residual of the optimality conditions that counts as converged.
    pub kkt_tolerance: f64,
    /// Penalty of a metre of unmet end condition (exact penalty), cost units per metre.
    pub terminal_penalty: f64,
}

/// One landing problem: from a state now, through intervals of held gimbal angle, to the ground.
///
/// Minimise the running cost (Eq. 28 of the landing paper) subject to the planar dynamics, the
/// gimbal limit, `z = 0` and `|x| <= x_final_m` at the end, and perhaps a box around the other
/// states there (the paper's Table 2). The conditions on states are exact penalties, so the problem
/// always has a solution. Cost and conditions are relative to an upright vehicle at rest at the
/// origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    pub model: PlanarModel,
    /// The state at the beginning of the first interval.
    pub initial: PlanarState,
    /// Number of intervals, at least 1.
    pub intervals: usize,
    /// Length of an interval, s.
    pub step_s: f64,
    pub thrust_n: f64,
    /// Weights of the deviations from the target, in state order.
    pub state_weights: [f64; 6],
    /// Weight of the gimbal angle.
    pub input_weight: f64,
    /// Largest gimbal angle on either side, rad.
    pub gimbal_limit_rad: f64,
    /// Largest horizontal distance from the origin at the end, m.
    pub x_final_m: f64,
    /// Box in which the other states end.
    pub final_box: Option<FinalBox>,
    pub solver: SolverLimits,
}

/// Where the vehicle shall be: upright and at rest at the origin.
const TARGET: [f64; 6] = [0.0, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0];

const X: usize = 0;
const Z: usize = 1;
const THETA: usize = 2;
const U: usize = 3;
const W: usize = 4;
const Q: usize = 5;

impl Problem {
    /// Deviation of a state from the target.
    #[inline]
    pub fn deviation(state: &[f64; 6]) -> [f64; 6] {
        from_fn(|i| state[i] - TARGET[i])
    }

    /// Running cost rate at a state and input.
    pub fn cost_rate(&self, state: &[f64; 6], gimbal_rad: f64) -> f64 {
        let deviation = Self::deviation(state);
        let state_part: f64 =
            self.state_weights.iter().zip(&deviation).map(|(weight, value)| weight * value * value).sum();
        0.5 * (state_part + self.input_weight * gimbal_rad * gimbal_rad)
    }

    /// Weights of the deviations from the target at a node.
    #[inline]
    fn node_weights(&self) -> [f64; 6] {
        self.state_weights.map(|weight| weight * self.step_s)
    }
}

/// Barrier of a cold solve's first iteration.
const FIRST_BARRIER: f64 = 1e3;

/// Bends of the cold guesses' pitch, rad. Those after the first two are only tried if the first two
/// do not land.
const BENDS_RAD: [f64; 4] = [0.3, -0.3, 3.3 * 0.3, -3.3 * 0.3];
const NARROW_BENDS: usize = 2;

impl Model<6, 1> for Problem {
    type Intervals = DenseIntervals<6, 1>;
    type StateCurvature = [f64; 6];
    type InputCurvature = [f64; 1];

    #[inline]
    fn intervals(&self) -> usize {
        self.intervals
    }

    #[inline]
    fn initial(&self) -> [f64; 6] {
        self.initial.to_array()
    }

    #[inline]
    fn input_ranges(&self) -> [InputRange; 1] {
        [InputRange { lower: -self.gimbal_limit_rad, upper: self.gimbal_limit_rad, unit: 1.0 }]
    }

    /// The end height first, then the end distance and the box.
    fn append_conditions(&self, conditions: &mut Vec<Condition>) {
        let end = self.intervals;
        conditions.push(Condition { node: end, component: Z, sign: 1.0, offset: 0.0, equality: true });
        let mut between = |node, component, lowest: f64, highest: f64| {
            let at_least = Condition { node, component, sign: 1.0, offset: lowest, equality: false };
            conditions.extend([at_least, Condition { sign: -1.0, offset: -highest, ..at_least }]);
        };
        between(end, X, -self.x_final_m, self.x_final_m);
        if let Some(limits) = self.final_box {
            let tilt = limits.pitch_error_deg.to_radians();
            let rate = limits.pitch_rate_deg_s.to_radians();
            between(end, U, limits.u_min_m_s, limits.u_max_m_s);
            // From the end backwards, so that a horizon that is too short for all nodes keeps the
            // order of the others.
            for node in (1..=end).rev().take(limits.settled_nodes) {
                between(node, THETA, FRAC_PI_2 - tilt, FRAC_PI_2 + tilt);
                between(node, W, -limits.w_m_s, limits.w_m_s);
                between(node, Q, -rate, rate);
            }
        }
    }

    #[inline]
    fn settings(&self) -> Settings {
        Settings {
            max_iterations: self.solver.max_iterations,
            tolerance: self.solver.kkt_tolerance,
            penalty: self.solver.terminal_penalty,
            first_barrier: FIRST_BARRIER,
            guesses: NARROW_BENDS,
            spare_guesses: BENDS_RAD.len() - NARROW_BENDS,
            acceptable_miss: LANDING_MISS,
        }
    }

    /// States on the straight line from the start to the target, the pitch bent by one full wave.
    /// The vehicle tilts one way and then the other, which wastes surplus thrust and ends upright.
    /// The path need not be flyable. Inputs are zero.
    fn guess(&self, index: usize, states: &mut [[f64; 6]], inputs_rad: &mut [[f64; 1]]) {
        let from = self.initial.to_array();
        for (k, state) in states.iter_mut().enumerate() {
            let share = k as f64 / self.intervals as f64;
            *state = from_fn(|i| from[i] + share * (TARGET[i] - from[i]));
            if k > 0 {
                state[THETA] += BENDS_RAD[index] * libm::sin(2.0 * PI * share);
            }
        }
        inputs_rad.fill([0.0]);
    }

    fn evaluate(
        &self,
        states: &[[f64; 6]],
        inputs_rad: &[[f64; 1]],
        costates: &[[f64; 6]],
        derivatives: bool,
        intervals: &mut DenseIntervals<6, 1>,
    ) {
        intervals::evaluate(self, states, inputs_rad, costates, derivatives, intervals);
    }

    fn next(&self, _: usize, state: &[f64; 6], [gimbal_rad]: &[f64; 1]) -> [f64; 6] {
        let state = PlanarState::from_array(*state);
        self.model.rk4_step(&state, *gimbal_rad, self.thrust_n, self.step_s).to_array()
    }

    /// Running cost (Eq. 28 of the landing paper).
    fn cost(&self, states: &[[f64; 6]], inputs_rad: &[[f64; 1]]) -> f64 {
        let rates =
            states[1..].iter().zip(inputs_rad).map(|(state, [input_rad])| self.cost_rate(state, *input_rad));
        self.step_s * rates.sum::<f64>()
    }

    #[inline]
    fn state_slope(&self, _: usize, state: &[f64; 6]) -> [f64; 6] {
        let (weights, deviation) = (self.node_weights(), Self::deviation(state));
        from_fn(|i| weights[i] * deviation[i])
    }

    #[inline]
    fn state_curvature(&self, _: usize, _: &[f64; 6]) -> [f64; 6] {
        self.node_weights()
    }

    #[inline]
    fn input_slope(&self, _: usize, [input_rad]: &[f64; 1]) -> [f64; 1] {
        [self.input_weight * self.step_s * input_rad]
    }

    #[inline]
    fn input_curvature(&self, _: usize, _: &[f64; 1]) -> [f64; 1] {
        [self.input_weight * self.step_s]
    }
}

// A lower bound of the touchdown speed with any controller.

/// Steps in an interval.
const SUB_STEPS: usize = 20;

/// The slowest vertical touchdown that any gimbal commands can reach from the problem's start, m/s;
/// 0 if the vehicle can stop sinking before it reaches the ground.
///
/// The vertical acceleration is largest upright with the nozzle centred, when all the thrust acts
/// against the weight. So a path that is upright from now on sinks slowest at every instant and
/// reaches the ground last, and no other path touches down slower. The bound neglects the drag of
/// sideways flight, which is below one thousandth of gravity at the landing paper's speeds, and the
/// time to turn upright.
pub fn best_touchdown_speed_m_s(problem: &Problem) -> f64 {
    let Problem { model, initial, thrust_n, .. } = problem;
    let (_, vertical_m_s) = initial.ground_velocity_m_s();
    let mut upright =
        PlanarState { z_m: initial.z_m, theta_rad: FRAC_PI_2, u_m_s: vertical_m_s, ..PlanarState::default() };
    let mut slowest_m_s = -vertical_m_s;
    for _ in 0..problem.intervals * SUB_STEPS {
        if upright.z_m <= 0.0 || slowest_m_s <= 0.0 {
            break;
        }
        upright = model.rk4_step(&upright, 0.0, *thrust_n, problem.step_s / SUB_STEPS as f64);
        slowest_m_s = slowest_m_s.min(-upright.u_m_s);
    }
    slowest_m_s.max(0.0)
}
