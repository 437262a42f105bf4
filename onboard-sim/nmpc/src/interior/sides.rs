//! The side of every limit and condition, and the parts of a Newton step that treats them as equations.

use alloc::vec::Vec;

use super::Workspace;
use super::barrier::{Elastic, LAST_BARRIER, Limits};
use super::lanes::LANES;
use super::residual::{Residual, larger};
use crate::Problem;
use crate::problem::Condition;

/// Second derivative by an input on its limit.
const PINNED: f64 = 1e200;

/// Largest slack of an input on its limit, rad, and smallest multiplier of an input off its limit: negligible, but
/// above zero for the barrier.
const HAIR: f64 = 1e-11;
const NO_MULTIPLIER: f64 = 1e-9;

/// The side of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Free,
    Lower,
    Upper,
}

impl Place {
    /// The side and the value of an input that a step moves to `moved`.
    pub(super) fn moved(self, moved: f64, limit: f64) -> (f64, Self) {
        match self {
            Self::Upper => (limit, Self::Upper),
            Self::Lower => (-limit, Self::Lower),
            Self::Free if moved > limit => (limit, Self::Upper),
            Self::Free if moved < -limit => (-limit, Self::Lower),
            Self::Free => (moved, Self::Free),
        }
    }
}

/// The side of a condition's multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// At its smallest value: the condition holds with a margin, or it is an equality broken above.
    Least,
    /// Within its range; the condition holds as an equation.
    Held,
    /// At its price: the condition is broken below.
    Price,
}

/// The side of every limit and condition.
#[derive(Debug, Clone, Default)]
pub(super) struct Sides {
    pub(super) places: Vec<Place>,
    pub(super) roles: Vec<Role>,
    pub(super) multipliers: Vec<f64>,
}

impl Sides {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(super) fn resize(&mut self, intervals: usize, conditions: usize) {
        self.places.resize(intervals, Place::Free);
        self.roles.resize(conditions, Role::Held);
        self.multipliers.resize(conditions, 0.0);
    }
}

/// The range of a condition's multiplier.
pub(super) fn range(condition: &Condition, price: f64) -> (f64, f64) {
    (if condition.equality { -price } else { 0.0 }, price)
}

impl Workspace {
    /// The sides that the slacks and multipliers of `current` show.
    pub(super) fn take_sides(&mut self, problem: &Problem) {
        let (current, sides, limit) = (&mut self.current, &mut self.sides, problem.gimbal_limit_rad);
        for ((place, input), limits) in sides.places.iter_mut().zip(&current.inputs_rad).zip(&current.limits)
        {
            *place = if limits.upper > limit - input {
                Place::Upper
            } else if limits.lower > limit + input {
                Place::Lower
            } else {
                Place::Free
            };
        }
        let price = problem.solver.terminal_penalty;
        for (index, condition) in self.conditions.iter().enumerate() {
            let elastic = &current.elastics[index];
            let value = condition.value(&current.states);
            let (a, b) = elastic.room();
            let (least, most) = range(condition, price);
            let (role, multiplier) = if a < value {
                (Role::Least, least)
            } else if b < -value {
                (Role::Price, most)
            } else {
                (Role::Held, elastic.multiplier())
            };
            (sides.roles[index], sides.multipliers[index]) = (role, multiplier);
        }
    }

    /// Releases the inputs that pull away from their limits. Returns whether there was none, and the largest residual
    /// of the optimality conditions for the sides.
    pub(super) fn look(&mut self, problem: &Problem) -> (bool, f64) {
        let (current, sides) = (&self.current, &mut self.sides);
        let count = current.inputs_rad.len();
        let weights = problem.state_weights.map(|weight| weight * problem.step_s);
        let input_weight = problem.input_weight * problem.step_s;
        let price = problem.solver.terminal_penalty;
        let mut settled = true;
        let mut worst = 0.0_f64;
        for (push, (state, costate)) in
            self.scratch.iter_mut().zip(current.states.iter().zip(&current.costates))
        {
            let deviation = problem.deviation(state);
            *push = core::array::from_fn(|i| weights[i] * deviation[i] - costate[i]);
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            self.scratch[condition.node][condition.component] -= condition.sign * sides.multipliers[index];
            let value = condition.value(&current.states);
            let (least, most) = range(condition, price);
            let role = &mut sides.roles[index];
            match *role {
                Role::Held => worst = larger(worst, value.abs() * (most - least)),
                Role::Least if value < 0.0 => (*role, settled) = (Role::Held, false),
                Role::Price if value > 0.0 => (*role, settled) = (Role::Held, false),
                Role::Least | Role::Price => {}
            }
        }
        let mut worsts = [worst; 6];
        let mut sum = 0.0;
        for (k, push) in self.scratch.iter().enumerate().take(count) {
            let (block, lane) = (&current.blocks[k / LANES], k % LANES);
            let gaps = current.defect(k);
            for i in 0..6 {
                worsts[i] = larger(worsts[i], gaps[i].abs());
                sum += gaps[i];
            }
            let pulled = |j: usize| block.pulled[j].0[lane];
            let slope = input_weight * current.inputs_rad[k] + pulled(4);
            let place = &mut sides.places[k];
            match *place {
                Place::Free => worsts[0] = larger(worsts[0], slope.abs()),
                Place::Upper if slope > 0.0 => (*place, settled) = (Place::Free, false),
                Place::Lower if slope < 0.0 => (*place, settled) = (Place::Free, false),
                Place::Upper | Place::Lower => {}
            }
            if k > 0 {
                let later = &current.costates[k + 1];
                let before = [later[0], later[1], pulled(0), pulled(1), pulled(2), pulled(3)];
                for i in 0..6 {
                    worsts[i] = larger(worsts[i], (push[i] + before[i]).abs());
                }
            }
        }
        for (i, push) in self.scratch[count].iter().enumerate() {
            worsts[i] = larger(worsts[i], push.abs());
        }
        // Comparisons ignore NaN; a sum does not.
        let worst = if sum.is_finite() { worsts.into_iter().fold(0.0, larger) } else { f64::INFINITY };
        (settled, worst)
    }

    /// Sets up the Newton system for the sides.
    pub(super) fn assemble_sides(&mut self, problem: &Problem, stiffness: f64) {
        let (current, sides, sweep) = (&self.current, &self.sides, &mut self.newton.sweep);
        let limit = problem.gimbal_limit_rad;
        let weights = problem.state_weights.map(|weight| weight * problem.step_s);
        let input_weight = problem.input_weight * problem.step_s;
        for (k, state) in current.states.iter().enumerate() {
            let deviation = problem.deviation(state);
            sweep.weights[k] = weights;
            sweep.slopes[k] = core::array::from_fn(|i| weights[i] * deviation[i]);
        }
        for (k, input) in current.inputs_rad.iter().enumerate() {
            sweep.input_terms[k] = match sides.places[k] {
                Place::Free => (input_weight, input_weight * input),
                Place::Lower => (PINNED, PINNED * (limit + input)),
                Place::Upper => (PINNED, PINNED * (input - limit)),
            };
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            let mut push = sides.multipliers[index];
            if sides.roles[index] == Role::Held {
                sweep.weights[condition.node][condition.component] += stiffness;
                push -= stiffness * condition.value(&current.states);
            }
            sweep.slopes[condition.node][condition.component] -= condition.sign * push;
        }
    }

    /// Takes the whole step; returns whether a limit or condition changed sides.
    pub(super) fn step_sides(&mut self, problem: &Problem, stiffness: f64) -> bool {
        let limit = problem.gimbal_limit_rad;
        let price = problem.solver.terminal_penalty;
        let (current, sides, sweep) = (&mut self.current, &mut self.sides, &self.newton.sweep);
        let mut changed = false;
        for (state, step) in current.states.iter_mut().zip(&sweep.states) {
            for i in 0..6 {
                state[i] += step[i];
            }
        }
        current.costates.copy_from_slice(&sweep.costates);
        for ((input, step), place) in current.inputs_rad.iter_mut().zip(&sweep.inputs).zip(&mut sides.places)
        {
            let before = *place;
            (*input, *place) = before.moved(*input + step, limit);
            changed |= *place != before;
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            if sides.roles[index] != Role::Held {
                continue;
            }
            let (least, most) = range(condition, price);
            let moved = sides.multipliers[index] - stiffness * condition.value(&current.states);
            (sides.roles[index], sides.multipliers[index]) = if moved < least {
                (Role::Least, least)
            } else if moved > most {
                (Role::Price, most)
            } else {
                (Role::Held, moved)
            };
            changed |= sides.roles[index] != Role::Held;
        }
        changed
    }

    /// Gives limits and conditions the slacks and multipliers of the barrier method; returns the residual with them.
    pub(super) fn settle(&mut self, problem: &Problem) -> Residual {
        let limit = problem.gimbal_limit_rad;
        let price = problem.solver.terminal_penalty;
        let input_weight = problem.input_weight * problem.step_s;
        let (current, sides) = (&mut self.current, &self.sides);
        for (k, place) in sides.places.iter().enumerate() {
            let input = &mut current.inputs_rad[k];
            let slope = input_weight * *input + current.blocks[k / LANES].pulled[4].0[k % LANES];
            let active = slope.abs().max(NO_MULTIPLIER);
            let hair = (LAST_BARRIER / active).min(HAIR);
            let off = |slack: f64| (LAST_BARRIER / slack).min(NO_MULTIPLIER);
            current.limits[k] = match place {
                Place::Free => Limits { lower: off(limit + *input), upper: off(limit - *input) },
                Place::Lower => {
                    *input = hair - limit;
                    Limits { lower: active, upper: NO_MULTIPLIER }
                }
                Place::Upper => {
                    *input = limit - hair;
                    Limits { lower: NO_MULTIPLIER, upper: active }
                }
            };
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            let value = condition.value(&current.states);
            let multiplier = sides.multipliers[index];
            current.elastics[index] =
                Elastic::settled(value, multiplier, condition.equality, price, LAST_BARRIER);
        }
        self.residual(problem)
    }
}
