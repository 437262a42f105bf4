//! The landing problem, as the solver reads it.

use alloc::vec::Vec;
use core::array::from_fn;
use core::f64::consts::PI;

use stages::{Condition, InputRange, Model, Settings};

use crate::Problem;
use crate::intervals::Blocks;
use crate::rollout;

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
