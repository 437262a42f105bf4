//! Input limits and elastic conditions, with their slacks and multipliers.
//!
//! An input limit is a hard inequality. A condition `c(x)` on one state component is an exact penalty at the price
//! `M`: with slacks `c = s - e`, `s > 0` above and `e > 0` below,
//!
//! ```text
//! inequality  c >= 0   cost M e          0 < y < M     s y       = mu    e (M - y) = mu
//! equality    c  = 0   cost M (s + e)   -M < y < M     s (M + y) = mu    e (M - y) = mu
//! ```
//!
//! so `y` is clipped by its price, and what cannot be met is missed by as little as the price allows. Conditions are
//! linear, so `c = s - e` holds at every iterate once it holds at the first. Eliminating slacks and multiplier from
//! the Newton system leaves a diagonal term `1 / D`, `D = s / (y + l) + e / (M - y)`, on the condition's component.

/// Multipliers of an input's lower and upper limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Limits {
    pub(super) lower: f64,
    pub(super) upper: f64,
}

impl Limits {
    /// The multipliers on the central path.
    pub(super) fn central(input_rad: f64, limit_rad: f64, barrier: f64) -> Self {
        Self { lower: barrier / (limit_rad + input_rad), upper: barrier / (limit_rad - input_rad) }
    }

    /// Second and first derivative that the limits add to the input's part of the Newton system.
    #[inline]
    pub(super) fn terms(&self, input_rad: f64, limit_rad: f64, barrier: f64) -> (f64, f64) {
        let (below, above) = (1.0 / (limit_rad + input_rad), 1.0 / (limit_rad - input_rad));
        (self.lower * below + self.upper * above, barrier * (above - below))
    }

    /// The multipliers' Newton step when the input moves by `step`.
    #[inline]
    pub(super) fn step(&self, input_rad: f64, limit_rad: f64, barrier: f64, step: f64) -> Self {
        let (below, above) = (1.0 / (limit_rad + input_rad), 1.0 / (limit_rad - input_rad));
        Self {
            lower: (barrier - self.lower * step) * below - self.lower,
            upper: (barrier + self.upper * step) * above - self.upper,
        }
    }
}

/// Slacks and multiplier of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Elastic {
    pub(super) multiplier: f64,
    /// `s`.
    pub(super) above: f64,
    /// `e`.
    pub(super) below: f64,
    /// The multiplier's least value, negated: 0, or the price of an equality.
    pub(super) least: f64,
    /// The multiplier's largest value.
    pub(super) price: f64,
}

/// Change of an [`Elastic`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ElasticStep {
    pub(super) multiplier: f64,
    pub(super) above: f64,
    pub(super) below: f64,
}

impl Elastic {
    /// The elastic of a condition at value `c` on the central path.
    pub(super) fn central(c: f64, equality: bool, price: f64, barrier: f64) -> Self {
        let least = if equality { price } else { 0.0 };
        let width = price + least;
        // c = mu / a - mu / (width - a) for a = y + least; the smaller root of a quadratic, by the side c is on.
        let size = c.abs();
        let root = (size * width * size * width + 4.0 * barrier * barrier).sqrt();
        let a = 2.0 * barrier * width / (size * width + 2.0 * barrier + root);
        let (a, b) = if c >= 0.0 { (a, width - a) } else { (width - a, a) };
        let mut elastic =
            Self { multiplier: a - least, above: barrier / a, below: barrier / b, least, price };
        elastic.fit(c);
        elastic
    }

    /// The elastic of a condition at value `c` with a multiplier from an earlier solution.
    pub(super) fn warm(c: f64, multiplier: f64, equality: bool, price: f64, barrier: f64) -> Self {
        const INSIDE: f64 = 1e-9;
        let least = if equality { price } else { 0.0 };
        let margin = INSIDE * price;
        let multiplier = multiplier.clamp(margin - least, price - margin);
        let above = barrier / (multiplier + least);
        let below = barrier / (price - multiplier);
        let mut elastic = Self { multiplier, above, below, least, price };
        elastic.fit(c);
        elastic
    }

    /// Makes `s - e` equal to the condition's value, by growing one of them.
    #[inline]
    pub(super) fn fit(&mut self, c: f64) {
        if self.above - self.below < c {
            self.above = c + self.below;
        } else {
            self.below = self.above - c;
        }
    }

    /// What the price is paid for.
    #[inline]
    pub(super) fn broken(&self) -> f64 {
        if self.least > 0.0 { self.above + self.below } else { self.below }
    }

    /// Room of the multiplier above its least and below its largest value.
    #[inline]
    fn room(&self) -> (f64, f64) {
        (self.multiplier + self.least, self.price - self.multiplier)
    }

    /// `D`, and the multiplier after a step that leaves the condition's value as it is.
    #[inline]
    pub(super) fn terms(&self, barrier: f64) -> (f64, f64) {
        let (a, b) = self.room();
        let softness = self.above / a + self.below / b;
        let target = barrier / a - barrier / b;
        (softness, self.multiplier - (self.above - self.below - target) / softness)
    }

    /// The slacks' Newton step when the multiplier goes to `multiplier`.
    #[inline]
    pub(super) fn step(&self, barrier: f64, multiplier: f64) -> ElasticStep {
        let (a, b) = self.room();
        let change = multiplier - self.multiplier;
        ElasticStep {
            multiplier: change,
            above: (barrier - self.above * change) / a - self.above,
            below: (barrier + self.below * change) / b - self.below,
        }
    }

    /// Largest product of a slack and its multiplier, less the barrier.
    #[inline]
    pub(super) fn complementarity(&self, barrier: f64) -> f64 {
        let (a, b) = self.room();
        (self.above * a - barrier).abs().max((self.below * b - barrier).abs())
    }
}
