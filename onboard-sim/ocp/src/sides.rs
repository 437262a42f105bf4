//! The side of every limit and condition, and the parts of a Newton step that treats them as
//! equations.

use alloc::vec::Vec;

use crate::barrier::{Elastic, LAST_BARRIER, Limits};
use crate::intervals::{Curvature, Intervals};
use crate::iterate::{Residual, larger, push_nodes};
use crate::model::{InputRange, Model};
use crate::solver::Workspace;

/// Second derivative by an input on its limit.
const PINNED: f64 = 1e200;

/// Largest slack of an input on its limit, in the input's unit, and smallest multiplier of an input
/// off its limit: negligible, but above zero for the barrier.
const HAIR: f64 = 1e-11;
const NO_MULTIPLIER: f64 = 1e-9;

/// The side of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Free,
    Lower,
    Upper,
}

impl Place {
    /// The side and the value of an input that a step moves to `moved`.
    pub(crate) fn moved(self, moved: f64, range: &InputRange) -> (f64, Self) {
        match self {
            Self::Upper => (range.upper, Self::Upper),
            Self::Lower => (range.lower, Self::Lower),
            Self::Free if moved > range.upper => (range.upper, Self::Upper),
            Self::Free if moved < range.lower => (range.lower, Self::Lower),
            Self::Free => (moved, Self::Free),
        }
    }
}

/// The side of a condition's multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// At its smallest value: the condition holds with a margin, or it is an equality broken above.
    Least,
    /// Within its range; the condition holds as an equation.
    Held,
    /// At its penalty: the condition is broken below.
    Penalty,
}

/// The side of every limit and condition.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sides<const NU: usize> {
    pub(crate) places: Vec<[Place; NU]>,
    pub(crate) roles: Vec<Role>,
    pub(crate) multipliers: Vec<f64>,
}

impl<const NU: usize> Sides<NU> {
    /// Makes room for a problem; allocates only if no earlier problem was this long.
    pub(crate) fn resize(&mut self, intervals: usize, conditions: usize) {
        self.places.resize(intervals, [Place::Free; NU]);
        self.roles.resize(conditions, Role::Held);
        self.multipliers.resize(conditions, 0.0);
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// The sides that the slacks and multipliers of `current` show.
    pub(crate) fn take_sides(&mut self, model: &M) {
        let (current, sides, ranges) = (&mut self.current, &mut self.sides, model.input_ranges());
        for (k, places) in sides.places.iter_mut().enumerate() {
            for i in 0..NU {
                let (input, limits) = (current.inputs[k][i], &current.limits[k][i]);
                places[i] = if limits.upper > ranges[i].above(input) {
                    Place::Upper
                } else if limits.lower > ranges[i].below(input) {
                    Place::Lower
                } else {
                    Place::Free
                };
            }
        }
        let penalty = model.settings().penalty;
        for (index, condition) in self.conditions.iter().enumerate() {
            let elastic = &current.elastics[index];
            let value = condition.value(&current.states);
            let (a, b) = elastic.room();
            let (least, most) = condition.range(penalty);
            let (role, multiplier) = if a < value {
                (Role::Least, least)
            } else if b < -value {
                (Role::Penalty, most)
            } else {
                (Role::Held, elastic.multiplier())
            };
            (sides.roles[index], sides.multipliers[index]) = (role, multiplier);
        }
    }

    /// Releases the inputs that pull away from their limits. Returns whether there was none, and
    /// the largest residual of the optimality conditions for the sides.
    pub(crate) fn update_roles(&mut self, model: &M) -> (bool, f64) {
        let (current, sides) = (&self.current, &mut self.sides);
        let count = current.inputs.len();
        let penalty = model.settings().penalty;
        let mut settled = true;
        let mut worst = 0.0_f64;
        push_nodes(model, current, &mut self.scratch);
        for (index, condition) in self.conditions.iter().enumerate() {
            self.scratch[condition.node][condition.component] -= condition.sign * sides.multipliers[index];
            let value = condition.value(&current.states);
            let (least, most) = condition.range(penalty);
            let role = &mut sides.roles[index];
            match *role {
                Role::Held => worst = larger(worst, value.abs() * (most - least)),
                Role::Least if value < 0.0 => (*role, settled) = (Role::Held, false),
                Role::Penalty if value > 0.0 => (*role, settled) = (Role::Held, false),
                Role::Least | Role::Penalty => {}
            }
        }
        let mut worsts = [worst; NX];
        let mut sum = 0.0;
        for (k, push) in self.scratch.iter().enumerate().take(count) {
            let gaps = current.defect(k);
            for i in 0..NX {
                worsts[i] = larger(worsts[i], gaps[i].abs());
                sum += gaps[i];
            }
            let (before, pulled) = current.intervals.pulled(k, &current.costates[k + 1]);
            let own = model.input_slope(k, &current.inputs[k]);
            for (i, place) in sides.places[k].iter_mut().enumerate() {
                let slope = own[i] + pulled[i];
                match *place {
                    Place::Free => worsts[0] = larger(worsts[0], slope.abs()),
                    Place::Upper if slope > 0.0 => (*place, settled) = (Place::Free, false),
                    Place::Lower if slope < 0.0 => (*place, settled) = (Place::Free, false),
                    Place::Upper | Place::Lower => {}
                }
            }
            if k > 0 {
                for i in 0..NX {
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
    pub(crate) fn assemble_sides(&mut self, model: &M, stiffness: f64) {
        let (current, sides, sweep) = (&self.current, &self.sides, &mut self.newton.sweep);
        let ranges = model.input_ranges();
        sweep.set_cost(model, current);
        for (k, input) in current.inputs.iter().enumerate() {
            let (curvature, slope) = &mut sweep.input_terms[k];
            for i in 0..NU {
                slope[i] = match sides.places[k][i] {
                    Place::Free => continue,
                    Place::Lower => PINNED * ranges[i].below(input[i]),
                    Place::Upper => PINNED * (input[i] - ranges[i].upper),
                };
                curvature.add_to_diagonal(i, PINNED);
            }
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            let mut push = sides.multipliers[index];
            if sides.roles[index] == Role::Held {
                sweep.curvatures[condition.node].add_to_diagonal(condition.component, stiffness);
                push -= stiffness * condition.value(&current.states);
            }
            sweep.slopes[condition.node][condition.component] -= condition.sign * push;
        }
    }

    /// Takes the full step; returns whether a limit or condition changed sides.
    pub(crate) fn step_sides(&mut self, model: &M, stiffness: f64) -> bool {
        let ranges = model.input_ranges();
        let penalty = model.settings().penalty;
        let (current, sides, sweep) = (&mut self.current, &mut self.sides, &self.newton.sweep);
        let mut changed = false;
        for (state, step) in current.states.iter_mut().zip(&sweep.states) {
            for i in 0..NX {
                state[i] += step[i];
            }
        }
        current.costates.copy_from_slice(&sweep.costates);
        for (k, input) in current.inputs.iter_mut().enumerate() {
            for (i, place) in sides.places[k].iter_mut().enumerate() {
                let before = *place;
                (input[i], *place) = before.moved(input[i] + sweep.inputs[k][i], &ranges[i]);
                changed |= *place != before;
            }
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            if sides.roles[index] != Role::Held {
                continue;
            }
            let (least, most) = condition.range(penalty);
            let moved = sides.multipliers[index] - stiffness * condition.value(&current.states);
            (sides.roles[index], sides.multipliers[index]) = if moved < least {
                (Role::Least, least)
            } else if moved > most {
                (Role::Penalty, most)
            } else {
                (Role::Held, moved)
            };
            changed |= sides.roles[index] != Role::Held;
        }
        changed
    }

    /// Gives limits and conditions the slacks and multipliers of the barrier method; returns the
    /// residual with them.
    pub(crate) fn settle(&mut self, model: &M) -> Residual {
        let ranges = model.input_ranges();
        let penalty = model.settings().penalty;
        let (current, sides) = (&mut self.current, &self.sides);
        for (k, places) in sides.places.iter().enumerate() {
            let inputs = &mut current.inputs[k];
            let own = model.input_slope(k, inputs);
            let (_, pulled) = current.intervals.pulled(k, &current.costates[k + 1]);
            for i in 0..NU {
                let (input, range) = (&mut inputs[i], &ranges[i]);
                let active = (own[i] + pulled[i]).abs().max(NO_MULTIPLIER);
                let hair = (LAST_BARRIER / active).min(HAIR * range.unit);
                let off = |slack: f64| (LAST_BARRIER / slack).min(NO_MULTIPLIER);
                current.limits[k][i] = match places[i] {
                    Place::Free => {
                        Limits { lower: off(range.below(*input)), upper: off(range.above(*input)) }
                    }
                    Place::Lower => {
                        *input = range.lower + hair;
                        Limits { lower: active, upper: NO_MULTIPLIER }
                    }
                    Place::Upper => {
                        *input = range.upper - hair;
                        Limits { lower: NO_MULTIPLIER, upper: active }
                    }
                };
            }
        }
        for (index, condition) in self.conditions.iter().enumerate() {
            let value = condition.value(&current.states);
            let multiplier = sides.multipliers[index];
            current.elastics[index] =
                Elastic::settled(value, multiplier, condition.equality, penalty, LAST_BARRIER);
        }
        self.residual(model)
    }
}
