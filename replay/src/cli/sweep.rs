//! `replay sweep`.

use std::io::{IsTerminal as _, Write as _};
use std::num::NonZeroUsize;
use std::path::PathBuf;

use anyhow::{Context as _, Result, ensure};
use clap::Args;
use replay::log::Recording;
use replay::print::{print_json, print_sweep, print_sweep_csv};
use replay::refly::{ReflyError, StartAt, can_be_flown};
use replay::sweep::{Choice, Progress, State, Vary, grid, random, sweep};

use super::refly::FlownHow;
use super::{Answer, answer, say, warn_of_what_is_missing};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// The flights, MCAP files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// A setting of controller and plant to vary: PATH=FROM:TO:COUNT, PATH=A,B,C, or PATH=FROM:TO with --random. May be
    /// given more than once; every combination is flown.
    #[arg(long, value_name = "PATH=VALUES")]
    vary: Vec<Vary>,
    /// A setting of the plant alone to vary, in the same form.
    #[arg(long, value_name = "PATH=VALUES")]
    vary_plant: Vec<Vary>,
    /// Use this many random points in the ranges instead of a grid.
    #[arg(long, value_name = "POINTS")]
    random: Option<usize>,
    /// Seed of the random points.
    #[arg(long, value_name = "N", default_value_t = 1)]
    random_seed: u64,
    #[command(flatten)]
    how: FlownHow,
    /// Flights flown at the same time; the answer does not depend on it [default: all processors].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Keep every finished flight in this file, and continue from it if it exists.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Points to show.
    #[arg(long, value_name = "N", default_value_t = 20)]
    top: usize,
    /// Answer in JSON, with every point.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Answer as CSV, with every point on every flight.
    #[arg(long)]
    csv: bool,
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        ensure!(
            !(self.vary.is_empty() && self.vary_plant.is_empty()),
            "nothing to vary; give --vary powered.weights.theta=50:110:7 or the like"
        );
        let points = match self.random {
            Some(count) => random(&self.vary, &self.vary_plant, count, self.random_seed)?,
            None => grid(&self.vary, &self.vary_plant)?,
        };
        let options = self.how.options(StartAt::Landing)?;
        let mut flights = Vec::new();
        for file in &self.files {
            let opened = Recording::open(file).map_err(ReflyError::from);
            match opened.and_then(|flight| can_be_flown(&flight).map(|()| flight)) {
                Ok(flight) => {
                    warn_of_what_is_missing(&flight);
                    flights.push(flight);
                }
                Err(error) if self.files.len() == 1 => return Err(error.into()),
                Err(error) => say(&format!("skipped: {:#}", anyhow::Error::from(error))),
            }
        }
        ensure!(!flights.is_empty(), "none of the {} logs can be flown again", self.files.len());
        let all_jobs = points.len() * flights.len();
        let mut state = match &self.state {
            None => State::in_memory(all_jobs),
            Some(path) => State::open(path, &self.identity(&points)?, all_jobs)?,
        };
        let jobs =
            self.jobs.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN);
        let mut show = |progress: Progress| show(progress);
        let report = sweep(&flights, &points, &options, jobs, &mut state, &mut show)?;
        answer(|output| match () {
            () if self.json => print_json(&report, output),
            () if self.csv => print_sweep_csv(&report, output),
            () => print_sweep(&report, self.top, output),
        })?;
        Ok(Answer::Given)
    }

    /// Identifies the sweep: content of the flights, points, options, and the build.
    fn identity(&self, points: &[Choice]) -> Result<String> {
        let mut facts = format!("{:?} {points:?} {:?}", self.how, protocol::log::build::build_info());
        for path in self.how.settings.settings.iter().chain(&self.files) {
            let bytes = std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
            facts = format!("{facts} {} {:016x}", path.display(), fnv(&bytes));
        }
        Ok(format!(
            "replay sweep {:016x}, {} points on {} flights",
            fnv(facts.as_bytes()),
            points.len(),
            self.files.len()
        ))
    }
}

/// Shows progress about twenty times on a terminal, elsewhere only at the end.
fn show(Progress { done, jobs }: Progress) {
    let mut output = std::io::stderr();
    let ended = done == jobs;
    if ended || (output.is_terminal() && done.is_multiple_of((jobs / 20).max(1))) {
        let end = if ended { "\n" } else { "" };
        // Progress goes to standard error, which may be closed.
        let _ = write!(output, "\rreplay: {done} of {jobs} flights{end}");
    }
}

/// FNV-1a, 64 bits: tells files apart, but does not protect against forgery.
fn fnv(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}
