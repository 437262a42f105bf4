//! The landing controller's solver behind a pipe, to compare it with other solvers problem by problem.
//!
//! Each line on standard input is a command and gets one line as its answer. A state is `x z theta u w q`, in m, rad,
//! m/s and rad/s. The problem is the landing paper's own (only distance and height are limited at the end), N = 50.
//!
//! ```text
//! penalty PENALTY              what a metre of missed end height costs from now on; a high penalty makes it a hard condition
//! cold both STATE          solve the whole horizon from the solver's own two bent guesses
//! cold 0|1 STATE           solve it from one of them
//! hold                     make the last solution the plan
//! warm SAMPLES CAP STATE   solve what is left SAMPLES after the plan began, warm-started with the plan, in at most CAP
//!                          iterations
//! space cold RATIO STATE   solve a landing in space (`space`), with RATIO of thrust to weight at its beginning
//! space hold               make that solution the plan in space
//! space warm SAMPLES STATE solve what is left of it
//! free cold|warm RATIO UNTIL STATE   land with a free final time (`free`): RATIO of thrust to weight, 1 after UNTIL s
//! quadratic STATE          the problem of one Gauss-Newton step (`quadratic`) at the plan
//! sweep STATE              time the layers of one iteration at the cold solution
//! peak                     time the arithmetic of this machine
//! ```
//!
//! A solve runs twice, and the second run is timed in the thread's own processor time, so interruptions do not count.
//! Its answer is `STATUS NANOSECONDS ITERATIONS COST STATIONARITY FEASIBILITY MISS` and the inputs in rad. The answer
//! to `sweep` is the nanoseconds of evaluating all intervals, of a Newton step, and of a warm solve that ends after one
//! iteration. The answer to `quadratic` is the nanoseconds of a Newton step, the problem's numbers, and the answer of a
//! solve; that to `free` is whether it lands, nanoseconds, cost, final time and the inputs; that to `peak` is Gflop/s and
//! the latencies of addition, multiplication, division and root in ns.
#![expect(clippy::print_stdout, reason = "the answers")]

mod clock;
mod free;
mod one_guess;
mod peak;
mod quadratic;
mod space;

use std::error::Error;
use std::fmt::Write as _;
use std::hint::black_box;
use std::io::{BufRead, Write as _};
use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};
use clock::{best_of, thread_ns};
use free::{Falling, Free};
use nmpc::dynamics::PlanarState;
use nmpc::{Problem, Solution, SolverLimits, WarmStart, Workspace, paper, solve, solve_into};
use one_guess::OneGuess;
use space::Space;
use stages::{Model, Status};

/// Number of runs that are averaged, and of repeats, when the layers of an iteration are timed.
const RUNS: u32 = 50;
const REPEATS: u32 = 40;

fn main() -> Result<()> {
    let mut peer = Peer::new();
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let answer = peer.answer(&line).with_context(|| format!("command '{line}'"))?;
        println!("{answer}");
        std::io::stdout().flush()?;
    }
    Ok(())
}

struct Peer {
    solver: SolverLimits,
    workspace: Workspace,
    last: Solution,
    plan: Solution,
    space: Space,
    free: Free,
}

impl Peer {
    fn new() -> Self {
        let solver = paper::problem(paper::start(), 0).solver;
        Self {
            solver,
            space: Space::new(solver),
            workspace: Workspace::default(),
            last: Solution::default(),
            plan: Solution::default(),
            free: Free::default(),
        }
    }

    fn answer(&mut self, line: &str) -> Result<String> {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("penalty") => {
                let penalty = number(words.next(), "penalty")?;
                self.solver.terminal_penalty = penalty;
                self.space.set_penalty(penalty);
                Ok("penalised".to_owned())
            }
            Some("cold") => {
                let which = words.next().context("which guess is missing")?;
                let problem = self.problem(state(words)?, paper::HORIZON);
                match which {
                    "both" => self.timed(&problem, None),
                    "0" | "1" => {
                        let index = usize::from(which == "1");
                        timed(&OneGuess { problem: &problem, index }, &mut stages::Workspace::default())
                    }
                    _ => bail!("guess '{which}': both, 0 or 1"),
                }
            }
            Some("hold") => {
                self.plan = self.last.clone();
                Ok("held".to_owned())
            }
            Some("warm") => {
                let samples: usize = number(words.next(), "samples")?;
                let cap = number(words.next(), "cap")?;
                let planned = self.plan.inputs_rad.len();
                ensure!(samples < planned, "the plan has {planned} intervals; samples must be fewer");
                let mut problem = self.problem(state(words)?, planned - samples);
                problem.solver.max_iterations = cap;
                // A public solver does not ask first whether a start can be landed.
                problem.touchdown_speed_max_m_s = f64::MAX;
                let warm = self.plan.shifted(samples);
                self.timed(&problem, Some(&warm))
            }
            Some("quadratic") => quadratic::answer(&self.problem(state(words)?, paper::HORIZON), &self.plan),
            Some("free") => {
                let warm = words.next() == Some("warm");
                let [over_weight, until_s, state @ ..]: [f64; 8] = numbers(words)?;
                let landing = self.problem(PlanarState::from_array(state), paper::HORIZON);
                self.free.answer(warm, &Falling { over_weight, until_s }, landing)
            }
            Some("space") => self.in_space(words),
            Some("sweep") => Ok(self.layers(state(words)?)),
            Some("peak") => Ok(peak::measured().to_string()),
            _ => bail!("must start with penalty, cold, hold, warm, quadratic, free, space, sweep or peak"),
        }
    }

    fn in_space<'a>(&mut self, mut words: impl Iterator<Item = &'a str>) -> Result<String> {
        match words.next() {
            Some("cold") => {
                let ratio = number(words.next(), "ratio")?;
                self.space.cold(ratio, numbers(words)?)
            }
            Some("hold") => {
                self.space.hold();
                Ok("held".to_owned())
            }
            Some("warm") => {
                let samples = number(words.next(), "samples")?;
                self.space.warm(samples, numbers(words)?)
            }
            _ => bail!("in space: cold, hold or warm"),
        }
    }

    fn problem(&self, start: PlanarState, intervals: usize) -> Problem {
        Problem { solver: self.solver, ..paper::problem(start, intervals) }
    }

    fn timed(&mut self, problem: &Problem, warm: Option<&WarmStart>) -> Result<String> {
        let Self { workspace, last, .. } = self;
        solve_into(black_box(problem), warm, workspace, last);
        let before = thread_ns();
        solve_into(black_box(problem), warm, workspace, last);
        let ns = thread_ns() - before;
        let mut answer = format!(
            "{} {ns} {} {:e} {:e} {:e} {:e}",
            last.status.name().replace(' ', "-"),
            last.iterations,
            last.cost,
            last.kkt_stationarity,
            last.kkt_feasibility,
            last.condition_miss
        );
        for input in &last.inputs_rad {
            write!(answer, " {input:e}")?;
        }
        Ok(answer)
    }

    fn layers(&mut self, start: PlanarState) -> String {
        let mut problem = self.problem(start, paper::HORIZON);
        let solution = solve(&problem, None);
        let warm = solution.shifted(0);
        let workspace = &mut self.workspace;
        workspace.load(&problem, &warm);
        let evaluated = best_of(REPEATS, RUNS, || workspace.evaluate_intervals(black_box(&problem)));
        let swept = best_of(REPEATS, RUNS, || {
            black_box(workspace.sweep(black_box(&problem)));
        });
        problem.solver.max_iterations = 1;
        problem.initial.w_m_s += 0.02;
        let last = &mut self.last;
        let iterated =
            best_of(REPEATS, RUNS, || solve_into(black_box(&problem), Some(&warm), workspace, last));
        format!("{evaluated} {swept} {iterated}")
    }
}

/// Solves from one guess twice, each time with the buffers of the solve before.
fn timed<M: Model<6, 1>>(model: &M, workspace: &mut stages::Workspace<M, 6, 1>) -> Result<String> {
    workspace.solve(black_box(model), None);
    let before = thread_ns();
    let outcome = workspace.solve(black_box(model), None);
    let ns = thread_ns() - before;
    let status = if outcome.status == Status::Converged { "converged" } else { "failed" };
    let stages::Outcome { iterations, cost, stationarity, feasibility, miss, .. } = outcome;
    let mut answer = format!("{status} {ns} {iterations} {cost:e} {stationarity:e} {feasibility:e} {miss:e}");
    for input in workspace.inputs().as_flattened() {
        write!(answer, " {input:e}")?;
    }
    Ok(answer)
}

fn number<T: FromStr<Err: Error + Send + Sync + 'static>>(
    word: Option<&str>,
    what: &'static str,
) -> Result<T> {
    word.with_context(|| format!("{what} is missing"))?.parse().context(what)
}

fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a str>) -> Result<[f64; N]> {
    let numbers: Vec<f64> =
        words.map(|word| word.parse().with_context(|| format!("number '{word}'"))).collect::<Result<_>>()?;
    numbers.try_into().map_err(|got: Vec<f64>| anyhow::anyhow!("{N} numbers make a state, not {}", got.len()))
}

fn state<'a>(words: impl Iterator<Item = &'a str>) -> Result<PlanarState> {
    Ok(PlanarState::from_array(numbers(words)?))
}
