//! The landing problem with one of its cold guesses alone, as a public solver gets it.

use ocp::{Condition, InputRange, Model, Settings};
use paper::plane::Problem;

/// A problem whose cold solve starts from its guess `index` only.
pub(crate) struct OneGuess<'a> {
    pub(crate) problem: &'a Problem,
    pub(crate) index: usize,
}

/// What a model has in common with its field `problem`, but for one guess alone.
macro_rules! as_in_the_problem {
    () => {
        type StateCurvature = <Problem as Model<6, 1>>::StateCurvature;
        type InputCurvature = <Problem as Model<6, 1>>::InputCurvature;

        #[inline]
        fn intervals(&self) -> usize {
            self.problem.intervals()
        }

        #[inline]
        fn initial(&self) -> [f64; 6] {
            self.problem.initial()
        }

        #[inline]
        fn input_ranges(&self) -> [InputRange; 1] {
            self.problem.input_ranges()
        }

        fn append_conditions(&self, conditions: &mut Vec<Condition>) {
            self.problem.append_conditions(conditions);
        }

        #[inline]
        fn settings(&self) -> Settings {
            Settings { guesses: 1, spare_guesses: 0, ..self.problem.settings() }
        }

        fn cost(&self, states: &[[f64; 6]], inputs_rad: &[[f64; 1]]) -> f64 {
            self.problem.cost(states, inputs_rad)
        }

        #[inline]
        fn state_slope(&self, node: usize, state: &[f64; 6]) -> [f64; 6] {
            self.problem.state_slope(node, state)
        }

        #[inline]
        fn state_curvature(&self, node: usize, state: &[f64; 6]) -> Self::StateCurvature {
            self.problem.state_curvature(node, state)
        }

        #[inline]
        fn input_slope(&self, k: usize, input_rad: &[f64; 1]) -> [f64; 1] {
            self.problem.input_slope(k, input_rad)
        }

        #[inline]
        fn input_curvature(&self, k: usize, input_rad: &[f64; 1]) -> Self::InputCurvature {
            self.problem.input_curvature(k, input_rad)
        }
    };
}
pub(crate) use as_in_the_problem;

impl Model<6, 1> for OneGuess<'_> {
    type Intervals = <Problem as Model<6, 1>>::Intervals;

    as_in_the_problem!();

    fn guess(&self, _: usize, states: &mut [[f64; 6]], inputs_rad: &mut [[f64; 1]]) {
        self.problem.guess(self.index, states, inputs_rad);
    }

    fn evaluate(
        &self,
        states: &[[f64; 6]],
        inputs_rad: &[[f64; 1]],
        costates: &[[f64; 6]],
        derivatives: bool,
        intervals: &mut Self::Intervals,
    ) {
        self.problem.evaluate(states, inputs_rad, costates, derivatives, intervals);
    }

    fn next(&self, k: usize, state: &[f64; 6], input_rad: &[f64; 1]) -> [f64; 6] {
        self.problem.next(k, state, input_rad)
    }
}
