//! One stage of the backward sweep: what it is given, and what it finds.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use core::array::from_fn;

use crate::curvature::Curvature;
use crate::factor::Factor;

/// Smallest curvature by an input that counts as positive, relative to the input's own terms.
const LEAST_CURVATURE: f64 = 1e-11;

/// An interval to be eliminated, apart from its own derivatives: the objective at the node before it and by its inputs.
#[derive(Debug, Clone, Copy)]
pub struct Stage<'a, C, R, const NX: usize, const NU: usize> {
    /// Difference between the end of the interval and the next node.
    pub defect: [f64; NX],
    /// Fraction of the dynamics' curvature that is taken.
    pub share: f64,
    /// Second and first derivative of the objective by the state.
    pub state_terms: (&'a C, &'a [f64; NX]),
    /// Second and first derivative of the objective by the inputs, apart from what comes through the states.
    pub input_terms: (&'a R, &'a [f64; NU]),
}

impl<C: Curvature<NX>, R: Curvature<NU>, const NX: usize, const NU: usize> Stage<'_, C, R, NX, NU> {
    /// Adds the inputs' own curvature to the one that comes through the states, and factorises the sum if it is positive
    /// definite.
    #[inline(always)]
    pub fn factor(&self, mut by_inputs: [[f64; NU]; NU]) -> Option<Factor<NU>> {
        let (own, _) = self.input_terms;
        own.add_to(&mut by_inputs);
        Factor::of(by_inputs, &from_fn(|i| LEAST_CURVATURE * (1.0 + own.diagonal(i))))
    }
}

/// The feedback of the inputs at a stage: `du = -(offset + gain dx)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback<const NX: usize, const NU: usize> {
    pub gain: [[f64; NX]; NU],
    pub offset: [f64; NU],
    /// Second derivative by input (rows) and state, reduced by the factor of the one by the inputs.
    pub reduced: [[f64; NX]; NU],
    pub factor: Factor<NU>,
}

impl<const NX: usize, const NU: usize> Feedback<NX, NU> {
    pub(crate) const ZERO: Self =
        Self { gain: [[0.0; NX]; NU], offset: [0.0; NU], reduced: [[0.0; NX]; NU], factor: Factor::ZERO };
}

/// Slope of the value function before an interval, with its inputs eliminated.
#[inline(always)]
pub(crate) fn slope_before<const NX: usize, const NU: usize>(
    slopes: &[f64; NX],
    pulled: &[f64; NX],
    reduced: &[[f64; NX]; NU],
    push: &[[f64; 1]; NU],
) -> [f64; NX] {
    let mut slope = from_fn(|i| slopes[i] + pulled[i]);
    for (row, [push]) in reduced.iter().zip(push) {
        for (entry, value) in slope.iter_mut().zip(row) {
            *entry -= value * push;
        }
    }
    slope
}
