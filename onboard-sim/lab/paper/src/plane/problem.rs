//! The landing problem, as data, and a lower bound of its touchdown speed.

pub use stages::Condition;
use stages::Settings;

use crate::plane::LANDING_MISS;
use crate::plane::dynamics::{PlanarModel, PlanarParams, PlanarState};

/// The box in which a planned trajectory ends, in addition to height and distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinalBox {
    /// Number of nodes at the end, one per sample, at which pitch, lateral speed and pitch rate are inside the box.
    /// With one node the vehicle may fly through the box at the last instant; with more it arrives settled.
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
    /// Amplitude of the bent initial guesses, rad of pitch.
    pub guess_amplitude_rad: f64,
    /// Half-waves of the bent initial guesses over the horizon.
    pub guess_half_waves: u32,
}

/// Barrier of a cold solve's first iteration.
const FIRST_BARRIER: f64 = 1e3;

impl SolverLimits {
    /// The solver's settings for a model with so many guesses.
    pub(crate) fn settings(&self, guesses: usize, spare_guesses: usize) -> Settings {
        Settings {
            max_iterations: self.max_iterations,
            tolerance: self.kkt_tolerance,
            penalty: self.terminal_penalty,
            first_barrier: FIRST_BARRIER,
            guesses,
            spare_guesses,
            acceptable_miss: LANDING_MISS,
        }
    }
}

/// One landing problem: from a state now, through intervals of held gimbal angle, to the ground.
///
/// Minimise the running cost (Eq. 28 of the landing paper) subject to the planar dynamics, the gimbal limit,
/// `z = 0` and `|x| <= x_final_m` at the end, and perhaps a box around the other states there (the paper's Table 2)
/// and `z >= altitude_min_m` at every node before it. The conditions on states are exact penalties, so the problem
/// always has a solution.
///
/// Cost and end conditions are relative to a [`target`](Self::target), which is upright and at rest at the origin in
/// the paper. In the frame that moves with the wind, the target is at rest on the ground: upright, with a `w` of minus
/// the wind.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The dynamics.
    pub model: PlanarModel,
    /// The state at the beginning of the first interval.
    pub initial: PlanarState,
    /// Length of an interval, s.
    pub step_s: f64,
    /// Thrust in each interval, N; its length is the number of intervals.
    pub thrust_n: Vec<f64>,
    /// Mass in each interval, kg, which scales thrust and air forces; empty for the model's own mass.
    pub mass_kg: Vec<f64>,
    /// Reference of running cost, of horizontal distance and height at the end, and of the box there in pitch, `w` and
    /// pitch rate. The box in `u` is absolute.
    pub target: PlanarState,
    /// Weights of the deviations from the target, in state order.
    pub state_weights: [f64; 6],
    /// Weight of the gimbal angle.
    pub input_weight: f64,
    /// Largest gimbal angle on either side, rad.
    pub gimbal_limit_rad: f64,
    /// Largest horizontal distance from the target at the end, m.
    pub x_final_m: f64,
    /// Box in which the other states end.
    pub final_box: Option<FinalBox>,
    /// Lowest altitude at the nodes before the end, m.
    pub altitude_min_m: Option<f64>,
    /// Rise of that floor per second before the end, m/s: a leaning vehicle needs room for its legs until it is
    /// upright.
    pub floor_rise_m_s: f64,
    /// Fastest touchdown that counts as a landing, m/s.
    pub touchdown_speed_max_m_s: f64,
    /// Limits of the solver.
    pub solver: SolverLimits,
}

const X: usize = 0;
const Z: usize = 1;
const THETA: usize = 2;
const U: usize = 3;
const W: usize = 4;
const Q: usize = 5;

impl Problem {
    /// The model in interval `k`, with the mass there.
    pub fn model_at(&self, k: usize) -> PlanarModel {
        self.mass_kg.get(k).map_or(self.model, |mass_kg| self.model.with_mass(*mass_kg))
    }

    /// Number of intervals.
    pub fn intervals(&self) -> usize {
        self.thrust_n.len()
    }

    /// The conditions, in the order of their multipliers: those at the end, height first, then the floor at each
    /// node before it.
    pub fn conditions(&self) -> Vec<Condition> {
        let mut conditions = Vec::new();
        self.append_all_conditions(&mut conditions);
        conditions
    }

    /// Appends the conditions; allocates only if the vector never held as many.
    pub(super) fn append_all_conditions(&self, conditions: &mut Vec<Condition>) {
        self.append_end_conditions(conditions);
        if let Some(altitude_min_m) = self.altitude_min_m {
            let end = self.intervals();
            conditions.extend((1..end).map(|node| Condition {
                node,
                component: Z,
                sign: 1.0,
                offset: altitude_min_m + self.floor_rise_m_s * (end - node) as f64 * self.step_s,
                equality: false,
            }));
        }
    }

    /// Number of conditions at the end of the horizon.
    pub fn end_conditions_len(&self) -> usize {
        if self.intervals() == 0 {
            return 0;
        }
        3 + self.final_box.map_or(0, |limits| 2 + 6 * limits.settled_nodes.min(self.intervals()))
    }

    /// Appends the conditions at the end of the horizon; none without intervals.
    fn append_end_conditions(&self, conditions: &mut Vec<Condition>) {
        let end = self.intervals();
        if end == 0 {
            return;
        }
        let at_least = |node, component, lowest| Condition {
            node,
            component,
            sign: 1.0,
            offset: lowest,
            equality: false,
        };
        let at_most = |node, component, highest: f64| Condition {
            node,
            component,
            sign: -1.0,
            offset: -highest,
            equality: false,
        };
        let between = |node, component, lowest, highest| {
            [at_least(node, component, lowest), at_most(node, component, highest)]
        };
        let about = |node, component, centre: f64, reach: f64| {
            between(node, component, centre - reach, centre + reach)
        };
        let target = &self.target;
        conditions.push(Condition { equality: true, ..at_least(end, Z, target.z_m) });
        conditions.extend(about(end, X, target.x_m, self.x_final_m));
        if let Some(limits) = self.final_box {
            let tilt = limits.pitch_error_deg.to_radians();
            let rate = limits.pitch_rate_deg_s.to_radians();
            conditions.extend(between(end, U, limits.u_min_m_s, limits.u_max_m_s));
            // From the end backwards, so that a horizon that is too short for all nodes keeps the order of the others.
            for node in (1..=end).rev().take(limits.settled_nodes) {
                conditions.extend(about(node, THETA, target.theta_rad, tilt));
                conditions.extend(about(node, W, target.w_m_s, limits.w_m_s));
                conditions.extend(about(node, Q, target.q_rad_s, rate));
            }
        }
    }

    /// Deviation of a state from the target.
    #[inline]
    pub fn deviation(&self, state: &[f64; 6]) -> [f64; 6] {
        let target = self.target.to_array();
        core::array::from_fn(|i| state[i] - target[i])
    }

    /// Running cost rate at a state and input.
    pub fn cost_rate(&self, state: &[f64; 6], gimbal_rad: f64) -> f64 {
        let deviation = self.deviation(state);
        let state_part: f64 =
            self.state_weights.iter().zip(&deviation).map(|(weight, value)| weight * value * value).sum();
        0.5 * (state_part + self.input_weight * gimbal_rad * gimbal_rad)
    }

    /// Whether every number of the problem is finite, so that it can be solved at all.
    pub(super) fn is_finite(&self) -> bool {
        self.initial.is_finite()
            && self.step_s.is_finite()
            && self.step_s > 0.0
            && self.target.is_finite()
            && self.thrust_n.iter().all(|thrust| thrust.is_finite())
            && (self.mass_kg.is_empty() || self.mass_kg.len() == self.intervals())
            && self.mass_kg.iter().all(|mass| mass.is_finite() && *mass > 0.0)
            && self.floor_rise_m_s.is_finite()
            && self.gimbal_limit_rad.is_finite()
    }
}

// A lower bound of the touchdown speed with any controller.

/// Sub-steps of the interval that contains the instant of contact.
const SUB_STEPS: usize = 20;

/// The slowest vertical touchdown that any gimbal commands can reach from the problem's start, m/s; 0 if the vehicle
/// can stop sinking before it reaches the ground.
///
/// The vertical acceleration is largest upright with the nozzle centred, when all the thrust acts against the weight.
/// So a path that is upright from now on sinks slowest at every instant and reaches the ground last, and no other path
/// touches down slower. The bound neglects the drag of sideways flight, which is below one thousandth of gravity at the
/// landing paper's speeds, and the time to turn upright.
pub fn best_touchdown_speed_m_s(problem: &Problem) -> f64 {
    let (_, vertical_m_s) = problem.initial.ground_velocity_m_s();
    let mut state = Upright { z_m: problem.initial.z_m, sink_m_s: -vertical_m_s };
    let mut slowest_m_s = state.sink_m_s;
    let sub_step_s = problem.step_s / SUB_STEPS as f64;
    for (k, thrust_n) in problem.thrust_n.iter().enumerate() {
        let params = problem.model_at(k).params;
        if state.z_m <= 0.0 || slowest_m_s <= 0.0 {
            return slowest_m_s.max(0.0);
        }
        let after = state.after(&params, *thrust_n, problem.step_s);
        if after.z_m > 0.0 {
            state = after;
        } else {
            for _ in 0..SUB_STEPS {
                slowest_m_s = slowest_m_s.min(state.sink_m_s);
                if state.z_m <= 0.0 || slowest_m_s <= 0.0 {
                    return slowest_m_s.max(0.0);
                }
                state = state.after(&params, *thrust_n, sub_step_s);
            }
        }
        slowest_m_s = slowest_m_s.min(state.sink_m_s);
    }
    slowest_m_s.max(0.0)
}

/// Height and rate of descent of an upright vehicle.
#[derive(Clone, Copy)]
struct Upright {
    z_m: f64,
    sink_m_s: f64,
}

impl Upright {
    /// One step of the classical fourth-order Runge-Kutta method; the planar equations at `theta = pi/2`.
    fn after(self, params: &PlanarParams, thrust_n: f64, step_s: f64) -> Self {
        let gained = params.gravity_m_s2 - thrust_n / params.mass_kg;
        let rate = |sink_m_s: f64| gained - params.drag_per_m * sink_m_s * sink_m_s.abs();
        let s1 = self.sink_m_s;
        let a1 = rate(s1);
        let s2 = s1 + 0.5 * step_s * a1;
        let a2 = rate(s2);
        let s3 = s1 + 0.5 * step_s * a2;
        let a3 = rate(s3);
        let s4 = s1 + step_s * a3;
        let a4 = rate(s4);
        Self {
            z_m: self.z_m - step_s / 6.0 * (s1 + 2.0 * (s2 + s3) + s4),
            sink_m_s: s1 + step_s / 6.0 * (a1 + 2.0 * (a2 + a3) + a4),
        }
    }
}
