//! The landing in space, as the solver reads it.

use alloc::vec::Vec;
use core::array::from_fn;
use core::f64::consts::TAU;

use stages::{Condition, DenseIntervals, InputRange, Model, Settings};

use super::{INPUTS, STATES, SpaceProblem, State, interval};

/// Opening of the fins that costs nothing: with it they can brake more or less than planned.
const HALF_OPEN: f64 = 0.5;

/// Conditions of a node in the box, of the end's vertical velocity, and of a node's lean.
const BOX: usize = 12;
const END: usize = 2;
const LEAN: usize = 4;

/// Turns of the cold guesses' lean: once around, once the other way. Upright is only tried if neither lands.
const TURNS: [f64; 3] = [1.0, -1.0, 0.0];
const TURNING: usize = 2;

/// Writes the conditions' multipliers of the last `kept` of a solution's `intervals`; see `append_conditions` for their
/// order.
pub fn last_multipliers(
    all: &[f64],
    settled_nodes: usize,
    intervals: usize,
    kept: usize,
    into: &mut Vec<f64>,
) {
    let gone = intervals - kept;
    let lean = BOX * settled_nodes + END;
    let floor = lean + LEAN * (intervals - 1);
    into.clear();
    into.extend_from_slice(&all[..lean]);
    into.extend_from_slice(&all[lean + LEAN * gone..floor]);
    into.extend_from_slice(&all[floor + gone..]);
}

impl SpaceProblem {
    fn state_weights(&self) -> State {
        let Self { weights, step_s, .. } = self;
        let [place, lean, rate] = [weights.place, weights.lean, weights.rate].map(|weight| weight * step_s);
        [place, place, 0.0, 0.0, 0.0, 0.0, lean, lean, rate, rate]
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

impl Model<STATES, INPUTS> for SpaceProblem {
    type Intervals = DenseIntervals<STATES, INPUTS>;
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
        self.solver.settings(TURNING, TURNS.len() - TURNING)
    }

    /// Positions and velocities on the straight line to rest at the target, and a lean of one size that turns around.
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
            interval::pulled(into, costate);
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
