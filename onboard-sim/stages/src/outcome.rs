//! How a solve ended, and what it found.

use crate::barrier::Elastic;
use crate::model::Model;
use crate::residual::Residual;
use crate::solver::Workspace;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The optimality conditions hold to the tolerance.
    Converged,
    /// The iteration cap ended the solve; the best iterate is returned.
    IterationLimit,
    /// No step improved the best iterate any more before the tolerance was reached.
    Stalled,
    /// The quadratic subproblem could not be solved; the best iterate is returned.
    SubproblemFailed,
    /// A number of the problem, the start or the path is not finite.
    NotFinite,
}

/// The outcome of a solve. The workspace has its path and multipliers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub status: Status,
    /// Newton iterations, over all starts tried.
    pub iterations: usize,
    /// Linear systems factorised over all iterations.
    pub factorisations: u32,
    /// The cost without penalties. If it is not finite, nothing else of the path is usable.
    pub cost: f64,
    /// The cost plus the price of every broken condition.
    pub price: f64,
    /// Largest component of the Lagrangian's gradient by states and inputs.
    pub stationarity: f64,
    /// Largest defect of the dynamics or product of a slack and its multiplier.
    pub feasibility: f64,
    /// Largest miss of a condition.
    pub miss: f64,
}

/// How a solve from one start ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SolveEnd {
    pub(crate) status: Status,
    pub(crate) iterations: usize,
    pub(crate) sweeps: u32,
    pub(crate) residual: Residual,
    /// The largest miss of a condition.
    pub(crate) miss: f64,
}

impl SolveEnd {
    /// Nothing finite was found.
    pub(crate) const BAD: Self = Self {
        status: Status::NotFinite,
        iterations: 0,
        sweeps: 0,
        residual: Residual::NONE,
        miss: f64::INFINITY,
    };

    pub(crate) fn meets(&self, acceptable_miss: f64) -> bool {
        self.status == Status::Converged && self.miss <= acceptable_miss
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// The states of the last solve, one more than inputs.
    pub fn states(&self) -> &[[f64; NX]] {
        &self.current.states
    }

    /// The inputs of the last solve.
    pub fn inputs(&self) -> &[[f64; NU]] {
        &self.current.inputs
    }

    /// Multiplier of the dynamics into each node, one more than inputs; the first is not used.
    pub fn costates(&self) -> &[[f64; NX]] {
        &self.current.costates
    }

    /// Multipliers of the lower and upper limit of each interval's inputs.
    pub fn limit_multipliers(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; NU]> {
        self.current.limits.iter().map(|limits| limits.map(|limit| [limit.lower, limit.upper]))
    }

    /// Multiplier of each condition.
    pub fn condition_multipliers(&self) -> impl ExactSizeIterator<Item = f64> {
        self.current.elastics.iter().map(Elastic::settled_multiplier)
    }

    /// The outcome, for `current`. If it did not converge, the path is rolled out from its inputs.
    pub(crate) fn report(&mut self, model: &M, end: SolveEnd) -> Outcome {
        let current = &mut self.current;
        if end.status != Status::Converged {
            current.roll_out(model);
        }
        let SolveEnd { status, iterations, sweeps, residual, .. } = end;
        let cost = current.cost(model);
        Outcome {
            status: if cost.is_finite() { status } else { Status::NotFinite },
            iterations,
            factorisations: sweeps,
            cost,
            price: current.price(model, &self.conditions),
            stationarity: residual.stationarity,
            feasibility: residual.defect.max(residual.complementarity(0.0)),
            miss: current.worst_violation(&self.conditions),
        }
    }
}
