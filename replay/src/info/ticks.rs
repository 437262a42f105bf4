//! Counts the controller's ticks.

use std::collections::BTreeMap;

use flight::guidance::controller::ControlLevel;
use nmpc::SolveStatus;
use protocol::log::v1;
use serde::Serialize;

use super::SolveTimes;
use super::solve_times::SolveTimeCounter;
use crate::log::{Gap, TickRanges};

/// Most gaps that are listed.
const GAPS_LISTED: usize = 20;

/// The controller's ticks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TickFacts {
    /// Number of ticks.
    pub count: u64,
    /// The lowest number.
    pub first: u64,
    /// The highest number.
    pub last: u64,
    /// Vehicle time of the first in the file, s.
    pub first_time_s: f64,
    /// Vehicle time of the last in the file, s.
    pub last_time_s: f64,
    pub repeated: u64,
    /// Number of missing ticks between the first and the last.
    pub missing: u64,
    /// The first gaps.
    pub gaps: Vec<Gap>,
    /// Number of ticks decided by each control level.
    pub levels: Vec<Named>,
    /// Number of ticks with each solver status.
    pub solver_statuses: Vec<Named>,
    pub solve_time: SolveTimes,
    /// Ticks whose previous output was dropped as too late, as decided on board.
    pub outputs_dropped: u64,
}

/// A name and how often it occurs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Named {
    /// The name, or `unknown (n)`.
    pub name: String,
    /// How many ticks.
    pub ticks: u64,
}

/// Counts ticks.
#[derive(Default)]
pub(super) struct TickCounter {
    count: u64,
    ranges: TickRanges,
    times_s: Option<(f64, f64)>,
    levels: BTreeMap<u32, u64>,
    statuses: BTreeMap<u32, u64>,
    solve_times: SolveTimeCounter,
    outputs_dropped: u64,
}

impl TickCounter {
    pub(super) fn count(&mut self, tick: &v1::ControllerTick) {
        let time_s = tick.input.time_s;
        self.count += 1;
        self.ranges.insert(tick.input.tick);
        self.times_s = Some((self.times_s.map_or(time_s, |(first_s, _)| first_s), time_s));
        *self.levels.entry(tick.output.level).or_default() += 1;
        *self.statuses.entry(tick.output.solver.status).or_default() += 1;
        self.solve_times.count(tick.solve_time_s, tick.deadline_s);
        self.outputs_dropped += u64::from(tick.input.deadline_missed);
    }

    pub(super) fn into_facts(self) -> Option<TickFacts> {
        let (first, last) = self.ranges.bounds()?;
        let (first_time_s, last_time_s) = self.times_s?;
        Some(TickFacts {
            count: self.count,
            first,
            last,
            first_time_s,
            last_time_s,
            repeated: self.ranges.repeated(),
            missing: self.ranges.gaps().map(|gap| gap.missing()).fold(0, u64::saturating_add),
            gaps: self.ranges.gaps().take(GAPS_LISTED).collect(),
            levels: named(&self.levels, level_name),
            solver_statuses: named(&self.statuses, status_name),
            solve_time: self.solve_times.into_facts()?,
            outputs_dropped: self.outputs_dropped,
        })
    }
}

fn named(counts: &BTreeMap<u32, u64>, name: impl Fn(u32) -> Option<&'static str>) -> Vec<Named> {
    let named = counts.iter().map(|(number, ticks)| Named {
        name: name(*number).map_or_else(|| format!("unknown ({number})"), str::to_owned),
        ticks: *ticks,
    });
    named.collect()
}

fn level_name(number: u32) -> Option<&'static str> {
    ControlLevel::from_index(u8::try_from(number).ok()?).map(ControlLevel::name)
}

fn status_name(number: u32) -> Option<&'static str> {
    let statuses = [
        SolveStatus::NotRun,
        SolveStatus::Converged,
        SolveStatus::IterationLimit,
        SolveStatus::Stalled,
        SolveStatus::SubproblemFailed,
        SolveStatus::NotLandable,
        SolveStatus::BadInput,
    ];
    statuses.into_iter().find(|status| u32::from(status.index()) == number).map(SolveStatus::name)
}
