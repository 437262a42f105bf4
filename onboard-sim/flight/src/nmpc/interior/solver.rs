//! The main loop.

use super::barrier::Elastic;
use super::block::Constants;
use super::filter::{Filter, Measures};
use super::iterate::Iterate;
use super::newton::{Fractions, Newton};
use super::residual::Residual;
use super::sides::Sides;
use super::start;
use crate::dynamics::PlanarState;
use crate::nmpc::problem::Condition;
use crate::nmpc::{Problem, Solution, SolveStatus, WarmStart};

/// Barrier of a cold solve's first iteration: of the order of the conditions' price, so that nothing is active yet.
const COLD_BARRIER: f64 = 1e3;

/// Barrier of a warm solve, and the last of every solve.
pub(super) const LAST_BARRIER: f64 = 1e-8;

/// Barrier to which a solve whose limits and conditions change sides is raised at least, and by at least which factor.
pub(super) const RAISED_BARRIER: f64 = 1e-2;
const RAISING_FACTOR: f64 = 100.0;

/// Most times that the barrier is raised.
const RAISES: u32 = 4;

/// A step that can be followed less far than this, in primal or dual, is jammed between limits.
const JAMMED: f64 = 0.1;

/// A barrier problem is solved when its residual is at most this many barriers.
const BARRIER_TOLERANCE: f64 = 30.0;

/// Factor and exponent by which the barrier falls, whichever is faster.
const BARRIER_FACTOR: f64 = 0.2;
const BARRIER_EXPONENT: f64 = 1.8;

/// Share of a slack or multiplier that a step leaves: the barrier, between these.
const KEPT_LEAST: f64 = 1e-3;
const KEPT_MOST: f64 = 1e-2;

/// Shares of the dynamics' curvature that are tried until the inertia is right, from the one before the last that was;
/// without it, the Hessian is that of Gauss and Newton and always is.
pub(super) const CURVATURE_SHARES: [f64; 3] = [1.0, 0.5, 0.0];

/// Shortest fraction of a step that is tried, of what the slacks allow.
const SHORTEST_STEP: f64 = 1.0 / 1024.0;

/// A step of the inputs this small (rad) is taken unasked: the objective's rounding is larger than what it could win.
const TINY_STEP_RAD: f64 = 1e-7;

/// Bends of the cold guesses' pitch, in amplitudes; those after the first two are tried where these do not land.
const BENDS: [f64; 4] = [1.0, -1.0, 3.3, -3.3];
const NARROW_BENDS: usize = 2;

/// Largest miss of a condition of a path that lands, m, rad, m/s or rad/s.
const LANDING_MISS: f64 = 1e-3;

/// How a solve from one start ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outcome {
    pub(super) status: SolveStatus,
    pub(super) iterations: usize,
    pub(super) sweeps: u32,
    pub(super) residual: Residual,
    /// The largest miss of a condition.
    pub(super) miss: f64,
}

impl Outcome {
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

/// Room for a solve, kept from one to the next so that the next does not allocate. It holds nothing that a solve
/// depends on.
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
    /// Solves a problem with at least one interval into `solution`, all but its bound of the touchdown speed.
    pub(crate) fn solve(&mut self, problem: &Problem, warm: Option<&WarmStart>, solution: &mut Solution) {
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

    /// Solves from bent guesses, at most `cap` iterations each; the best result ends as `current`.
    pub(super) fn cold(&mut self, problem: &Problem, cap: usize) -> Outcome {
        let mut best: Option<(Outcome, f64)> = None;
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
        let best = best.map_or(Outcome::BAD, |(outcome, _)| outcome);
        Outcome { iterations, sweeps, ..best }
    }

    /// Newton iterations from `current`, which ends as the last iterate.
    pub(super) fn descend(&mut self, problem: &Problem, first_barrier: f64, cap: usize) -> Outcome {
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
        Outcome { status, iterations, sweeps, residual, ..Outcome::BAD }
    }

    /// Line search along the step from `current`; whether a point was accepted, which then is `current`.
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

    /// Writes `current` out; what did not converge as the path its inputs lead to.
    fn report(&mut self, problem: &Problem, outcome: Outcome, solution: &mut Solution) {
        let current = &mut self.current;
        if outcome.status != SolveStatus::Converged {
            current.roll_out(problem);
        }
        let Outcome { status, iterations, sweeps, residual, .. } = outcome;
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
