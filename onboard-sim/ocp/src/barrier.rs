//! Input limits and elastic conditions, with their slacks and multipliers.
//!
//! An input limit is a hard inequality. A condition `c(x)` on one state component is an exact
//! penalty at the penalty `M`: with slacks `c = s - e`, `s > 0` above and `e > 0` below,
//!
//! ```text
//! inequality  c >= 0   cost M e          0 < y < M     s y       = mu    e (M - y) = mu
//! equality    c  = 0   cost M (s + e)   -M < y < M     s (M + y) = mu    e (M - y) = mu
//! ```
//!
//! so the penalty limits `y`, and a condition that cannot be met is missed by as little as the
//! penalty allows. Conditions are linear, so `c = s - e` holds at every iterate if it holds at the
//! first. The elimination of slacks and multiplier from the Newton system leaves a diagonal term `1
//! / D`, `D = s / (y + l) + e / (M - y)`, on the condition's component.

use crate::model::InputRange;

/// Barrier of the multipliers that a warm start takes over, and the last of every solve.
pub(crate) const LAST_BARRIER: f64 = 1e-8;

/// Slacks up to this do not change a multiplier.
const SLACK: f64 = 1e-3;

/// A multiplier this close to its penalty, relative to it, counts as at its penalty.
const AT_PENALTY: f64 = 1e-9;

/// Multipliers of an input's lower and upper limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Limits {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Limits {
    /// The multipliers on the central path.
    pub(crate) fn central(input: f64, range: &InputRange, barrier: f64) -> Self {
        Self { lower: barrier / range.below(input), upper: barrier / range.above(input) }
    }

    /// Raises multipliers to the barrier, and returns the input moved away from the limits with a
    /// multiplier.
    pub(crate) fn raise(&mut self, input: f64, range: &InputRange, barrier: f64) -> f64 {
        let room = 0.5 * range.reach();
        let below = range.below(input).max((barrier / self.lower).min(room));
        let above = range.above(input).max((barrier / self.upper).min(room));
        self.lower = self.lower.max(barrier / below);
        self.upper = self.upper.max(barrier / above);
        if above > range.above(input) { range.upper - above } else { range.lower + below }
    }

    /// Second and first derivative that the limits add to the input's part of the Newton system.
    #[inline]
    pub(crate) fn terms(&self, input: f64, range: &InputRange, barrier: f64) -> (f64, f64) {
        let (below, above) = (1.0 / range.below(input), 1.0 / range.above(input));
        (self.lower * below + self.upper * above, barrier * (above - below))
    }

    /// The multipliers' Newton step when the input moves by `step`.
    #[inline]
    pub(crate) fn step(&self, input: f64, range: &InputRange, barrier: f64, step: f64) -> Self {
        let (below, above) = (1.0 / range.below(input), 1.0 / range.above(input));
        Self {
            lower: (barrier - self.lower * step) * below - self.lower,
            upper: (barrier + self.upper * step) * above - self.upper,
        }
    }
}

/// Slacks and multiplier of a condition.
///
/// The multiplier is stored as its distances `a = y + l` and `b = M - y`, so that it stays exact
/// next to an end of its range.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Elastic {
    a: f64,
    b: f64,
    /// `s`.
    pub(crate) above: f64,
    /// `e`.
    pub(crate) below: f64,
    /// `l`, the negative of the multiplier's smallest value: 0, or the penalty for an equality.
    least: f64,
    /// `M`, the multiplier's largest value.
    penalty: f64,
}

/// Change of an [`Elastic`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ElasticStep {
    pub(crate) multiplier: f64,
    pub(crate) above: f64,
    pub(crate) below: f64,
}

impl Elastic {
    /// The elastic of a condition at value `c` on the central path.
    pub(crate) fn central(c: f64, equality: bool, penalty: f64, barrier: f64) -> Self {
        let least = if equality { penalty } else { 0.0 };
        let width = penalty + least;
        // c = mu / a - mu / (width - a); the smaller root of a quadratic, for the side c is on.
        let size = c.abs() * width;
        let root = libm::sqrt(size * size + 4.0 * barrier * barrier);
        let near = 2.0 * barrier * width / (size + 2.0 * barrier + root);
        let (a, b) = if c >= 0.0 { (near, width - near) } else { (width - near, near) };
        Self { a, b, above: barrier / a, below: barrier / b, least, penalty }.fitted(c)
    }

    /// The elastic of a condition at value `c` with a multiplier from an earlier solution.
    pub(crate) fn warm(c: f64, multiplier: f64, equality: bool, penalty: f64, barrier: f64) -> Self {
        /// Smallest distance of a multiplier from the ends of its range, as a fraction of its value
        /// on the central path.
        const MARGIN: f64 = 0.1;
        let least = if equality { penalty } else { 0.0 };
        let nearest = MARGIN * barrier / c.abs().max(SLACK);
        let a = (multiplier + least).max(nearest);
        let b = (penalty - multiplier).max(nearest);
        Self { a, b, above: barrier / a, below: barrier / b, least, penalty }.fitted(c)
    }

    /// The elastic of a condition at value `c` with the multiplier of an optimum, which may be at
    /// an end of its range.
    pub(crate) fn settled(c: f64, multiplier: f64, equality: bool, penalty: f64, barrier: f64) -> Self {
        /// Smallest distance from the ends: negligible, but above zero.
        const NOTHING: f64 = 1e-9;
        let least = if equality { penalty } else { 0.0 };
        let (a, b) = ((multiplier + least).max(NOTHING), (penalty - multiplier).max(NOTHING));
        let (above, below) = (barrier / a, barrier / b);
        let mut settled = Self { a, b, above, below, least, penalty };
        if c >= 0.0 {
            settled.below = below.min(barrier / penalty);
        } else {
            settled.above = above.min(barrier / penalty);
        }
        settled.fitted(c)
    }

    /// With `s - e` equal to the condition's value `c`: the smaller of the two is retained.
    #[inline]
    pub(crate) fn fitted(mut self, c: f64) -> Self {
        if c >= 0.0 {
            self.above = c + self.below;
        } else {
            self.below = self.above - c;
        }
        self
    }

    /// With slacks and multiplier raised to the barrier, for a condition at value `c`.
    pub(crate) fn raised(&self, c: f64, barrier: f64) -> Self {
        let width = self.penalty + self.least;
        let least = (barrier / c.abs().max(SLACK)).min(0.5 * width);
        let mut raised = *self;
        if self.a < least {
            (raised.a, raised.b) = (least, width - least);
        } else if self.b < least {
            (raised.a, raised.b) = (width - least, least);
        }
        raised.above = barrier / raised.a;
        raised.below = barrier / raised.b;
        if raised.above - raised.below < c {
            raised.above = c + raised.below;
        } else {
            raised.below = raised.above - c;
        }
        raised
    }

    /// `y`.
    #[inline]
    pub(crate) fn multiplier(&self) -> f64 {
        if self.a < self.b { self.a - self.least } else { self.penalty - self.b }
    }

    /// `y`, set exactly to its penalty if a broken condition has brought it close.
    pub(crate) fn settled_multiplier(&self) -> f64 {
        if self.b <= AT_PENALTY * self.penalty {
            self.penalty
        } else if self.least > 0.0 && self.a <= AT_PENALTY * self.penalty {
            -self.least
        } else {
            self.multiplier()
        }
    }

    /// Distances of the multiplier from its least and its largest value.
    #[inline]
    pub(crate) fn room(&self) -> (f64, f64) {
        (self.a, self.b)
    }

    /// The violation that the penalty is for.
    #[inline]
    pub(crate) fn broken(&self) -> f64 {
        if self.least > 0.0 { self.above + self.below } else { self.below }
    }

    /// The change of the violation that the penalty is for.
    #[inline]
    pub(crate) fn broken_by(&self, step: &ElasticStep) -> f64 {
        if self.least > 0.0 { step.above + step.below } else { step.below }
    }

    /// `D`, and the multiplier's change by a step that leaves the condition's value as it is.
    #[inline]
    pub(crate) fn terms(&self, barrier: f64) -> (f64, f64) {
        let softness = self.above / self.a + self.below / self.b;
        let target = barrier / self.a - barrier / self.b;
        (softness, -(self.above - self.below - target) / softness)
    }

    /// The slacks' Newton step when the multiplier changes by `change`.
    #[inline]
    pub(crate) fn step(&self, barrier: f64, change: f64) -> ElasticStep {
        ElasticStep {
            multiplier: change,
            above: (barrier - self.above * change) / self.a - self.above,
            below: (barrier + self.below * change) / self.b - self.below,
        }
    }

    /// The elastic after fractions of a step that changes the condition's value to `c`.
    #[inline]
    pub(crate) fn moved(&self, step: &ElasticStep, primal: f64, dual: f64, c: f64) -> Self {
        Self {
            a: self.a + dual * step.multiplier,
            b: self.b - dual * step.multiplier,
            above: self.above + primal * step.above,
            below: self.below + primal * step.below,
            ..*self
        }
        .fitted(c)
    }

    /// Products of the slacks and their multipliers.
    #[inline]
    pub(crate) fn products(&self) -> [f64; 2] {
        [self.above * self.a, self.below * self.b]
    }
}
