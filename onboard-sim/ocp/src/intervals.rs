//! The dynamics at a point, as read by the solver. [`DenseIntervals`](crate::DenseIntervals) has
//! full matrices; a model whose matrices have a structure can have a custom type. Also the results
//! of the backward sweep: its stages, the value function, and second derivatives of the cost.
#![expect(clippy::inline_always, reason = "a fixed-size kernel of a few dozen instructions")]

use core::array::from_fn;
use core::fmt::Debug;

use crate::dense::{Factor, add_multiple};

/// All intervals of a horizon, evaluated at a point: where each ends, and its derivatives.
///
/// `A` and `B` are the derivatives of the end `F(x, u)` by state and input, `lambda` is the costate
/// of the node after the interval, at which the intervals were evaluated.
pub trait Intervals<const NX: usize, const NU: usize>: Clone + Debug + Default {
    /// Number of leading states on which no derivative depends, like positions in a uniform field:
    /// their columns of `A` are those of the identity.
    const INTEGRALS: usize = 0;

    /// One interval's derivatives.
    type Interval<'a>: Interval<NX, NU>
    where
        Self: 'a;

    /// Makes room for a number of intervals; allocates only if there were never as many.
    fn resize(&mut self, intervals: usize);

    /// `F` of interval `k`.
    fn end(&self, k: usize) -> [f64; NX];

    /// `(A' lambda, B' lambda)` of interval `k`, with `A` and `B` at the last evaluation, even if
    /// that was one without derivatives. The same `lambda` is given again.
    fn pulled(&self, k: usize, lambda: &[f64; NX]) -> ([f64; NX], [f64; NU]);

    /// The derivatives of interval `k` at the last evaluation with derivatives.
    fn interval(&self, k: usize) -> Self::Interval<'_>;
}

/// The derivatives of one interval, as operations. They are inlined into the sweeps, so mark them
/// `#[inline(always)]`.
pub trait Interval<const NX: usize, const NU: usize> {
    /// `(A' g, B' g)`.
    fn pull(&self, g: &[f64; NX]) -> ([f64; NX], [f64; NU]);

    /// `A dx + B du`.
    fn push(&self, dx: &[f64; NX], du: &[f64; NU]) -> [f64; NX];

    /// One stage of the backward sweep: from the value function of the node after the interval,
    /// `dx' after dx / 2 + slope' dx`, to that of the node before it, with the feedback of the
    /// inputs. `None` if the matrix of the inputs is not positive definite; `before` and `slope`
    /// must then not be used.
    ///
    /// [`Dense`](crate::Dense) has the formulas.
    fn eliminate<C: Curvature<NX>, R: Curvature<NU>>(
        &self,
        stage: &Stage<C, R, NX, NU>,
        after: &[[f64; NX]; NX],
        before: &mut [[f64; NX]; NX],
        slope: &mut [f64; NX],
    ) -> Option<Feedback<NX, NU>>;

    /// A share of the curvature, times `(dx, du)`.
    fn curve(&self, share: f64, dx: &[f64; NX], du: &[f64; NU]) -> ([f64; NX], [f64; NU]);
}

/// Second derivative of a scalar by the state and the input of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hessian<const NX: usize, const NU: usize> {
    /// By the state, twice.
    pub xx: [[f64; NX]; NX],
    /// By the input (rows) and the state.
    pub ux: [[f64; NX]; NU],
    /// By the input, twice.
    pub uu: [[f64; NU]; NU],
}

// One stage of the backward sweep: its inputs and results.

/// Smallest curvature by an input that counts as positive, relative to the input's terms.
const LEAST_CURVATURE: f64 = 1e-11;

/// An interval to be eliminated, without its derivatives: the objective at the node before it and
/// by its inputs.
#[derive(Debug, Clone, Copy)]
pub struct Stage<'a, C, R, const NX: usize, const NU: usize> {
    /// Difference between the end of the interval and the next node.
    pub defect: [f64; NX],
    /// Fraction of the dynamics' curvature that is taken.
    pub share: f64,
    /// Second and first derivative of the objective by the state.
    pub state_terms: (&'a C, &'a [f64; NX]),
    /// Second and first derivative of the objective by the inputs, without the part through the
    /// states.
    pub input_terms: (&'a R, &'a [f64; NU]),
}

impl<C: Curvature<NX>, R: Curvature<NU>, const NX: usize, const NU: usize> Stage<'_, C, R, NX, NU> {
    /// Adds the inputs' curvature to the part through the states, and factorises the sum if it is
    /// positive definite.
    #[inline(always)]
    pub fn factor(&self, mut by_inputs: [[f64; NU]; NU]) -> Option<Factor<NU>> {
        let (own, _) = self.input_terms;
        own.add_to(&mut by_inputs);
        Factor::of(by_inputs, &from_fn(|i| LEAST_CURVATURE * (1.0 + own.diagonal(i))))
    }

    /// Eliminates the inputs: from the second derivatives by states (`xx`), inputs and states, and
    /// inputs that come through the node after the interval, and the slopes that do, to the value
    /// function of the node before it. `None` as in [`Interval::eliminate`].
    #[inline(always)]
    pub fn without_inputs(
        &self,
        xx: &mut [[f64; NX]; NX],
        ux: [[f64; NX]; NU],
        uu: [[f64; NU]; NU],
        (pulled_x, pulled_u): &([f64; NX], [f64; NU]),
        slope: &mut [f64; NX],
    ) -> Option<Feedback<NX, NU>> {
        let ((own_curvature, own_slope), (_, input_slope)) = (self.state_terms, self.input_terms);
        let factor = self.factor(uu)?;
        let reduced = factor.reduce(ux);
        let scaled = factor.scale(&reduced);
        let push = factor.scale(&factor.reduce(from_fn(|i| [input_slope[i] + pulled_u[i]])));
        let offset = factor.restore(push).map(|[value]| value);
        for (i, row) in xx.iter_mut().enumerate() {
            for (scaled, reduced) in scaled.iter().zip(&reduced) {
                add_multiple(row, -scaled[i], reduced);
            }
        }
        own_curvature.add_to(xx);
        *slope = slope_before(own_slope, pulled_x, &reduced, &push);
        Some(Feedback { gain: factor.restore(scaled), offset, reduced, factor })
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

/// Adds the product of a symmetric matrix with a vector to `sum`.
#[inline(always)]
pub(crate) fn add_times<const NX: usize>(matrix: &[[f64; NX]; NX], vector: &[f64; NX], sum: &mut [f64; NX]) {
    for (row, value) in matrix.iter().zip(vector) {
        add_multiple(sum, *value, row);
    }
}

// Second derivatives of the cost: only the diagonal, or the full matrix.

/// The second derivative of a cost by `N` variables. `[f64; N]` is a diagonal, `[[f64; N]; N]` a
/// full symmetric matrix.
pub trait Curvature<const N: usize>: Copy + Debug {
    const ZERO: Self;

    /// An entry of the diagonal.
    fn diagonal(&self, i: usize) -> f64;

    /// Adds to an entry of the diagonal.
    fn add_to_diagonal(&mut self, i: usize, value: f64);

    /// Adds all entries to a matrix.
    fn add_to(&self, sum: &mut [[f64; N]; N]);

    /// The product with a vector.
    fn times(&self, vector: &[f64; N]) -> [f64; N];
}

impl<const N: usize> Curvature<N> for [f64; N] {
    const ZERO: Self = [0.0; N];

    #[inline(always)]
    fn diagonal(&self, i: usize) -> f64 {
        self[i]
    }

    #[inline(always)]
    fn add_to_diagonal(&mut self, i: usize, value: f64) {
        self[i] += value;
    }

    #[inline(always)]
    fn add_to(&self, sum: &mut [[f64; N]; N]) {
        for i in 0..N {
            sum[i][i] += self[i];
        }
    }

    #[inline(always)]
    fn times(&self, vector: &[f64; N]) -> [f64; N] {
        from_fn(|i| self[i] * vector[i])
    }
}

impl<const N: usize> Curvature<N> for [[f64; N]; N] {
    const ZERO: Self = [[0.0; N]; N];

    #[inline(always)]
    fn diagonal(&self, i: usize) -> f64 {
        self[i][i]
    }

    #[inline(always)]
    fn add_to_diagonal(&mut self, i: usize, value: f64) {
        self[i][i] += value;
    }

    #[inline(always)]
    fn add_to(&self, sum: &mut [[f64; N]; N]) {
        for (row, own) in sum.iter_mut().zip(self) {
            for (entry, value) in row.iter_mut().zip(own) {
                *entry += value;
            }
        }
    }

    #[inline(always)]
    fn times(&self, vector: &[f64; N]) -> [f64; N] {
        from_fn(|i| self[i].iter().zip(vector).map(|(entry, value)| entry * value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagonal_acts_like_the_full_matrix() {
        let (mut diagonal, mut whole) = ([2.0, -3.0], [[2.0, 0.0], [0.0, -3.0]]);
        diagonal.add_to_diagonal(1, 0.5);
        whole.add_to_diagonal(1, 0.5);
        let (mut one, mut other) = ([[1.0; 2]; 2], [[1.0; 2]; 2]);
        diagonal.add_to(&mut one);
        whole.add_to(&mut other);
        let numbers =
            |sum: [[f64; 2]; 2], product: [f64; 2], entry: f64| vec![sum[0], sum[1], product, [entry; 2]];
        assert_eq!(
            numbers(one, diagonal.times(&[1.0, 4.0]), diagonal.diagonal(1)),
            numbers(other, whole.times(&[1.0, 4.0]), whole.diagonal(1))
        );
    }
}
