//! The quadratic problem of one Gauss-Newton step: the landing with its dynamics linearised at a
//! plan. (With the exact Hessian it need not be convex, which public solvers of such problems ask
//! for.)
#![expect(clippy::inline_always, reason = "inlined into the sweeps, to be compiled for their vectors")]

use core::array::from_fn;
use std::fmt::Write as _;
use std::hint::black_box;
use std::rc::Rc;

use anyhow::{Result, ensure};
use ocp::{Condition, InputRange, Interval as _, Intervals, Model, Settings, Workspace};
use paper::plane::{Problem, Solution};

use crate::clock::best_of;
use crate::one_guess::as_in_the_problem;
use crate::{REPEATS, RUNS, timed};

type Blocks = <Problem as Model<6, 1>>::Intervals;

/// The problem, and the end of each interval that begins with zeros.
struct Quadratic<'a> {
    problem: &'a Problem,
    plan: &'a Solution,
    linear: Linear,
}

/// Matrices that stay, and ends that follow states and inputs.
#[derive(Debug, Clone, Default)]
struct Linear {
    matrices: Rc<Blocks>,
    ends: Vec<[f64; 6]>,
}

/// The nanoseconds of a Newton step; of every interval the columns of `A`, that of `B`, and its end
/// from zeros; and the answer of a solve.
pub(crate) fn answer(problem: &Problem, plan: &Solution) -> Result<String> {
    ensure!(plan.inputs_rad.len() == problem.intervals, "the plan must be of the whole horizon");
    let mut posed = Quadratic { problem, plan, linear: Linear::default() };
    let (mut states, mut inputs) = (vec![[0.0; 6]; plan.states.len()], vec![[0.0]; plan.inputs_rad.len()]);
    posed.guess(0, &mut states, &mut inputs);
    let mut blocks = Blocks::default();
    blocks.resize(inputs.len());
    // Without costates the dynamics have no curvature.
    problem.evaluate(&states, &inputs, &vec![[0.0; 6]; states.len()], true, &mut blocks);
    let mut numbers = String::new();
    for (k, input) in inputs.iter().enumerate() {
        let (interval, end) = (blocks.interval(k), blocks.end(k));
        let pushed = interval.push(&states[k], input);
        posed.linear.ends.push(from_fn(|i| end[i] - pushed[i]));
        let unit = |column: usize, of: usize| if column == of { 1.0 } else { 0.0 };
        let columns = (0..7).map(|column| interval.push(&from_fn(|i| unit(column, i)), &[unit(column, 6)]));
        for entry in columns.chain([posed.linear.ends[k]]).flatten() {
            write!(numbers, " {entry:e}")?;
        }
    }
    posed.linear.matrices = Rc::new(blocks);
    let mut workspace = Workspace::default();
    let (_, solved) = timed(&posed, &mut workspace, None)?;
    let swept = best_of(REPEATS, RUNS, || {
        black_box(workspace.sweep(black_box(&posed)));
    });
    Ok(format!("{swept}{numbers} {solved}"))
}

impl Intervals<6, 1> for Linear {
    const INTEGRALS: usize = Blocks::INTEGRALS;

    type Interval<'a> = <Blocks as Intervals<6, 1>>::Interval<'a>;

    fn resize(&mut self, intervals: usize) {
        self.ends.resize(intervals, [0.0; 6]);
    }

    #[inline(always)]
    fn end(&self, k: usize) -> [f64; 6] {
        self.ends[k]
    }

    #[inline(always)]
    fn pulled(&self, k: usize, lambda: &[f64; 6]) -> ([f64; 6], [f64; 1]) {
        self.interval(k).pull(lambda)
    }

    #[inline(always)]
    fn interval(&self, k: usize) -> Self::Interval<'_> {
        self.matrices.interval(k)
    }
}

impl Model<6, 1> for Quadratic<'_> {
    type Intervals = Linear;

    as_in_the_problem!();

    fn guess(&self, _: usize, states: &mut [[f64; 6]], inputs_rad: &mut [[f64; 1]]) {
        for (state, planned) in states.iter_mut().zip(&self.plan.states) {
            *state = *planned;
        }
        states[0] = self.initial();
        inputs_rad.copy_from_slice(&self.plan.inputs_rad);
    }

    fn evaluate(
        &self,
        states: &[[f64; 6]],
        inputs: &[[f64; 1]],
        _: &[[f64; 6]],
        _: bool,
        linear: &mut Linear,
    ) {
        linear.matrices = Rc::clone(&self.linear.matrices);
        for (k, end) in linear.ends.iter_mut().enumerate() {
            *end = self.next(k, &states[k], &inputs[k]);
        }
    }

    fn next(&self, k: usize, state: &[f64; 6], input: &[f64; 1]) -> [f64; 6] {
        let pushed = self.linear.interval(k).push(state, input);
        from_fn(|i| self.linear.ends[k][i] + pushed[i])
    }
}
