//! Interface of a problem to the solver, and the conditions on its states.

use alloc::vec::Vec;

use crate::intervals::{Curvature, Intervals};

/// An optimal-control problem with `NX` states and `NU` inputs, at least one input.
///
/// Every method must be a function of the model and its arguments alone, so that equal problems
/// have equal solutions, bit by bit.
pub trait Model<const NX: usize, const NU: usize> {
    /// The evaluated intervals.
    type Intervals: Intervals<NX, NU>;
    /// Second derivative of the cost by the state of a node.
    type StateCurvature: Curvature<NX>;
    /// Second derivative of the cost by the input of an interval.
    type InputCurvature: Curvature<NU>;

    /// Number of intervals, at least 1.
    fn intervals(&self) -> usize;

    /// The state at the first node.
    fn initial(&self) -> [f64; NX];

    /// The limits of each input, the same in every interval.
    fn input_ranges(&self) -> [InputRange; NU];

    /// Appends the conditions, the same number for the same number of intervals; allocates only if
    /// the vector never held as many.
    fn append_conditions(&self, conditions: &mut Vec<Condition>);

    fn settings(&self) -> Settings;

    /// Writes the initial states and inputs of the cold solve `index`, 0 to `guesses +
    /// spare_guesses - 1` of the settings. The first state is the initial one, the inputs are
    /// inside their limits, and the path may have defects. Newton's method preserves a symmetry, so
    /// a guess should not have one that the best path breaks.
    fn guess(&self, index: usize, states: &mut [[f64; NX]], inputs: &mut [[f64; NU]]);

    /// Evaluates every interval `k` from node `k`, with the costate of node `k + 1`. Without
    /// `derivatives` those of the last evaluation stay as they are.
    fn evaluate(
        &self,
        states: &[[f64; NX]],
        inputs: &[[f64; NU]],
        costates: &[[f64; NX]],
        derivatives: bool,
        intervals: &mut Self::Intervals,
    );

    /// The state after interval `k`, as [`evaluate`](Self::evaluate) has it except for rounding.
    fn next(&self, k: usize, state: &[f64; NX], input: &[f64; NU]) -> [f64; NX];

    /// The cost of a path, without penalties. The first state's part may be left out, because
    /// nothing changes it.
    fn cost(&self, states: &[[f64; NX]], inputs: &[[f64; NU]]) -> f64;

    /// First derivative of the cost by the state of a node.
    fn state_slope(&self, node: usize, state: &[f64; NX]) -> [f64; NX];

    /// Second derivative of the cost by the state of a node. Where it is not positive semidefinite,
    /// the solver may fail.
    fn state_curvature(&self, node: usize, state: &[f64; NX]) -> Self::StateCurvature;

    /// First derivative of the cost by the input of interval `k`.
    fn input_slope(&self, k: usize, input: &[f64; NU]) -> [f64; NU];

    /// Second derivative of the cost by the input of interval `k`. Where it is not positive
    /// semidefinite, the solver may fail.
    fn input_curvature(&self, k: usize, input: &[f64; NU]) -> Self::InputCurvature;
}

/// The limits of an input, finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputRange {
    pub lower: f64,
    /// Above the lower limit.
    pub upper: f64,
    /// A large change of the input: a radian of an angle, half the range of a force.
    pub unit: f64,
}

impl InputRange {
    /// Distance from the lower limit.
    #[inline]
    pub(crate) fn below(&self, input: f64) -> f64 {
        input - self.lower
    }

    /// Distance from the upper limit.
    #[inline]
    pub(crate) fn above(&self, input: f64) -> f64 {
        self.upper - input
    }

    /// Half the distance between the limits.
    #[inline]
    pub(crate) fn reach(&self) -> f64 {
        0.5 * (self.upper - self.lower)
    }

    /// The nearest value within the limits.
    #[inline]
    pub(crate) fn clamp(&self, input: f64) -> f64 {
        input.clamp(self.lower, self.upper)
    }

    /// An input strictly within its limits.
    pub(crate) fn within(&self, input: f64) -> f64 {
        const HAIR: f64 = 1e-14;
        let (middle, most) = (0.5 * (self.lower + self.upper), self.reach() * (1.0 - HAIR));
        input.clamp(middle - most, middle + most)
    }
}

/// Settings of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest number of Newton iterations from one start.
    pub max_iterations: usize,
    /// Residual of the optimality conditions that counts as converged.
    pub tolerance: f64,
    /// Penalty of one unit by which a condition is missed.
    pub penalty: f64,
    /// Barrier of a cold solve's first iteration, of the order of the penalty, so that nothing is
    /// active yet.
    pub first_barrier: f64,
    /// Number of guesses of a cold solve; the result with the lowest cost is used.
    pub guesses: usize,
    /// Number of further guesses, tried if the cheapest result has not converged or misses a
    /// condition.
    pub spare_guesses: usize,
    /// Largest miss of a condition that counts as none.
    pub acceptable_miss: f64,
}

// Conditions on the states.

/// A scalar condition on one state component of one node: `sign * component - offset` must be zero
/// (an equality) or not negative, in the state's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// The node, 1 to the number of intervals.
    pub node: usize,
    /// The component in state order.
    pub component: usize,
    /// Sign of the component, 1 or -1.
    pub sign: f64,
    /// The value that the signed component is compared with.
    pub offset: f64,
    /// Whether the condition is an equality.
    pub equality: bool,
}

impl Condition {
    /// The condition's value on a path; NaN if it has no such node.
    #[inline]
    pub fn value<const NX: usize>(&self, states: &[[f64; NX]]) -> f64 {
        let component = states.get(self.node).and_then(|state| state.get(self.component));
        component.map_or(f64::NAN, |value| self.sign * value - self.offset)
    }

    /// By how much a value breaks the condition.
    #[inline]
    pub fn violation(&self, value: f64) -> f64 {
        if self.equality { value.abs() } else { (-value).max(0.0) }
    }

    /// The range of its multiplier.
    #[inline]
    pub(crate) fn range(&self, penalty: f64) -> (f64, f64) {
        (if self.equality { -penalty } else { 0.0 }, penalty)
    }
}
