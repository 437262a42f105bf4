//! The solver's buffers, between a problem and its solution; and the problem as the solver reads it.

use core::array::from_fn;
use core::f64::consts::PI;
use core::iter::repeat;
use stages::{Condition, InputRange, Model, Settings, Start, Status};

use crate::plane::dynamics::PlanarState;
use crate::plane::intervals::Blocks;
use crate::plane::{Problem, Solution, SolveStatus, WarmStart, rollout};

/// Buffers of a solve, kept so that the next solve does not allocate. The result does not depend on them.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    solver: stages::Workspace<Problem, 6, 1>,
    start: StartBuffers,
}

/// The parts of a start that the solver has in another form.
#[derive(Debug, Clone, Default)]
struct StartBuffers {
    states: Vec<[f64; 6]>,
    condition_multipliers: Vec<f64>,
}

impl StartBuffers {
    /// A start from these parts.
    fn fill<'a>(
        &'a mut self,
        problem: &Problem,
        states: &[PlanarState],
        inputs_rad: &'a [f64],
        costates: &'a [[f64; 6]],
        limit_multipliers: &'a [[f64; 2]],
        [end_multipliers, floor_multipliers]: [&[f64]; 2],
    ) -> Start<'a, 6, 1> {
        self.states.clear();
        self.states.extend(states.iter().map(|state| state.to_array()));
        // A horizon too short for all settled nodes has fewer conditions at its end than the earlier solution had.
        let ends = end_multipliers.iter().chain(repeat(&0.0)).take(problem.end_conditions_len());
        self.condition_multipliers.clear();
        self.condition_multipliers.extend(ends.chain(floor_multipliers));
        Start {
            states: &self.states,
            inputs: inputs_rad.as_chunks().0,
            costates,
            limit_multipliers: limit_multipliers.as_chunks().0,
            condition_multipliers: &self.condition_multipliers,
        }
    }

    fn of_warm<'a>(&'a mut self, problem: &Problem, warm: &'a WarmStart) -> Start<'a, 6, 1> {
        let multipliers = [&*warm.end_multipliers, &*warm.floor_multipliers];
        self.fill(
            problem,
            &warm.states,
            &warm.inputs_rad,
            &warm.costates,
            &warm.limit_multipliers,
            multipliers,
        )
    }
}

impl Workspace {
    /// Solves a problem with at least one interval into `solution`, except its bound of the touchdown speed.
    pub fn solve(&mut self, problem: &Problem, warm: Option<&WarmStart>, solution: &mut Solution) {
        let start = warm.map(|warm| self.start.of_warm(problem, warm));
        let outcome = self.solver.solve(problem, start.as_ref());
        solution.clear();
        solution.status = match outcome.status {
            Status::Converged => SolveStatus::Converged,
            Status::IterationLimit => SolveStatus::IterationLimit,
            Status::Stalled => SolveStatus::Stalled,
            Status::SubproblemFailed => SolveStatus::SubproblemFailed,
            Status::NotRun | Status::WorkLimit | Status::NotFinite => SolveStatus::BadInput,
        };
        solution.iterations = outcome.iterations;
        solution.qp_iterations = outcome.factorisations;
        if !outcome.cost.is_finite() {
            return;
        }
        solution.cost = outcome.cost;
        solution.merit = outcome.merit;
        solution.kkt_stationarity = outcome.stationarity;
        solution.kkt_feasibility = outcome.feasibility;
        solution.condition_miss = outcome.miss;
        solution.states.extend(self.solver.states().iter().map(|state| PlanarState::from_array(*state)));
        solution.inputs_rad.extend(self.solver.inputs().as_flattened());
        solution.costates.extend(self.solver.costates());
        solution.limit_multipliers.extend(self.solver.limit_multipliers().flatten());
        let mut multipliers = self.solver.condition_multipliers();
        solution.end_multipliers.extend(multipliers.by_ref().take(problem.end_conditions_len()));
        solution.floor_multipliers.extend(multipliers);
    }

    /// For benchmarks: starts from a warm start whose length fits, and raises the barrier until the sweeps are well
    /// scaled.
    pub fn load(&mut self, problem: &Problem, warm: &WarmStart) {
        self.solver.load(problem, &self.start.of_warm(problem, warm));
    }

    /// For benchmarks: dynamics, first and second derivatives of every interval.
    pub fn evaluate_intervals(&mut self, problem: &Problem) {
        self.solver.evaluate_intervals(problem);
    }

    /// For benchmarks: one Newton step at the evaluated intervals: backward and forward sweep; whether the inertia was
    /// right.
    pub fn sweep(&mut self, problem: &Problem) -> bool {
        self.solver.sweep(problem)
    }
}

// The landing problem, as the solver reads it.

/// Bends of the cold guesses' pitch, in amplitudes. Those after the first two are only tried if the first two do not
/// land.
const BENDS: [f64; 4] = [1.0, -1.0, 3.3, -3.3];
const NARROW_BENDS: usize = 2;

impl Problem {
    /// Weights of the deviations from the target at a node.
    #[inline]
    fn node_weights(&self) -> [f64; 6] {
        self.state_weights.map(|weight| weight * self.step_s)
    }
}

impl Model<6, 1> for Problem {
    type Intervals = Blocks;
    type StateCurvature = [f64; 6];
    type InputCurvature = [f64; 1];

    #[inline]
    fn intervals(&self) -> usize {
        self.thrust_n.len()
    }

    #[inline]
    fn initial(&self) -> [f64; 6] {
        self.initial.to_array()
    }

    #[inline]
    fn input_ranges(&self) -> [InputRange; 1] {
        [InputRange { lower: -self.gimbal_limit_rad, upper: self.gimbal_limit_rad, unit: 1.0 }]
    }

    fn append_conditions(&self, conditions: &mut Vec<Condition>) {
        self.append_all_conditions(conditions);
    }

    #[inline]
    fn settings(&self) -> Settings {
        self.solver.settings(NARROW_BENDS, BENDS.len() - NARROW_BENDS)
    }

    /// States on the straight line from the start to the target, the pitch bent by `amplitude sin(m pi k / N)`. The
    /// vehicle tilts one way and then the other, which wastes surplus thrust and ends upright. The path need not be
    /// flyable. Inputs are zero.
    fn guess(&self, index: usize, states: &mut [[f64; 6]], inputs_rad: &mut [[f64; 1]]) {
        let count = self.intervals();
        let amplitude_rad = BENDS[index] * self.solver.guess_amplitude_rad;
        let half_waves = f64::from(self.solver.guess_half_waves);
        let from = self.initial.to_array();
        let to = self.target.to_array();
        for (k, state) in states.iter_mut().enumerate() {
            let share = k as f64 / count as f64;
            *state = from_fn(|i| from[i] + share * (to[i] - from[i]));
            if k > 0 {
                state[2] += amplitude_rad * libm::sin(half_waves * PI * share);
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
        blocks: &mut Blocks,
    ) {
        if derivatives {
            blocks.evaluate::<true>(self, states, inputs_rad, costates);
        } else {
            blocks.evaluate::<false>(self, states, inputs_rad, costates);
        }
    }

    fn next(&self, k: usize, state: &[f64; 6], [gimbal_rad]: &[f64; 1]) -> [f64; 6] {
        rollout::stages(self, k, state, *gimbal_rad).1
    }

    /// Running cost (Eq. 28 of the landing paper).
    fn cost(&self, states: &[[f64; 6]], inputs_rad: &[[f64; 1]]) -> f64 {
        let mut squares = [0.0; 6];
        for state in &states[1..] {
            let deviation = self.deviation(state);
            for (sum, value) in squares.iter_mut().zip(&deviation) {
                *sum += value * value;
            }
        }
        let state_part: f64 = squares.iter().zip(&self.state_weights).map(|(sum, weight)| sum * weight).sum();
        let input_part: f64 = inputs_rad.iter().map(|[input]| input * input).sum();
        0.5 * self.step_s * (state_part + self.input_weight * input_part)
    }

    #[inline]
    fn state_slope(&self, _: usize, state: &[f64; 6]) -> [f64; 6] {
        let (weights, deviation) = (self.node_weights(), self.deviation(state));
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

    fn slope_along(&self, states: &[[f64; 6]], changes: &[[f64; 6]]) -> f64 {
        let mut along = [0.0; 6];
        for (state, change) in states.iter().zip(changes) {
            let deviation = self.deviation(state);
            for i in 0..6 {
                along[i] += deviation[i] * change[i];
            }
        }
        along
            .iter()
            .zip(&self.state_weights)
            .fold(0.0, |slope, (sum, weight)| slope + self.step_s * weight * sum)
    }
}
