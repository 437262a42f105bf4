//! How much a workspace may still work: a bound on the time of several solves together that no clock decides.

use crate::model::Model;
use crate::solver::Workspace;

/// Passes that are left. A pass is one interval evaluated with its derivatives, or eliminated by a backward sweep: nearly all
/// of a solve's time is in these two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Allowance {
    /// `None` without a bound.
    left: Option<usize>,
}

impl Allowance {
    pub(crate) fn spend(&mut self, passes: usize) {
        self.left = self.left.map(|left| left.saturating_sub(passes));
    }

    pub(crate) fn is_spent(&self) -> bool {
        self.left == Some(0)
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Allows the coming solves so many passes together, or any number; a pass is one interval evaluated with its derivatives, or
    /// eliminated by a backward sweep. An iteration that has begun is finished. A solve without passes ends
    /// at its iteration limit: cold with its first guess, warm with the start's inputs.
    pub fn allow(&mut self, passes: Option<usize>) {
        self.allowance = Allowance { left: passes };
    }

    /// Whether nothing is left of what was allowed.
    pub fn is_spent(&self) -> bool {
        self.allowance.is_spent()
    }
}
