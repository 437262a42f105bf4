//! Interface of a step to the solver's tests.

use core::array::from_fn;

use super::Sweep;
use crate::intervals::{Curvature as _, Interval as _, Intervals as _};
use crate::iterate::Iterate;
use crate::model::Model;

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Sweep<M, NX, NU> {
    /// The optimality residuals of the inputs of interval `k` after the step: only rounding, unless
    /// the sweeps are wrong.
    pub(crate) fn input_residual(&self, iterate: &Iterate<M, NX, NU>, k: usize) -> [f64; NU] {
        let interval = iterate.intervals.interval(k);
        let (_, turned) = interval.curve(self.share, &self.states[k], &self.inputs[k]);
        let (_, pulled) = interval.pull(&self.costates[k + 1]);
        let (curvature, slope) = &self.input_terms[k];
        let bent = curvature.times(&self.inputs[k]);
        from_fn(|i| bent[i] + slope[i] + turned[i] + pulled[i])
    }
}
