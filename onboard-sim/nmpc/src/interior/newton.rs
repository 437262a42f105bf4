//! The Newton system of the barrier problem at an iterate: its assembly, its solution, and the step to a trial point.

use alloc::vec::Vec;

use super::barrier::{ElasticStep, Limits};
use super::iterate::Iterate;
use super::riccati::Sweep;
use crate::Problem;
use crate::problem::Condition;

/// A Newton step.
#[derive(Debug, Clone, Default)]
pub(super) struct Newton {
    pub(super) sweep: Sweep,
    limits: Vec<Limits>,
    elastics: Vec<ElasticStep>,
}

/// The longest fractions of a step that keep slacks and multipliers positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fractions {
    pub(super) primal: f64,
    pub(super) dual: f64,
}

impl Newton {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(super) fn resize(&mut self, intervals: usize, conditions: usize) {
        self.sweep.resize(intervals);
        self.limits.resize(intervals, Limits::default());
        self.elastics.resize(conditions, ElasticStep::default());
    }

    /// Sets the system up at an iterate.
    pub(super) fn assemble(
        &mut self,
        problem: &Problem,
        conditions: &[Condition],
        iterate: &Iterate,
        barrier: f64,
    ) {
        let limit = problem.gimbal_limit_rad;
        let weights = problem.state_weights.map(|weight| weight * problem.step_s);
        let input_weight = problem.input_weight * problem.step_s;
        let sweep = &mut self.sweep;
        for (k, state) in iterate.states.iter().enumerate() {
            let deviation = problem.deviation(state);
            sweep.weights[k] = weights;
            sweep.slopes[k] = core::array::from_fn(|i| weights[i] * deviation[i]);
        }
        for (k, input) in iterate.inputs_rad.iter().enumerate() {
            let (curvature, slope) = iterate.limits[k].terms(*input, limit, barrier);
            sweep.input_terms[k] = (input_weight + curvature, input_weight * input + slope);
        }
        for (condition, elastic) in conditions.iter().zip(&iterate.elastics) {
            let (softness, change) = elastic.terms(barrier);
            let multiplier = elastic.multiplier() + change;
            sweep.weights[condition.node][condition.component] += 1.0 / softness;
            sweep.slopes[condition.node][condition.component] -= condition.sign * multiplier;
        }
    }

    /// Factorises with a fraction of the dynamics' curvature; returns whether the inertia is right.
    pub(super) fn factorise(&mut self, problem: &Problem, iterate: &Iterate, share: f64) -> bool {
        self.sweep.backward(iterate, problem.step_s, share)
    }

    /// Solves for the step of every variable.
    pub(super) fn solve(
        &mut self,
        problem: &Problem,
        conditions: &[Condition],
        iterate: &Iterate,
        barrier: f64,
    ) {
        let limit = problem.gimbal_limit_rad;
        self.sweep.forward(iterate, problem.step_s);
        for (k, step) in self.limits.iter_mut().enumerate() {
            *step = iterate.limits[k].step(iterate.inputs_rad[k], limit, barrier, self.sweep.inputs[k]);
        }
        for (index, condition) in conditions.iter().enumerate() {
            let elastic = &iterate.elastics[index];
            let (softness, unmoved) = elastic.terms(barrier);
            let moved = condition.sign * self.sweep.states[condition.node][condition.component];
            let change = unmoved - moved / softness;
            self.elastics[index] = elastic.step(barrier, change);
        }
    }

    /// The longest fractions of the step that leave `keep` of every slack and multiplier.
    pub(super) fn fractions(&self, problem: &Problem, iterate: &Iterate, keep: f64) -> Fractions {
        let limit = problem.gimbal_limit_rad;
        let reach = 1.0 - keep;
        let shorten = |fraction: &mut f64, value: f64, step: f64| {
            if -step * *fraction > reach * value {
                *fraction = reach * value / -step;
            }
        };
        let (mut primal, mut dual) = (1.0, 1.0);
        for (k, input) in iterate.inputs_rad.iter().enumerate() {
            let step = self.sweep.inputs[k];
            shorten(&mut primal, limit + input, step);
            shorten(&mut primal, limit - input, -step);
            shorten(&mut dual, iterate.limits[k].lower, self.limits[k].lower);
            shorten(&mut dual, iterate.limits[k].upper, self.limits[k].upper);
        }
        for (elastic, step) in iterate.elastics.iter().zip(&self.elastics) {
            shorten(&mut primal, elastic.above, step.above);
            shorten(&mut primal, elastic.below, step.below);
            let (a, b) = elastic.room();
            shorten(&mut dual, a, step.multiplier);
            shorten(&mut dual, b, -step.multiplier);
        }
        Fractions { primal, dual }
    }

    /// Slope of the barrier objective along the step.
    pub(super) fn slope(&self, problem: &Problem, iterate: &Iterate, barrier: f64) -> f64 {
        let limit = problem.gimbal_limit_rad;
        let price = problem.solver.terminal_penalty;
        let mut slope = 0.0;
        let mut along = [0.0; 6];
        for (state, step) in iterate.states.iter().zip(&self.sweep.states) {
            let deviation = problem.deviation(state);
            for i in 0..6 {
                along[i] += deviation[i] * step[i];
            }
        }
        for (sum, weight) in along.iter().zip(&problem.state_weights) {
            slope += problem.step_s * weight * sum;
        }
        let input_weight = problem.step_s * problem.input_weight;
        for (input, step) in iterate.inputs_rad.iter().zip(&self.sweep.inputs) {
            slope +=
                (input_weight * input + barrier * (1.0 / (limit - input) - 1.0 / (limit + input))) * step;
        }
        for (elastic, step) in iterate.elastics.iter().zip(&self.elastics) {
            slope += price * elastic.broken_by(step)
                - barrier * (step.above / elastic.above + step.below / elastic.below);
        }
        slope
    }

    /// The largest change of an input, rad.
    pub(super) fn largest_input_step(&self) -> f64 {
        self.sweep.inputs.iter().fold(0.0, |largest, step| largest.max(step.abs()))
    }

    /// Writes the point at the fractions of the step into `trial`; its blocks are not evaluated.
    pub(super) fn take(
        &self,
        conditions: &[Condition],
        iterate: &Iterate,
        fractions: Fractions,
        trial: &mut Iterate,
    ) {
        let Fractions { primal, dual } = fractions;
        for (k, step) in self.sweep.states.iter().enumerate() {
            let (from, to) = (&iterate.states[k], &mut trial.states[k]);
            for i in 0..6 {
                to[i] = from[i] + primal * step[i];
            }
        }
        for (k, target) in self.sweep.costates.iter().enumerate() {
            let (from, to) = (&iterate.costates[k], &mut trial.costates[k]);
            for i in 0..6 {
                to[i] = from[i] + primal * (target[i] - from[i]);
            }
        }
        for (k, step) in self.sweep.inputs.iter().enumerate() {
            trial.inputs_rad[k] = iterate.inputs_rad[k] + primal * step;
            trial.limits[k] = Limits {
                lower: iterate.limits[k].lower + dual * self.limits[k].lower,
                upper: iterate.limits[k].upper + dual * self.limits[k].upper,
            };
        }
        for (index, step) in self.elastics.iter().enumerate() {
            let value = conditions[index].value(&trial.states);
            trial.elastics[index] = iterate.elastics[index].moved(step, primal, dual, value);
        }
    }
}
