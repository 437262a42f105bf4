//! The main loop of the solver, and how much it may work.

use alloc::vec::Vec;

use crate::barrier::LAST_BARRIER;
use crate::intervals::Intervals as _;
use crate::iterate::{Iterate, Residual};
use crate::model::{Condition, Model};
use crate::newton::{Filter, Fractions, Measures, Newton};
use crate::sides::Sides;
use crate::start;
use crate::start::{Outcome, SolveEnd, Start, Status};

/// When limits and conditions change sides, the barrier is raised at least to this value and by
/// this factor.
pub(crate) const RAISED_BARRIER: f64 = 1e-2;
const RAISING_FACTOR: f64 = 100.0;

/// Largest number of times that the barrier is raised.
const RAISES: u32 = 4;

/// If less than this fraction of a step is possible, primal or dual, the iterate is jammed between
/// limits.
const STEP_FRACTION_MIN: f64 = 0.1;

/// Consecutive full steps with less than the dynamics' curvature after which the descent creeps
/// along a saddle, and the barrier is raised. With fewer, the steps beside some saddles do not
/// leave them: with six, two of 30,000 cold starts of the landing paper's problem end at their cap,
/// with eight none.
const CREEPS: u32 = 8;

/// A barrier problem is solved when its residual is at most this multiple of the barrier.
const BARRIER_TOLERANCE: f64 = 30.0;

/// Factor and exponent of the barrier's decrease; the faster one applies.
const BARRIER_FACTOR: f64 = 0.2;
const BARRIER_EXPONENT: f64 = 1.8;

/// Bounds of the fraction of a slack or multiplier that a step must leave; between them it equals
/// the barrier.
const MIN_REMAINING: f64 = 1e-4;
const MAX_REMAINING: f64 = 1e-2;

/// Fractions of the dynamics' curvature tried until the inertia is right, beginning with the one
/// before the last right one, or after a wrong one with the right one. Without the curvature the
/// Hessian is that of Gauss and Newton, whose inertia is always right. The second is nearly full:
/// with half of it at once, landings in space creep, and take a fifth more iterations.
pub(crate) const CURVATURE_SHARES: [f64; 4] = [1.0, 0.9, 0.5, 0.0];

/// Shortest fraction that is tried of the step that the slacks allow.
const SHORTEST_STEP: f64 = 1.0 / 1024.0;

/// Buffers of a solve, reused so that the next solve does not allocate. The result does not depend
/// on them, except on the remaining [allowance](Self::allow).
#[derive(Debug, Clone)]
pub struct Workspace<M: Model<NX, NU>, const NX: usize, const NU: usize> {
    pub(crate) conditions: Vec<Condition>,
    pub(crate) current: Iterate<M, NX, NU>,
    pub(crate) trial: Iterate<M, NX, NU>,
    /// The best result of a cold solve so far; its intervals have no room.
    best: Iterate<M, NX, NU>,
    pub(crate) newton: Newton<M, NX, NU>,
    pub(crate) sides: Sides<NU>,
    filter: Filter,
    pub(crate) scratch: Vec<[f64; NX]>,
    pub(crate) allowance: Allowance,
}

empty!(Workspace { conditions, current, trial, best, newton, sides, filter, scratch, allowance });

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Solves a problem, warm if there is a start with as many inputs as the problem has intervals,
    /// otherwise cold. It does not allocate if a problem of this length was solved before.
    pub fn solve(&mut self, model: &M, start: Option<&Start<NX, NU>>) -> Outcome {
        self.resize(model);
        let cap = model.settings().max_iterations;
        let end = match start.filter(|start| start.inputs.len() == model.intervals()) {
            Some(start) => self.warm(model, start, cap),
            None => self.cold(model, cap),
        };
        self.report(model, end)
    }

    pub(crate) fn resize(&mut self, model: &M) {
        self.conditions.clear();
        model.append_conditions(&mut self.conditions);
        let (intervals, conditions) = (model.intervals(), self.conditions.len());
        for iterate in [&mut self.current, &mut self.trial] {
            iterate.resize(intervals, conditions);
            iterate.intervals.resize(intervals);
        }
        self.best.resize(intervals, conditions);
        self.newton.resize(intervals, conditions);
        self.sides.resize(intervals, conditions);
        self.scratch.resize(intervals + 1, [0.0; NX]);
    }

    /// Solves from the model's guesses with at most `cap` iterations each; `current` is then the
    /// best result.
    pub(crate) fn cold(&mut self, model: &M, cap: usize) -> SolveEnd {
        let mut best: Option<(SolveEnd, f64)> = None;
        let (mut iterations, mut sweeps) = (0, 0);
        let settings = model.settings();
        let barrier = settings.first_barrier;
        for index in 0..settings.guesses + settings.spare_guesses {
            let met = best.is_some_and(|(outcome, _)| outcome.meets(settings.acceptable_miss));
            if index == settings.guesses && met || best.is_some() && self.allowance.is_spent() {
                break;
            }
            start::cold(model, &self.conditions, index, barrier, &mut self.current);
            let mut outcome = self.descend(model, barrier, cap);
            iterations += outcome.iterations;
            sweeps += outcome.sweeps;
            if outcome.status != Status::Converged {
                self.current.roll_out(model);
            }
            outcome.miss = self.current.worst_violation(&self.conditions);
            let merit = self.current.merit(model, &self.conditions);
            if best.is_none_or(|(_, least)| merit < least) && merit.is_finite() {
                best = Some((outcome, merit));
                self.best.move_to(&self.current);
            }
        }
        self.current.move_to(&self.best);
        let best = best.map_or(SolveEnd::BAD, |(outcome, _)| outcome);
        SolveEnd { iterations, sweeps, ..best }
    }

    /// Runs Newton iterations from `current`, which is then the last iterate.
    pub(crate) fn descend(&mut self, model: &M, first_barrier: f64, cap: usize) -> SolveEnd {
        let tolerance = model.settings().tolerance;
        let mut barrier = first_barrier;
        let (mut iterations, mut sweeps, mut raises, mut crept, mut first) = (0, 0, 0, 0, 0_usize);
        self.differentiate(model);
        let mut residual = self.residual(model);
        self.filter = Filter::starting_at(residual.infeasibility);
        let status = loop {
            if !residual.largest(0.0).is_finite() {
                break Status::NotFinite;
            }
            if residual.largest(0.0) <= tolerance {
                break Status::Converged;
            }
            if self.allowance.is_spent() {
                break Status::WorkLimit;
            }
            if iterations >= cap {
                break Status::IterationLimit;
            }
            iterations += 1;

            while barrier > LAST_BARRIER && residual.largest(barrier) <= BARRIER_TOLERANCE * barrier {
                let faster = libm::pow(barrier, BARRIER_EXPONENT);
                barrier = (BARRIER_FACTOR * barrier).min(faster).max(LAST_BARRIER);
                self.filter.clear();
            }
            self.newton.assemble(model, &self.conditions, &self.current, barrier);
            let right = (first..CURVATURE_SHARES.len()).find(|tried| {
                sweeps += 1;
                self.allowance.spend(model.intervals());
                self.newton.sweep.backward(&self.current, CURVATURE_SHARES[*tried])
            });
            let Some(right) = right else {
                break Status::SubproblemFailed;
            };
            first = if right > first { right } else { right.saturating_sub(1) };
            self.newton.solve(model, &self.conditions, &self.current, barrier);

            let remaining = barrier.clamp(MIN_REMAINING, MAX_REMAINING);
            let fractions = self.newton.fractions(model, &self.current, remaining);
            let jammed = raises == 0
                && barrier < RAISED_BARRIER
                && fractions.primal.min(fractions.dual) < STEP_FRACTION_MIN;
            let full = fractions.primal.min(fractions.dual) >= 1.0;
            crept = if right > 0 && full { crept + 1 } else { 0 };
            let creeps = crept >= CREEPS && raises < RAISES;
            if !jammed && !creeps && self.advance(model, barrier, fractions, residual.infeasibility) {
                residual = self.residual(model);
                continue;
            }
            if raises >= RAISES {
                break Status::Stalled;
            }
            (raises, crept) = (raises + 1, 0);
            barrier = RAISED_BARRIER.max(RAISING_FACTOR * barrier);
            start::raise(model, &self.conditions, barrier, &mut self.current);
            self.differentiate(model);
            residual = self.residual(model);
            self.filter = Filter::starting_at(residual.infeasibility);
        };
        SolveEnd { status, iterations, sweeps, residual, ..SolveEnd::BAD }
    }

    /// Line search along the step from `current`. Returns whether a point was accepted; it is then
    /// `current`.
    fn advance(&mut self, model: &M, barrier: f64, fractions: Fractions, infeasibility: f64) -> bool {
        let slope = self.newton.slope(model, &self.current, barrier);
        let objective = self.current.barrier_objective(model, barrier);
        let now = Measures { infeasibility, objective };
        let mut share = 1.0;
        while share >= SHORTEST_STEP {
            let tried = Fractions { primal: share * fractions.primal, dual: fractions.dual };
            self.newton.take(&self.conditions, &self.current, tried, &mut self.trial);
            self.allowance.spend(model.intervals());
            self.trial.evaluate(model, true);
            let trial = Measures {
                infeasibility: self.trial.infeasibility(),
                objective: self.trial.barrier_objective(model, barrier),
            };
            let accepted = self.filter.accepts(now, trial, slope, tried.primal)
                || share >= 1.0 && self.filter.tolerates(now, trial);
            if accepted {
                core::mem::swap(&mut self.current, &mut self.trial);
                return true;
            }
            share *= 0.5;
        }
        false
    }

    /// Evaluates `current` with its derivatives.
    pub(crate) fn differentiate(&mut self, model: &M) {
        self.allowance.spend(model.intervals());
        self.current.evaluate(model, true);
    }

    pub(crate) fn residual(&mut self, model: &M) -> Residual {
        Residual::of(model, &self.conditions, &self.current, &mut self.scratch)
    }
}

// How much a workspace may still work: a bound on the time of several solves together that no clock
// decides.

/// Passes made and allowed. A pass is one interval evaluated with its derivatives, or eliminated by
/// a backward sweep: nearly all of a solve's time is in these two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Allowance {
    made: usize,
    /// `None` without a bound.
    most: Option<usize>,
}

impl Allowance {
    pub(crate) fn spend(&mut self, passes: usize) {
        self.made += passes;
    }

    pub(crate) fn is_spent(&self) -> bool {
        self.most.is_some_and(|most| self.made >= most)
    }
}

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Allows the next solves this many passes together, or any number; a pass is one interval
    /// evaluated with its derivatives, or eliminated by a backward sweep. An iteration that has
    /// begun is finished. A solve without passes ends with [`Status::WorkLimit`]: cold with its
    /// first guess, warm with the start's inputs.
    pub fn allow(&mut self, passes: Option<usize>) {
        self.allowance = Allowance { made: 0, most: passes };
    }

    /// Passes made since [`allow`](Self::allow).
    pub fn passes(&self) -> usize {
        self.allowance.made
    }

    /// Whether the allowance is used up.
    pub fn is_spent(&self) -> bool {
        self.allowance.is_spent()
    }
}

// The Lagrangian of a problem at the solution of another problem. By the envelope theorem, its
// derivative by a parameter of dynamics, cost or conditions equals the derivative of the optimal
// merit.

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Cost, plus costates times the defects of the dynamics, minus the conditions times their
    /// multipliers, at a solution of a problem with as many intervals; NaN if it has another
    /// number.
    pub fn lagrangian(&mut self, model: &M, solution: &Start<NX, NU>) -> f64 {
        let count = model.intervals();
        if solution.states.len() != count + 1 || solution.costates.len() != count + 1 {
            return f64::NAN;
        }
        self.resize(model);
        let point = &mut self.trial;
        point.states.copy_from_slice(solution.states);
        point.inputs.copy_from_slice(solution.inputs);
        point.costates.copy_from_slice(solution.costates);
        point.evaluate(model, false);
        let mut sum = point.cost(model);
        for k in 0..count {
            for (gap, costate) in point.defect(k).iter().zip(&point.costates[k + 1]) {
                sum += gap * costate;
            }
        }
        for (condition, multiplier) in self.conditions.iter().zip(solution.condition_multipliers) {
            sum -= multiplier * condition.value(&point.states);
        }
        sum
    }
}

// The single layers of an iteration, for benchmarks.

impl<M: Model<NX, NU>, const NX: usize, const NU: usize> Workspace<M, NX, NU> {
    /// Starts from a warm start whose length fits, and raises the barrier until the sweeps are well
    /// scaled.
    pub fn load(&mut self, model: &M, warm: &Start<NX, NU>) {
        self.resize(model);
        start::warm(model, &self.conditions, warm, LAST_BARRIER, &mut self.current);
        start::raise(model, &self.conditions, RAISED_BARRIER, &mut self.current);
    }

    /// Dynamics, first and second derivatives of every interval.
    pub fn evaluate_intervals(&mut self, model: &M) {
        self.current.evaluate(model, true);
    }

    /// One Newton step at the evaluated intervals: backward and forward sweep; whether the inertia
    /// was right.
    pub fn sweep(&mut self, model: &M) -> bool {
        self.newton.assemble(model, &self.conditions, &self.current, RAISED_BARRIER);
        let solved = self.newton.sweep.backward(&self.current, 1.0);
        self.newton.solve(model, &self.conditions, &self.current, RAISED_BARRIER);
        solved
    }
}
