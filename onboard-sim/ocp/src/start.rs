//! The start of a solve: cold, from an earlier solution, or again with a larger barrier; and its
//! end.

use serde::Serialize;

use crate::barrier::{Elastic, Limits};
use crate::iterate::{Iterate, Residual};
use crate::model::{Condition, Model};
use crate::solver::Workspace;

/// An earlier solution, shifted to the present. Inputs alone are enough; they are then rolled out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start<'a, const NX: usize, const NU: usize> {
    /// The states, one more than inputs; empty if unknown.
    pub states: &'a [[f64; NX]],
    /// The inputs of each interval. Another number than that of the intervals makes a cold solve.
    pub inputs: &'a [[f64; NU]],
    /// Multiplier of the dynamics into each node, one more than inputs, the first unused; empty if
    /// unknown.
    pub costates: &'a [[f64; NX]],
    /// Multipliers of the lower and upper limit of each interval's inputs; empty if unknown.
    pub limit_multipliers: &'a [[[f64; 2]; NU]],
    /// Multiplier of each condition; those left out are zero.
    pub condition_multipliers: &'a [f64],
}

/// A cold start from the model's guess. Costates are zero, so the first Hessian is that of Gauss
/// and Newton.
pub(crate) fn cold<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    conditions: &[Condition],
    index: usize,
    barrier: f64,
    start: &mut Iterate<M, NX, NU>,
) {
    model.guess(index, &mut start.states, &mut start.inputs);
    start.costates.fill([0.0; NX]);
    start.centre_limits(model, barrier);
    let penalty = model.settings().penalty;
    for (elastic, condition) in start.elastics.iter_mut().zip(conditions) {
        *elastic = Elastic::central(condition.value(&start.states), condition.equality, penalty, barrier);
    }
}

/// A start from an earlier solution, shifted to the present. All states except the first stay the
/// same. So the difference between the expected and the present state becomes one defect, and no
/// limit or condition jumps. If states, costates or limit multipliers are missing or not finite,
/// the inputs are rolled out. Returns whether all were there.
pub(crate) fn warm<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    conditions: &[Condition],
    warm: &Start<NX, NU>,
    barrier: f64,
    start: &mut Iterate<M, NX, NU>,
) -> bool {
    let ranges = model.input_ranges();
    let penalty = model.settings().penalty;
    let count = model.intervals();
    start.states[0] = model.initial();
    for (inputs, from) in start.inputs.iter_mut().zip(warm.inputs) {
        for i in 0..NU {
            inputs[i] = ranges[i].within(if from[i].is_finite() { from[i] } else { 0.0 });
        }
    }
    let complete = warm.states.len() == count + 1
        && warm.costates.len() == count + 1
        && warm.limit_multipliers.len() == count
        && warm.states.as_flattened().iter().all(|value| value.is_finite())
        && warm.costates.as_flattened().iter().all(|value| value.is_finite())
        && warm.limit_multipliers.iter().flatten().flatten().all(|value| value.is_finite() && *value > 0.0);
    if complete {
        start.states[1..].copy_from_slice(&warm.states[1..]);
        start.costates.copy_from_slice(warm.costates);
        for (limits, multipliers) in start.limits.iter_mut().zip(warm.limit_multipliers) {
            *limits = multipliers.map(|[lower, upper]| Limits { lower, upper });
        }
    } else {
        start.roll_out(model);
        start.costates.fill([0.0; NX]);
        start.centre_limits(model, barrier);
    }
    let known = warm.condition_multipliers.iter().chain(core::iter::repeat(&0.0));
    let known = known.map(|value| if value.is_finite() { *value } else { 0.0 });
    for ((elastic, condition), multiplier) in start.elastics.iter_mut().zip(conditions).zip(known) {
        let value = condition.value(&start.states);
        *elastic = Elastic::warm(value, multiplier, condition.equality, penalty, barrier);
    }
    complete
}

/// The same states with slacks and multipliers raised to a larger barrier, because too many limits
/// and conditions change sides for the old one.
pub(crate) fn raise<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    conditions: &[Condition],
    barrier: f64,
    start: &mut Iterate<M, NX, NU>,
) {
    let ranges = model.input_ranges();
    for (inputs, limits) in start.inputs.iter_mut().zip(&mut start.limits) {
        for i in 0..NU {
            inputs[i] = limits[i].raise(inputs[i], &ranges[i], barrier);
        }
    }
    for (elastic, condition) in start.elastics.iter_mut().zip(conditions) {
        *elastic = elastic.raised(condition.value(&start.states), barrier);
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Iterate<M, NX, NU> {
    /// Puts the limits' multipliers on the central path.
    fn centre_limits(&mut self, model: &M, barrier: f64) {
        let ranges = model.input_ranges();
        for (limits, input) in self.limits.iter_mut().zip(&self.inputs) {
            for i in 0..NU {
                limits[i] = Limits::central(input[i], &ranges[i], barrier);
            }
        }
    }
}

// Outcome of a solve, with its result.

/// How a solve ended, with its number on the wire (TD_SOLVER_STATUS).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum Status {
    /// Nothing was solved.
    #[default]
    NotRun = 0,
    /// The optimality conditions hold to the tolerance.
    Converged = 1,
    /// The iteration cap ended the solve; the best iterate is returned.
    IterationLimit = 2,
    /// The allowance ([`Workspace::allow`]) ended the solve; the best iterate is returned.
    WorkLimit = 6,
    /// No step improved the best iterate any more before the tolerance was reached.
    Stalled = 3,
    /// The quadratic subproblem could not be solved; the best iterate is returned.
    SubproblemFailed = 4,
    /// A number of the problem, the start or the path is not finite.
    NotFinite = 5,
}

impl Status {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotRun => "not run",
            Self::Converged => "converged",
            Self::IterationLimit => "iteration limit",
            Self::WorkLimit => "work limit",
            Self::Stalled => "stalled",
            Self::SubproblemFailed => "subproblem failed",
            Self::NotFinite => "not finite",
        }
    }
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
    /// The cost plus the penalty of every broken condition.
    pub merit: f64,
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
            merit: current.merit(model, &self.conditions),
            stationarity: residual.stationarity,
            feasibility: residual.defect.max(residual.complementarity(0.0)),
            miss: current.worst_violation(&self.conditions),
        }
    }
}
