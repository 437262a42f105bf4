//! The landing controller's solver behind a pipe, to compare it with other solvers problem by
//! problem.
//!
//! Each line on standard input is a command and gets one line as its answer. A state is `x z theta
//! u w q`, in m, rad, m/s and rad/s. The problem is the landing paper's own (only distance and
//! height are limited at the end), N = 50.
//!
//! ```text
//! penalty PENALTY          what a metre of missed end height costs from now on; a high penalty
//!                          makes it a hard condition
//! cold both STATE          solve the whole horizon from the solver's own two bent guesses
//! cold 0|1 STATE           solve it from one of them
//! hold                     make the last solution the plan
//! warm SAMPLES CAP STATE   solve what is left SAMPLES after the plan began, warm-started with the
//!                          plan, in at most CAP iterations
//! space cold RATIO STATE   solve a landing in space (`space`), with RATIO of thrust to weight at
//!                          its beginning
//! space hold               make that solution the plan in space
//! space warm SAMPLES STATE solve what is left of it
//! quadratic STATE          the problem of one Gauss-Newton step (`quadratic`) at the plan
//! sweep STATE              time the layers of one iteration at the cold solution
//! peak                     time the arithmetic of this machine
//! ```
//!
//! A solve runs twice, and the second run is timed in the thread's own processor time, so
//! interruptions do not count. Its answer is `STATUS NANOSECONDS ITERATIONS COST STATIONARITY
//! FEASIBILITY MISS` and the inputs in rad. The answer to `sweep` is the nanoseconds of evaluating
//! all intervals, of a Newton step, and of a warm solve that ends after one iteration. The answer
//! to `quadratic` is the nanoseconds of a Newton step, the problem's numbers, and the answer of a
//! solve; that to `peak` is Gflop/s and the latencies of addition, multiplication, division and
//! root in ns. A problem that is proved not landable is not solved.
#![expect(clippy::print_stdout, reason = "the answers")]

mod clock;
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
use ocp::{Model, Outcome, Start};
use one_guess::OneGuess;
use paper::plane::dynamics::PlanarState;
use paper::plane::{Problem, Solution, Workspace, best_touchdown_speed_m_s, solve};
use paper::problem::{self, HORIZON, TOUCHDOWN_SPEED_MAX_M_S};
use space::Space;

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
    penalty: f64,
    workspace: Workspace,
    /// The outcome of the workspace's last solve.
    last: Option<Outcome>,
    /// The solution from which warm solves start.
    plan: Option<Solution>,
    space: Space,
}

impl Peer {
    fn new() -> Self {
        let penalty = problem::problem(problem::start(), HORIZON).solver.terminal_penalty;
        Self { penalty, workspace: Workspace::default(), last: None, plan: None, space: Space::new(penalty) }
    }

    fn answer(&mut self, line: &str) -> Result<String> {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("penalty") => {
                let penalty = number(words.next(), "penalty")?;
                self.penalty = penalty;
                self.space.set_penalty(penalty);
                Ok("penalised".to_owned())
            }
            Some("cold") => {
                let which = words.next().context("which guess is missing")?;
                let problem = self.problem(state(words)?, HORIZON);
                match which {
                    "both" if best_touchdown_speed_m_s(&problem) > TOUCHDOWN_SPEED_MAX_M_S => {
                        Ok("not-landable 0 0 0 0 0 inf".to_owned())
                    }
                    "both" => {
                        let (outcome, answer) = timed(&problem, &mut self.workspace, None)?;
                        self.last = Some(outcome);
                        Ok(answer)
                    }
                    "0" | "1" => {
                        let index = usize::from(which == "1");
                        let guess = OneGuess { problem: &problem, index };
                        Ok(timed(&guess, &mut ocp::Workspace::default(), None)?.1)
                    }
                    _ => bail!("guess '{which}': both, 0 or 1"),
                }
            }
            Some("hold") => {
                let outcome = self.last.context("nothing was solved")?;
                self.plan = Some(Solution::of(&self.workspace, outcome));
                Ok("held".to_owned())
            }
            Some("warm") => {
                let samples: usize = number(words.next(), "samples")?;
                let cap = number(words.next(), "cap")?;
                let planned = self.plan()?.inputs_rad.len();
                ensure!(samples < planned, "the plan has {planned} intervals; samples must be fewer");
                let mut problem = self.problem(state(words)?, planned - samples);
                problem.solver.max_iterations = cap;
                let start = self.plan.as_ref().map(|plan| plan.start(samples));
                let (outcome, answer) = timed(&problem, &mut self.workspace, start.as_ref())?;
                self.last = Some(outcome);
                Ok(answer)
            }
            Some("quadratic") => quadratic::answer(&self.problem(state(words)?, HORIZON), self.plan()?),
            Some("space") => self.in_space(words),
            Some("sweep") => Ok(self.layers(state(words)?)),
            Some("peak") => Ok(peak::measured().to_string()),
            _ => bail!("must start with penalty, cold, hold, warm, quadratic, space, sweep or peak"),
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

    fn plan(&self) -> Result<&Solution> {
        self.plan.as_ref().context("no plan is held")
    }

    fn problem(&self, start: PlanarState, intervals: usize) -> Problem {
        let mut problem = problem::problem(start, intervals);
        problem.solver.terminal_penalty = self.penalty;
        problem
    }

    fn layers(&mut self, start: PlanarState) -> String {
        let mut problem = self.problem(start, HORIZON);
        let solution = solve(&problem, None);
        let (start, workspace) = (solution.start(0), &mut self.workspace);
        workspace.load(&problem, &start);
        let evaluated = best_of(REPEATS, RUNS, || workspace.evaluate_intervals(black_box(&problem)));
        let swept = best_of(REPEATS, RUNS, || {
            black_box(workspace.sweep(black_box(&problem)));
        });
        problem.solver.max_iterations = 1;
        problem.initial.w_m_s += 0.02;
        let iterated = best_of(REPEATS, RUNS, || {
            workspace.solve(black_box(&problem), Some(&start));
        });
        format!("{evaluated} {swept} {iterated}")
    }
}

/// Solves twice, the second time with the buffers of the first. Returns the second outcome and the
/// line with its result.
fn timed<M: Model<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    workspace: &mut ocp::Workspace<M, NX, NU>,
    start: Option<&Start<'_, NX, NU>>,
) -> Result<(Outcome, String)> {
    workspace.solve(black_box(model), start);
    let before = thread_ns();
    let outcome = workspace.solve(black_box(model), start);
    let ns = thread_ns() - before;
    let Outcome { status, iterations, cost, stationarity, feasibility, miss, .. } = outcome;
    let status = status.name().replace(' ', "-");
    let mut answer = format!("{status} {ns} {iterations} {cost:e} {stationarity:e} {feasibility:e} {miss:e}");
    for input in workspace.inputs().as_flattened() {
        write!(answer, " {input:e}")?;
    }
    Ok((outcome, answer))
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
