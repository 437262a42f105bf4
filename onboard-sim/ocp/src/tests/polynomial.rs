//! Test problems: dynamics that are polynomials of second degree, integrated by Euler steps, and
//! quadratic costs.

use core::array::from_fn;

use crate::{Condition, Dense, DenseIntervals, Hessian, InputRange, Model, Settings};

/// A term of a rate: `factor z_a z_b`, where `z` is the state, then the input, then a 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub(super) row: usize,
    pub(super) factor: f64,
    pub(super) of: [usize; 2],
}

#[derive(Debug, Clone)]
pub(super) struct Polynomial<const NX: usize, const NU: usize> {
    pub(super) intervals: usize,
    pub(super) initial: [f64; NX],
    pub(super) target: [f64; NX],
    pub(super) step_s: f64,
    pub(super) rates: Vec<Term>,
    /// Second derivatives of the cost by every state but the last, by the last, and by every input.
    pub(super) path_weights: [[f64; NX]; NX],
    pub(super) end_weights: [[f64; NX]; NX],
    pub(super) input_weights: [[f64; NU]; NU],
    pub(super) ranges: [InputRange; NU],
    pub(super) conditions: Vec<Condition>,
    pub(super) penalty: f64,
}

impl<const NX: usize, const NU: usize> Polynomial<NX, NU> {
    /// The index of the 1 among the factors.
    pub(super) const ONE: usize = NX + NU;

    pub(super) fn weights(&self, node: usize) -> &[[f64; NX]; NX] {
        if node == self.intervals { &self.end_weights } else { &self.path_weights }
    }

    /// `F` and its derivatives by the state and by the input.
    pub(super) fn step(
        &self,
        state: &[f64; NX],
        input: &[f64; NU],
    ) -> ([f64; NX], [[f64; NX]; NX], [[f64; NU]; NX]) {
        let z = |i: usize| if i < NX { state[i] } else { *input.get(i - NX).unwrap_or(&1.0) };
        let mut end = *state;
        let mut a = unit_matrix();
        let mut b = [[0.0; NU]; NX];
        for Term { row, factor, of: [one, other] } in &self.rates {
            let factor = self.step_s * factor;
            end[*row] += factor * z(*one) * z(*other);
            for (by, rest) in [(*one, *other), (*other, *one)] {
                if by < NX {
                    a[*row][by] += factor * z(rest);
                } else if by < Self::ONE {
                    b[*row][by - NX] += factor * z(rest);
                }
            }
        }
        (end, a, b)
    }

    /// Second derivative of `lambda' F`.
    fn curvature(&self, lambda: &[f64; NX]) -> Hessian<NX, NU> {
        let mut sum = Hessian { xx: [[0.0; NX]; NX], ux: [[0.0; NX]; NU], uu: [[0.0; NU]; NU] };
        for Term { row, factor, of: [one, other] } in &self.rates {
            let value = self.step_s * factor * lambda[*row];
            for (i, j) in [(*one, *other), (*other, *one)] {
                match (i.checked_sub(NX), j.checked_sub(NX)) {
                    (None, None) => sum.xx[i][j] += value,
                    (Some(i), None) if i < NU => sum.ux[i][j] += value,
                    (Some(i), Some(j)) if i < NU && j < NU => sum.uu[i][j] += value,
                    _ => {}
                }
            }
        }
        sum
    }
}

impl<const NX: usize, const NU: usize> Model<NX, NU> for Polynomial<NX, NU> {
    type Intervals = DenseIntervals<NX, NU>;
    type StateCurvature = [[f64; NX]; NX];
    type InputCurvature = [[f64; NU]; NU];

    fn intervals(&self) -> usize {
        self.intervals
    }

    fn initial(&self) -> [f64; NX] {
        self.initial
    }

    fn input_ranges(&self) -> [InputRange; NU] {
        self.ranges
    }

    fn append_conditions(&self, conditions: &mut Vec<Condition>) {
        conditions.extend(&self.conditions);
    }

    fn settings(&self) -> Settings {
        Settings {
            max_iterations: 200,
            tolerance: 1e-7,
            penalty: self.penalty,
            first_barrier: self.penalty,
            guesses: 1,
            spare_guesses: 0,
            acceptable_miss: 1e-6,
        }
    }

    fn guess(&self, _: usize, states: &mut [[f64; NX]], inputs: &mut [[f64; NU]]) {
        states.fill(self.initial);
        inputs.fill(self.ranges.map(|range| 0.5 * (range.lower + range.upper)));
    }

    fn evaluate(
        &self,
        states: &[[f64; NX]],
        inputs: &[[f64; NU]],
        costates: &[[f64; NX]],
        derivatives: bool,
        intervals: &mut DenseIntervals<NX, NU>,
    ) {
        for (k, interval) in intervals.0.iter_mut().enumerate() {
            let lambda = &costates[k + 1];
            let (end, a, b) = self.step(&states[k], &inputs[k]);
            let pulled_x = from_fn(|j| (0..NX).map(|i| a[i][j] * lambda[i]).sum());
            let pulled_u = from_fn(|j| (0..NX).map(|i| b[i][j] * lambda[i]).sum());
            *interval = if derivatives {
                Dense { end, pulled_x, pulled_u, a, b, curvature: self.curvature(lambda) }
            } else {
                Dense { end, pulled_x, pulled_u, ..*interval }
            };
        }
    }

    fn next(&self, _: usize, state: &[f64; NX], input: &[f64; NU]) -> [f64; NX] {
        self.step(state, input).0
    }

    fn cost(&self, states: &[[f64; NX]], inputs: &[[f64; NU]]) -> f64 {
        let of_states: f64 = states
            .iter()
            .enumerate()
            .map(|(node, state)| dot(&self.state_slope(node, state), &from_fn(|i| state[i] - self.target[i])))
            .sum();
        let of_inputs: f64 =
            inputs.iter().enumerate().map(|(k, input)| dot(&self.input_slope(k, input), input)).sum();
        0.5 * (of_states + of_inputs)
    }

    fn state_slope(&self, node: usize, state: &[f64; NX]) -> [f64; NX] {
        let deviation = from_fn(|i| state[i] - self.target[i]);
        self.weights(node).map(|row| dot(&row, &deviation))
    }

    fn state_curvature(&self, node: usize, _: &[f64; NX]) -> [[f64; NX]; NX] {
        *self.weights(node)
    }

    fn input_slope(&self, _: usize, input: &[f64; NU]) -> [f64; NU] {
        self.input_weights.map(|row| dot(&row, input))
    }

    fn input_curvature(&self, _: usize, _: &[f64; NU]) -> [[f64; NU]; NU] {
        self.input_weights
    }
}

pub(super) fn dot<const N: usize>(one: &[f64; N], other: &[f64; N]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// The identity.
pub(super) fn unit_matrix<const N: usize>() -> [[f64; N]; N] {
    diagonal(&[1.0; N])
}

pub(super) fn diagonal<const N: usize>(values: &[f64; N]) -> [[f64; N]; N] {
    from_fn(|i| from_fn(|j| if i == j { values[i] } else { 0.0 }))
}

/// A range on both sides of zero.
pub(super) fn within(limit: f64) -> InputRange {
    InputRange { lower: -limit, upper: limit, unit: limit.min(1.0) }
}

/// A condition that a component is a value at a node.
pub(super) fn equals(node: usize, component: usize, value: f64) -> Condition {
    Condition { node, component, sign: 1.0, offset: value, equality: true }
}

/// A condition that a component is at least a value at a node.
pub(super) fn at_least(node: usize, component: usize, value: f64) -> Condition {
    Condition { node, component, sign: 1.0, offset: value, equality: false }
}
