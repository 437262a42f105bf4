//! Accepts trial points with smaller defects or a lower objective than the present point and all points in the filter.
//!
//! After Waechter and Biegler, "Line search filter methods for nonlinear programming" (SIAM J. Optim. 16, 2005) and
//! "On the implementation of an interior-point filter line-search algorithm" (Math. Program. 106, 2006), whose
//! constants these are.

/// Fraction of the defects by which either measure must fall.
const MARGIN: f64 = 1e-5;

/// Exponents and factor of the test whether a step is a descent of the objective.
const DEFECT_EXPONENT: f64 = 1.1;
const DESCENT_EXPONENT: f64 = 2.3;

/// Fraction of the predicted decrease that a descent must reach.
const SUFFICIENT_DECREASE: f64 = 1e-8;

/// Relative rounding error of the objective that a comparison allows.
const ROUNDING: f64 = 1e-13;

/// Largest number of points kept; the oldest are dropped.
const CAPACITY: usize = 32;

/// Defects and objective of a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Measures {
    pub(crate) infeasibility: f64,
    pub(crate) objective: f64,
}

impl Measures {
    pub(crate) fn is_finite(&self) -> bool {
        self.infeasibility.is_finite() && self.objective.is_finite()
    }
}

/// A trial point must not be worse in both measures than any of these points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Filter {
    entries: [Measures; CAPACITY],
    used: usize,
    oldest: usize,
    /// Defects above which no point is accepted.
    ceiling: f64,
    /// Defects up to which a step that should lower the objective is judged by the objective alone.
    small: f64,
}

impl Default for Filter {
    fn default() -> Self {
        Self {
            entries: [Measures::default(); CAPACITY],
            used: 0,
            oldest: 0,
            ceiling: f64::INFINITY,
            small: 0.0,
        }
    }
}

impl Filter {
    /// A filter for a solve that starts with these defects.
    pub(crate) fn starting_at(infeasibility: f64) -> Self {
        let size = infeasibility.max(1.0);
        Self { ceiling: 1e4 * size, small: 1e-4 * size, ..Self::default() }
    }

    /// Drops every point, because the objective has changed.
    pub(crate) fn clear(&mut self) {
        self.used = 0;
        self.oldest = 0;
    }

    /// Whether a trial point at `fraction` of a step is progress over `now`. If the point is accepted but the step was
    /// not a descent of the objective, `now` enters the filter. `slope` is the objective's slope along the whole step.
    pub(crate) fn accepts(&mut self, now: Measures, trial: Measures, slope: f64, fraction: f64) -> bool {
        if !trial.is_finite() {
            return false;
        }
        let rounding = ROUNDING * now.objective.abs();
        let clears = |point: &Measures| {
            trial.infeasibility <= (1.0 - MARGIN) * point.infeasibility
                || trial.objective <= point.objective - MARGIN * point.infeasibility + rounding
        };
        if trial.infeasibility > self.ceiling || !self.entries[..self.used].iter().all(clears) {
            return false;
        }
        let descends = slope < 0.0
            && now.infeasibility <= self.small
            && fraction * libm::pow(-slope, DESCENT_EXPONENT) > libm::pow(now.infeasibility, DEFECT_EXPONENT);
        if descends {
            return trial.objective <= now.objective + SUFFICIENT_DECREASE * fraction * slope + rounding;
        }
        if !clears(&now) {
            return false;
        }
        self.add(now);
        true
    }

    fn add(&mut self, point: Measures) {
        let place = if self.used < CAPACITY {
            self.used += 1;
            self.used - 1
        } else {
            self.oldest = (self.oldest + 1) % CAPACITY;
            (self.oldest + CAPACITY - 1) % CAPACITY
        };
        self.entries[place] = point;
    }
}
