//! The dynamics at a point, as the solver reads them. [`DenseIntervals`](crate::DenseIntervals) has whole matrices;
//! a model whose matrices have a known structure can have its own.

use core::fmt::Debug;

use pulp::Simd;

use crate::curvature::Curvature;
use crate::stage::{Feedback, Stage};
use crate::value::Value;

/// All intervals of a horizon, evaluated at a point: where each ends, and its derivatives.
///
/// `A` and `B` are the derivatives of the end `F(x, u)` by state and input, `lambda` is the costate of the node after
/// the interval, at which the intervals were evaluated.
pub trait Intervals<const NX: usize, const NU: usize>: Clone + Debug + Default {
    /// Number of leading states on which no derivative depends, like positions in a uniform field: their columns of `A`
    /// are those of the identity.
    const INTEGRALS: usize = 0;

    /// The quadratic part of the value function.
    type Value: Value<NX>;

    /// One interval's derivatives.
    type Interval<'a>: Interval<NX, NU, Value = Self::Value>
    where
        Self: 'a;

    /// Makes room for a number of intervals; allocates only if there were never as many.
    fn resize(&mut self, intervals: usize);

    /// `F` of interval `k`.
    fn end(&self, k: usize) -> [f64; NX];

    /// `(A' lambda, B' lambda)` of interval `k`, with `A` and `B` at the last evaluation, even if that was one without
    /// derivatives. The same `lambda` is given again.
    fn pulled(&self, k: usize, lambda: &[f64; NX]) -> ([f64; NX], [f64; NU]);

    /// The derivatives of interval `k` at the last evaluation with derivatives.
    fn interval(&self, k: usize) -> Self::Interval<'_>;
}

/// The derivatives of one interval, as operations. They are inlined into the sweeps, so mark them `#[inline(always)]`.
pub trait Interval<const NX: usize, const NU: usize> {
    type Value: Value<NX>;

    /// `(A' g, B' g)`.
    fn pull(&self, g: &[f64; NX]) -> ([f64; NX], [f64; NU]);

    /// `A dx + B du`.
    fn push(&self, dx: &[f64; NX], du: &[f64; NU]) -> [f64; NX];

    /// One stage of the backward sweep, in the vectors of `simd`: from the value function of the node after the interval,
    /// `dx' after dx / 2 + slope' dx`, to that of the node before it, with the feedback of the inputs. `None` if the matrix of
    /// the inputs is not positive definite; `before` and `slope` must then not be used.
    ///
    /// [`Dense`](crate::Dense) has the formulas.
    fn eliminate<S: Simd, C: Curvature<NX>, R: Curvature<NU>>(
        &self,
        simd: S,
        stage: &Stage<C, R, NX, NU>,
        after: &Self::Value,
        before: &mut Self::Value,
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
