//! The main loop of the solver.

use alloc::vec::Vec;

use super::barrier::{Elastic, LAST_BARRIER};
use super::block::Constants;
use super::filter::{Filter, Measures};
use super::iterate::Iterate;
use super::newton::{Fractions, Newton};
use super::residual::Residual;
use super::sides::Sides;
use super::start;
use crate::dynamics::PlanarState;
use crate::problem::Condition;
use crate::{LANDING_MISS, Problem, Solution, SolveStatus, WarmStart};

/// Barrier of a cold solve's first iteration. It is of the order of the conditions' price, so that nothing is active
/// yet.
const COLD_BARRIER: f64 = 1e3;

/// When limits and conditions change sides, the barrier is raised at least to this value and by this factor.
pub(super) const RAISED_BARRIER: f64 = 1e-2;
const RAISING_FACTOR: f64 = 100.0;

/// Largest number of times that the barrier is raised.
const RAISES: u32 = 4;

/// If less than this fraction of a step is possible, primal or dual, the iterate is jammed between limits.
const JAMMED: f64 = 0.1;

/// A barrier problem is solved when its residual is at most this multiple of the barrier.
const BARRIER_TOLERANCE: f64 = 30.0;

/// Factor and exponent of the barrier's decrease; the faster one applies.
const BARRIER_FACTOR: f64 = 0.2;
const BARRIER_EXPONENT: f64 = 1.8;

/// Bounds of the fraction of a slack or multiplier that a step must leave; between them it equals the barrier.
const KEPT_LEAST: f64 = 1e-3;
const KEPT_MOST: f64 = 1e-2;

/// Fractions of the dynamics' curvature that are tried until the inertia is right, beginning with the one before the
/// last that was right. Without the curvature the Hessian is that of Gauss and Newton, whose inertia is always right.
pub(super) const CURVATURE_SHARES: [f64; 3] = [1.0, 0.5, 0.0];

/// Shortest fraction that is tried of the step that the slacks allow.
const SHORTEST_STEP: f64 = 1.0 / 1024.0;

/// A step of the inputs this small (rad) is taken without a test: the objective's rounding error is larger than its
/// possible decrease.
const TINY_STEP_RAD: f64 = 1e-7;

/// Bends of the cold guesses' pitch, in amplitudes. Those after the first two are only tried if the first two do not
/// land.
const BENDS: [f64; 4] = [1.0, -1.0, 3.3, -3.3];
const NARROW_BENDS: usize = 2;

/// How a solve from one start ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct SolveEnd {
    pub(super) status: SolveStatus,
    pub(super) iterations: usize,
    pub(super) sweeps: u32,
    pub(super) residual: Residual,
    /// The largest miss of a condition.
    pub(super) miss: f64,
}

impl SolveEnd {
    /// Nothing finite was found.
    pub(super) const BAD: Self = Self {
        status: SolveStatus::BadInput,
        iterations: 0,
        sweeps: 0,
        residual: Residual::NONE,
        miss: f64::INFINITY,
    };

    fn lands(&self) -> bool {
        self.status == SolveStatus::Converged && self.miss <= LANDING_MISS
    }
}

/// Buffers of a solve, kept so that the next solve does not allocate. The result does not depend on them.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    pub(super) conditions: Vec<Condition>,
    pub(super) current: Iterate,
    pub(super) trial: Iterate,
    other: Iterate,
    pub(super) newton: Newton,
    pub(super) sides: Sides,
    filter: Filter,
    pub(super) scratch: Vec<[f64; 6]>,
}

impl Workspace {
    /// Solves a problem with at least one interval into `solution`, except its bound of the touchdown speed.
    pub fn solve(&mut self, problem: &Problem, warm: Option<&WarmStart>, solution: &mut Solution) {
        self.resize(problem);
        let cap = problem.solver.max_iterations;
        let Some(warm) = warm else {
            let outcome = self.cold(problem, cap);
            self.report(problem, outcome, solution);
            return;
        };
        let outcome = self.warm(problem, warm, cap);
        self.report(problem, outcome, solution);
    }

    pub(super) fn resize(&mut self, problem: &Problem) {
        self.conditions.clear();
        problem.append_conditions(&mut self.conditions);
        let (intervals, conditions) = (problem.intervals(), self.conditions.len());
        for iterate in [&mut self.current, &mut self.trial, &mut self.other] {
            iterate.resize(intervals, conditions);
        }
        self.newton.resize(intervals, conditions);
        self.sides.resize(intervals, conditions);
        self.scratch.resize(intervals + 1, [0.0; 6]);
    }

    /// Solves from bent guesses with at most `cap` iterations each; `current` is then the best result.
    pub(super) fn cold(&mut self, problem: &Problem, cap: usize) -> SolveEnd {
        let mut best: Option<(SolveEnd, f64)> = None;
        let (mut iterations, mut sweeps) = (0, 0);
        for (index, bend) in BENDS.into_iter().enumerate() {
            if index == NARROW_BENDS && best.is_some_and(|(outcome, _)| outcome.lands()) {
                break;
            }
            let amplitude_rad = bend * problem.solver.guess_amplitude_rad;
            start::cold(problem, &self.conditions, amplitude_rad, COLD_BARRIER, &mut self.current);
            let mut outcome = self.descend(problem, COLD_BARRIER, cap);
            iterations += outcome.iterations;
            sweeps += outcome.sweeps;
            if outcome.status != SolveStatus::Converged {
                self.current.roll_out(problem);
            }
            outcome.miss = self.current.worst_violation(&self.conditions);
            let price = self.current.price(problem, &self.conditions);
            if best.is_none_or(|(_, least)| price < least) && price.is_finite() {
                best = Some((outcome, price));
                core::mem::swap(&mut self.current, &mut self.other);
            }
        }
        core::mem::swap(&mut self.current, &mut self.other);
        let best = best.map_or(SolveEnd::BAD, |(outcome, _)| outcome);
        SolveEnd { iterations, sweeps, ..best }
    }

    /// Runs Newton iterations from `current`, which is then the last iterate.
    pub(super) fn descend(&mut self, problem: &Problem, first_barrier: f64, cap: usize) -> SolveEnd {
        let constants = Constants::of(&problem.model, problem.step_s);
        let tolerance = problem.solver.kkt_tolerance;
        let mut barrier = first_barrier;
        let (mut iterations, mut sweeps, mut raises, mut share) = (0, 0, 0, 0_usize);
        self.current.evaluate::<true>(&constants, problem);
        let mut residual = self.residual(problem);
        self.filter = Filter::starting_at(residual.infeasibility);
        let status = loop {
            if !residual.largest(0.0).is_finite() {
                break SolveStatus::BadInput;
            }
            if residual.largest(0.0) <= tolerance {
                break SolveStatus::Converged;
            }
            if iterations >= cap {
                break SolveStatus::IterationLimit;
            }
            iterations += 1;

            while barrier > LAST_BARRIER && residual.largest(barrier) <= BARRIER_TOLERANCE * barrier {
                let faster = libm::pow(barrier, BARRIER_EXPONENT);
                barrier = (BARRIER_FACTOR * barrier).min(faster).max(LAST_BARRIER);
                self.filter.clear();
            }
            self.newton.assemble(problem, &self.conditions, &self.current, barrier);
            let first = share.saturating_sub(1);
            let right = (first..CURVATURE_SHARES.len()).find(|tried| {
                sweeps += 1;
                self.newton.factorise(problem, &self.current, CURVATURE_SHARES[*tried])
            });
            let Some(right) = right else {
                break SolveStatus::SubproblemFailed;
            };
            share = right;
            self.newton.solve(problem, &self.conditions, &self.current, barrier);

            let kept = barrier.clamp(KEPT_LEAST, KEPT_MOST);
            let fractions = self.newton.fractions(problem, &self.current, kept);
            let jammed =
                raises == 0 && barrier < RAISED_BARRIER && fractions.primal.min(fractions.dual) < JAMMED;
            if jammed || !self.advance(problem, &constants, barrier, fractions, residual.infeasibility) {
                if raises >= RAISES {
                    break SolveStatus::Stalled;
                }
                raises += 1;
                barrier = RAISED_BARRIER.max(RAISING_FACTOR * barrier);
                start::raise(problem, &self.conditions, barrier, &mut self.current);
                self.current.evaluate::<true>(&constants, problem);
                residual = self.residual(problem);
                self.filter = Filter::starting_at(residual.infeasibility);
            } else {
                residual = self.residual(problem);
            }
        };
        SolveEnd { status, iterations, sweeps, residual, ..SolveEnd::BAD }
    }

    /// Line search along the step from `current`. Returns whether a point was accepted; it is then `current`.
    fn advance(
        &mut self,
        problem: &Problem,
        constants: &Constants,
        barrier: f64,
        fractions: Fractions,
        infeasibility: f64,
    ) -> bool {
        let slope = self.newton.slope(problem, &self.current, barrier);
        let objective = self.current.barrier_objective(problem, barrier);
        let now = Measures { infeasibility, objective };
        let tiny = self.newton.largest_input_step() <= TINY_STEP_RAD;
        let mut share = 1.0;
        while share >= SHORTEST_STEP {
            let tried = Fractions { primal: share * fractions.primal, dual: fractions.dual };
            self.newton.take(&self.conditions, &self.current, tried, &mut self.trial);
            self.trial.evaluate::<true>(constants, problem);
            let trial = Measures {
                infeasibility: self.trial.infeasibility(),
                objective: self.trial.barrier_objective(problem, barrier),
            };
            if self.filter.accepts(now, trial, slope, tried.primal) || tiny && trial.is_finite() {
                core::mem::swap(&mut self.current, &mut self.trial);
                return true;
            }
            share *= 0.5;
        }
        false
    }

    pub(super) fn residual(&mut self, problem: &Problem) -> Residual {
        Residual::of(problem, &self.conditions, &self.current, &mut self.scratch)
    }

    /// Writes `current` into the solution. If it did not converge, the path is rolled out from its inputs.
    fn report(&mut self, problem: &Problem, outcome: SolveEnd, solution: &mut Solution) {
        let current = &mut self.current;
        if outcome.status != SolveStatus::Converged {
            current.roll_out(problem);
        }
        let SolveEnd { status, iterations, sweeps, residual, .. } = outcome;
        solution.clear();
        solution.iterations = iterations;
        solution.qp_iterations = sweeps;
        let cost = current.cost(problem);
        if !cost.is_finite() {
            solution.status = SolveStatus::BadInput;
            return;
        }
        solution.status = status;
        solution.cost = cost;
        solution.price = current.price(problem, &self.conditions);
        solution.kkt_stationarity = residual.stationarity;
        solution.kkt_feasibility = residual.defect.max(residual.complementarity(0.0));
        solution.condition_miss = current.worst_violation(&self.conditions);
        solution.states.extend(current.states.iter().map(|state| PlanarState::from_array(*state)));
        solution.inputs_rad.extend(&current.inputs_rad);
        solution.costates.extend(&current.costates);
        solution.limit_multipliers.extend(current.limits.iter().map(|limits| [limits.lower, limits.upper]));
        let (end, floor) = current.elastics.split_at(problem.end_conditions_len());
        solution.end_multipliers.extend(end.iter().map(Elastic::settled_multiplier));
        solution.floor_multipliers.extend(floor.iter().map(Elastic::settled_multiplier));
    }
}
