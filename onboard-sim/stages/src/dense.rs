//! Intervals as whole matrices, for models without a structure that is worth its own code.
#![expect(clippy::inline_always, reason = "inlined into the sweeps, to be compiled for their vectors")]

use alloc::vec::Vec;
use core::array::from_fn;

use pulp::Simd;

use crate::curvature::Curvature;
use crate::intervals::{Hessian, Interval, Intervals};
use crate::stage::{Feedback, Stage, slope_before};
use crate::value::Value;

/// One interval. [`Model::evaluate`](crate::Model::evaluate) fills in `end`, `pulled_x` and `pulled_u`, and the other
/// fields if derivatives are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dense<const NX: usize, const NU: usize> {
    /// `F`.
    pub end: [f64; NX],
    /// `A' lambda`.
    pub pulled_x: [f64; NX],
    /// `B' lambda`.
    pub pulled_u: [f64; NU],
    /// Derivative of `F` (rows) by the state.
    pub a: [[f64; NX]; NX],
    /// Derivative of `F` (rows) by the input.
    pub b: [[f64; NU]; NX],
    /// Second derivative of `lambda' F`.
    pub curvature: Hessian<NX, NU>,
}

impl<const NX: usize, const NU: usize> Dense<NX, NU> {
    const ZERO: Self = Self {
        end: [0.0; NX],
        pulled_x: [0.0; NX],
        pulled_u: [0.0; NU],
        a: [[0.0; NX]; NX],
        b: [[0.0; NU]; NX],
        curvature: Hessian { xx: [[0.0; NX]; NX], ux: [[0.0; NX]; NU], uu: [[0.0; NU]; NU] },
    };

    /// `(A, B)' P (A, B)` for a symmetric `P`, plus a share of the curvature.
    #[inline(always)]
    fn square(&self, p: &[[f64; NX]; NX], share: f64) -> Hessian<NX, NU> {
        let (mut pa, mut pb) = ([[0.0; NX]; NX], [[0.0; NU]; NX]);
        for i in 0..NX {
            (pa[i], pb[i]) = (&self).pull(&p[i]);
        }
        let mut square = self.curvature;
        for row in square.xx.iter_mut().chain(&mut square.ux) {
            for entry in row {
                *entry *= share;
            }
        }
        for entry in square.uu.as_flattened_mut() {
            *entry *= share;
        }
        for k in 0..NX {
            for i in 0..NX {
                add_multiple(&mut square.xx[i], self.a[k][i], &pa[k]);
            }
            for i in 0..NU {
                add_multiple(&mut square.ux[i], self.b[k][i], &pa[k]);
                add_multiple(&mut square.uu[i], self.b[k][i], &pb[k]);
            }
        }
        square
    }
}

/// All intervals of a horizon.
#[derive(Debug, Clone, Default)]
pub struct DenseIntervals<const NX: usize, const NU: usize>(pub Vec<Dense<NX, NU>>);

impl<const NX: usize, const NU: usize> Intervals<NX, NU> for DenseIntervals<NX, NU> {
    type Value = [[f64; NX]; NX];
    type Interval<'a> = &'a Dense<NX, NU>;

    fn resize(&mut self, intervals: usize) {
        self.0.resize(intervals, Dense::ZERO);
    }

    #[inline(always)]
    fn end(&self, k: usize) -> [f64; NX] {
        self.0[k].end
    }

    #[inline(always)]
    fn pulled(&self, k: usize, _: &[f64; NX]) -> ([f64; NX], [f64; NU]) {
        (self.0[k].pulled_x, self.0[k].pulled_u)
    }

    #[inline(always)]
    fn interval(&self, k: usize) -> &Dense<NX, NU> {
        &self.0[k]
    }
}

impl<const NX: usize, const NU: usize> Interval<NX, NU> for &Dense<NX, NU> {
    type Value = [[f64; NX]; NX];

    #[inline(always)]
    fn pull(&self, g: &[f64; NX]) -> ([f64; NX], [f64; NU]) {
        (combine(g, &self.a), combine(g, &self.b))
    }

    #[inline(always)]
    fn push(&self, dx: &[f64; NX], du: &[f64; NU]) -> [f64; NX] {
        from_fn(|i| dot(&self.a[i], dx) + dot(&self.b[i], du))
    }

    #[inline(always)]
    fn eliminate<S: Simd, C: Curvature<NX>, R: Curvature<NU>>(
        &self,
        _: S,
        stage: &Stage<C, R, NX, NU>,
        after: &[[f64; NX]; NX],
        before: &mut [[f64; NX]; NX],
        slope: &mut [f64; NX],
    ) -> Option<Feedback<NX, NU>> {
        let ((own_curvature, own_slope), (_, input_slope)) = (stage.state_terms, stage.input_terms);
        after.add_times(&stage.defect, slope);
        let (pulled_x, pulled_u) = self.pull(slope);
        let Hessian { mut xx, ux, uu } = self.square(after, stage.share);
        let factor = stage.factor(uu)?;
        let reduced = factor.reduce(ux);
        let scaled = factor.scale(&reduced);
        let push = factor.scale(&factor.reduce(from_fn(|i| [input_slope[i] + pulled_u[i]])));
        let offset = factor.restore(push).map(|[value]| value);
        for (scaled, reduced) in scaled.iter().zip(&reduced) {
            for i in 0..NX {
                for j in 0..NX {
                    xx[i][j] -= scaled[i] * reduced[j];
                }
            }
        }
        own_curvature.add_to(&mut xx);
        *before = xx;
        *slope = slope_before(own_slope, &pulled_x, &reduced, &push);
        Some(Feedback { gain: factor.restore(scaled), offset, reduced, factor })
    }

    #[inline(always)]
    fn curve(&self, share: f64, dx: &[f64; NX], du: &[f64; NU]) -> ([f64; NX], [f64; NU]) {
        let Hessian { xx, ux, uu } = &self.curvature;
        let crossed: [f64; NX] = combine(du, ux);
        let by_state = from_fn(|i| share * (dot(&xx[i], dx) + crossed[i]));
        let by_input = from_fn(|i| share * (dot(&ux[i], dx) + dot(&uu[i], du)));
        (by_state, by_input)
    }
}

#[inline(always)]
fn dot<const N: usize>(one: &[f64; N], other: &[f64; N]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// Adds a multiple of a row.
#[inline(always)]
fn add_multiple<const N: usize>(sum: &mut [f64; N], factor: f64, row: &[f64; N]) {
    for (entry, value) in sum.iter_mut().zip(row) {
        *entry += factor * value;
    }
}

/// The sum of rows, each times its factor.
#[inline(always)]
fn combine<const M: usize, const N: usize>(factors: &[f64; M], rows: &[[f64; N]; M]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (factor, row) in factors.iter().zip(rows) {
        add_multiple(&mut sum, *factor, row);
    }
    sum
}
