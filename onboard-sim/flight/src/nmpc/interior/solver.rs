//! The main loop.

use super::barrier::{Elastic, Limits};
use super::filter::{Filter, Measures};
use super::guess;
use super::interval::Constants;
use super::iterate::Iterate;
use super::newton::{Fractions, Newton};
use super::residual::Residual;
use crate::dynamics::PlanarState;
use crate::nmpc::problem::Condition;
use crate::nmpc::{Problem, Solution, SolveStatus, WarmStart};

pub static TRACE: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);

/// Barrier of a cold solve's first iteration.
const COLD_BARRIER: f64 = 1.0;

/// Barrier of a warm solve, and the last of every solve.
const LAST_BARRIER: f64 = 1e-9;

/// A barrier problem is solved when its residual is at most this many barriers.
const BARRIER_TOLERANCE: f64 = 10.0;

/// Factor and exponent by which the barrier falls, whichever is faster.
const BARRIER_FACTOR: f64 = 0.2;
const BARRIER_EXPONENT: f64 = 1.5;

/// Least share of a slack or multiplier that a step leaves.
const KEPT: f64 = 0.01;

/// Shortest fraction of a step that is tried.
const SHORTEST_STEP: f64 = 1.0 / 1024.0;

/// A step of the inputs this small (rad) is taken unasked: the objective's rounding is larger than what it could win.
const TINY_STEP_RAD: f64 = 1e-7;

/// Damping of the inputs' curvature: first try, growth, decay from one iteration to the next, and where to give up.
const FIRST_DAMPING: f64 = 1.0;
const DAMPING_GROWTH: f64 = 8.0;
const DAMPING_DECAY: f64 = 1.0 / 3.0;
const LARGEST_DAMPING: f64 = 1e10;

pub(super) fn tune(name: &str, value: f64) -> f64 { std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(value) }

/// How a branch ended.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    status: SolveStatus,
    iterations: usize,
    sweeps: u32,
    residual: Residual,
}

/// Room for a solve, kept from one to the next so that none allocates.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    conditions: Vec<Condition>,
    current: Iterate,
    trial: Iterate,
    other: Iterate,
    newton: Newton,
    scratch: Vec<[f64; 6]>,
    filter: Filter,
}

impl Workspace {
    /// Solves a problem with at least one interval, and writes everything but the bound into `solution`.
    pub fn solve(&mut self, problem: &Problem, warm: Option<&WarmStart>, solution: &mut Solution) {
        self.conditions.clear();
        problem.append_conditions(&mut self.conditions);
        let (intervals, conditions) = (problem.intervals(), self.conditions.len());
        for iterate in [&mut self.current, &mut self.trial, &mut self.other] {
            iterate.resize(intervals, conditions);
        }
        self.newton.resize(intervals, conditions);
        self.scratch.resize(intervals + 1, [0.0; 6]);
        if let Some(warm) = warm {
            self.start_warm(problem, warm);
            let outcome = self.descend(problem, LAST_BARRIER, true);
            self.report(problem, outcome, solution);
            return;
        }
        let amplitude_rad = problem.solver.guess_amplitude_rad;
        self.start_cold(problem, amplitude_rad);
        let left = self.descend(problem, tune("MU0", COLD_BARRIER), false);
        let left_price = self.price(problem, left);
        core::mem::swap(&mut self.current, &mut self.other);
        self.start_cold(problem, -amplitude_rad);
        let right = self.descend(problem, tune("MU0", COLD_BARRIER), false);
        let mut outcome = right;
        if left_price <= self.price(problem, right) {
            core::mem::swap(&mut self.current, &mut self.other);
            outcome = left;
        }
        outcome.iterations = left.iterations + right.iterations;
        outcome.sweeps = left.sweeps + right.sweeps;
        self.report(problem, outcome, solution);
    }

    /// Cost plus the price of everything broken, of a path without defects.
    fn price(&mut self, problem: &Problem, outcome: Outcome) -> f64 {
        if outcome.status != SolveStatus::Converged {
            self.current.roll_out(problem);
        }
        let broken: f64 =
            self.conditions.iter().map(|row| row.violation(row.value(&self.current.states))).sum();
        let price = self.current.cost(problem) + problem.solver.terminal_penalty * broken;
        if price.is_finite() { price } else { f64::INFINITY }
    }

    fn start_cold(&mut self, problem: &Problem, amplitude_rad: f64) {
        let current = &mut self.current;
        guess::straight(problem, amplitude_rad, &mut current.states);
        current.inputs_rad.fill(0.0);
        current.costates.fill([0.0; 6]);
        current.limits.fill(Limits::central(0.0, problem.gimbal_limit_rad, tune("MU0", COLD_BARRIER)));
        let price = problem.solver.terminal_penalty;
        for (elastic, condition) in current.elastics.iter_mut().zip(&self.conditions) {
            let value = condition.value(&current.states);
            *elastic = Elastic::central(value, condition.equality, price, tune("MU0", COLD_BARRIER));
        }
    }

    fn start_warm(&mut self, problem: &Problem, warm: &WarmStart) {
        let limit = problem.gimbal_limit_rad;
        let price = problem.solver.terminal_penalty;
        let current = &mut self.current;
        let count = problem.intervals();
        current.states[0] = problem.initial.to_array();
        for (input, start) in current.inputs_rad.iter_mut().zip(&warm.inputs_rad) {
            *input = if start.is_finite() { inside(*start, limit) } else { 0.0 };
        }
        let complete = warm.states.len() == count + 1
            && warm.costates.len() == count + 1
            && warm.limit_multipliers.len() == count;
        if complete {
            for (state, start) in current.states.iter_mut().zip(&warm.states).skip(1) {
                *state = start.to_array();
            }
            current.costates.copy_from_slice(&warm.costates);
            for (limits, start) in current.limits.iter_mut().zip(&warm.limit_multipliers) {
                *limits = Limits { lower: start[0], upper: start[1] };
            }
        } else {
            current.roll_out(problem);
            current.costates.fill([0.0; 6]);
            for (limits, input) in current.limits.iter_mut().zip(&current.inputs_rad) {
                *limits = Limits::central(*input, limit, LAST_BARRIER);
            }
        }
        let multipliers = warm.end_multipliers.iter().chain(&warm.floor_multipliers);
        let known = multipliers.copied().filter(|value| value.is_finite()).chain(core::iter::repeat(0.0));
        for ((elastic, condition), multiplier) in
            current.elastics.iter_mut().zip(&self.conditions).zip(known)
        {
            let value = condition.value(&current.states);
            *elastic = Elastic::warm(value, multiplier, condition.equality, price, LAST_BARRIER);
        }
    }

    /// Newton iterations from `current`, which ends as the solution.
    fn descend(&mut self, problem: &Problem, first_barrier: f64, check_first: bool) -> Outcome {
        let constants = Constants::of(&problem.model, problem.step_s);
        let tolerance = problem.solver.kkt_tolerance;
        let mut barrier = first_barrier;
        let mut damping = 0.0;
        let (mut iterations, mut sweeps, mut raises) = (0, 0, 0);
        let mut residual;
        if check_first {
            self.current.evaluate::<false>(&constants, &problem.thrust_n);
            residual = self.residual(problem, 0.0);
            if residual.largest() <= tolerance {
                return Outcome { status: SolveStatus::Converged, iterations, sweeps, residual };
            }
        }
        self.current.evaluate::<true>(&constants, &problem.thrust_n);
        self.filter = Filter::starting_at(self.current.infeasibility());
        let status = loop {
            residual = self.residual(problem, 0.0);
            if !residual.largest().is_finite() {
                break SolveStatus::BadInput;
            }
            if residual.largest() <= tolerance && barrier <= LAST_BARRIER {
                break SolveStatus::Converged;
            }
            if iterations >= problem.solver.max_iterations {
                break SolveStatus::IterationLimit;
            }
            while barrier > LAST_BARRIER
                && self.residual(problem, barrier).largest() <= tune("KT",BARRIER_TOLERANCE) * barrier
            {
                barrier = (tune("KF",BARRIER_FACTOR) * barrier).min(barrier.powf(tune("KE",BARRIER_EXPONENT))).max(LAST_BARRIER);
                self.filter.clear();
            }
            iterations += 1;
            self.newton.assemble(problem, &self.conditions, &self.current, barrier);
            let mut share = 1.0;
            let shares: Vec<f64> = std::env::var("SHARES").map_or(vec![1.0,0.0], |v| v.split(',').map(|x| x.parse().unwrap()).collect());
            let mut solved=false;
            for x in shares {
                sweeps += 1;
                share = x;
                if self.newton.factorise(problem, &self.current, share) { solved=true; break; }
            }
            damping = share;
            if !solved {
                break SolveStatus::SubproblemFailed;
            }
            self.newton.solve(problem, &self.conditions, &self.current, barrier);
            if TRACE.load(std::sync::atomic::Ordering::Relaxed) {
                println!(
                    "{iterations:3} mu {barrier:.1e} cost {:.4} inf {:.2e} stat {:.2e} compl {:.2e} damp {damping:.1e} step {:.2e} y {:.3}",
                    self.current.cost(problem), self.current.infeasibility(), residual.stationarity, residual.complementarity,
                    self.newton.largest_input_step(), self.current.elastics[0].multiplier(),
                );
            }
            let keep = KEPT.min(barrier).max(tune("KEEP", 1e-3));
            let fractions = self.newton.fractions(problem, &self.current, keep);
            let jammed = fractions.primal.min(fractions.dual) < tune("JAM", 0.1);
            if barrier < tune("RAISE", 1e-3) && raises == 0 && jammed
                || !self.advance(problem, &constants, barrier, fractions)
            {
                if raises >= 4 {
                    break SolveStatus::Stalled;
                }
                raises += 1;
                barrier = self.raise(problem, &constants, barrier);
            }
        };
        Outcome { status, iterations, sweeps, residual }
    }

    /// Starts again from the current states with a larger barrier: too many limits and conditions change sides.
    fn raise(&mut self, problem: &Problem, constants: &Constants, barrier: f64) -> f64 {
        let barrier = tune("RAISE", 1e-3).max(barrier * tune("RAISEF", 100.0));
        let limit = problem.gimbal_limit_rad;
        let current = &mut self.current;
        for (input, limits) in current.inputs_rad.iter_mut().zip(&mut current.limits) {
            *input = limits.raise(*input, limit, barrier);
        }
        for (elastic, condition) in current.elastics.iter_mut().zip(&self.conditions) {
            *elastic = elastic.raised(condition.value(&current.states), barrier);
        }
        current.evaluate::<true>(constants, &problem.thrust_n);
        self.filter = Filter::starting_at(self.current.infeasibility());
        barrier
    }

    /// Line search along the step; whether a point was accepted.
    fn advance(&mut self, problem: &Problem, constants: &Constants, barrier: f64, fractions: Fractions) -> bool {
        let Fractions { mut primal, dual } = fractions;
        let slope = self.newton.slope(problem, &self.current, barrier);
        let now = Measures {
            infeasibility: self.current.infeasibility(),
            objective: self.current.barrier_objective(problem, barrier),
        };
        let tiny = self.newton.largest_input_step() <= TINY_STEP_RAD;
        if TRACE.load(std::sync::atomic::Ordering::Relaxed) {
            println!("      primal {primal:.3} dual {dual:.3} slope {slope:.3e}");
        }
        loop {
            self.newton.take(&self.conditions, &self.current, Fractions { primal, dual }, &mut self.trial);
            self.trial.evaluate::<true>(constants, &problem.thrust_n);
            let trial = Measures {
                infeasibility: self.trial.infeasibility(),
                objective: self.trial.barrier_objective(problem, barrier),
            };
            let unasked = tiny && trial.infeasibility.is_finite() && trial.objective.is_finite();
            if unasked || self.filter.accepts(now, trial, slope, primal) {
                core::mem::swap(&mut self.current, &mut self.trial);
                return true;
            }
            primal *= 0.5;
            if primal < SHORTEST_STEP {
                return false;
            }
        }
    }

    fn residual(&mut self, problem: &Problem, barrier: f64) -> Residual {
        Residual::of(problem, &self.conditions, &self.current, barrier, &mut self.scratch)
    }

    fn report(&mut self, problem: &Problem, outcome: Outcome, solution: &mut Solution) {
        let current = &mut self.current;
        if outcome.status != SolveStatus::Converged {
            current.roll_out(problem);
        }
        let ends = problem.end_conditions_len();
        solution.status = outcome.status;
        solution.iterations = outcome.iterations;
        solution.qp_iterations = outcome.sweeps;
        solution.cost = current.cost(problem);
        solution.kkt_stationarity = outcome.residual.stationarity;
        solution.kkt_feasibility = outcome.residual.defect.max(outcome.residual.complementarity);
        solution.condition_miss = self
            .conditions
            .iter()
            .map(|row| row.violation(row.value(&current.states)))
            .fold(0.0, f64::max);
        replace(&mut solution.states, current.states.iter().map(|state| PlanarState::from_array(*state)));
        replace(&mut solution.inputs_rad, current.inputs_rad.iter().copied());
        replace(&mut solution.costates, current.costates.iter().copied());
        replace(&mut solution.limit_multipliers, current.limits.iter().map(|z| [z.lower, z.upper]));
        let (end, floor) = current.elastics.split_at(ends);
        replace(&mut solution.end_multipliers, end.iter().map(Elastic::multiplier));
        replace(&mut solution.floor_multipliers, floor.iter().map(Elastic::multiplier));
    }
}

/// Refills a vector; allocates only if it never held as much.
fn replace<T>(values: &mut Vec<T>, with: impl Iterator<Item = T>) {
    values.clear();
    values.extend(with);
}

/// An input strictly within its limits.
fn inside(input_rad: f64, limit_rad: f64) -> f64 {
    const HAIR: f64 = 1e-12;
    let largest = limit_rad * (1.0 - HAIR);
    input_rad.clamp(-largest, largest)
}
