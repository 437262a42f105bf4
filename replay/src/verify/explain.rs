//! Solves the plans of a recorded flight again, and judges them.
//!
//! The controller first runs every earlier frame, so that it has the warm start it had in flight.
//! The landing that a frame planned is then solved cold, and by the [`judge`], which is written
//! independently and solves another way. Both plans are counted by the judge's own dynamics and
//! conditions.

use std::path::Path;

use anyhow::{Context as _, Result};
use avionics::log::frame::level_of;
use flight::guidance::powered::{ControlLevel, LandingSolved};
use judge::{Judgement, Score};
use ocp::Outcome as SolveOutcome;
use ocp::landing::State;
use onboard_sim::progress::Progress;
use onboard_sim::run::in_parallel;
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, give, warn_of_what_is_missing};
use crate::controller::{AgainError, LoggedComputer, phase_name};
use crate::log::Recording;
use crate::print::columns;

/// Plans whose costs differ by less than this share, and whose first gimbal angles by less than
/// this, are the same.
const SAME_SHARE: f64 = 0.01;
const SAME_DEG: f64 = 0.5;

/// A plan, as the judge counts it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CountedPlan {
    /// How its solve ended.
    pub status: &'static str,
    pub iterations: usize,
    /// Running cost.
    pub cost: f64,
    /// Cost and the price of every broken condition.
    pub merit: f64,
    /// The largest miss of a condition, in its unit (m, m/s, rad, rad/s), and which.
    pub broken: f64,
    pub broken_condition: Option<String>,
    /// First gimbal angles towards north and west, deg, and first share of the fins.
    pub gimbal_deg: [f64; 2],
    pub fins: f64,
    /// Place of the touchdown, north and west of the target, m, and vertical velocity there, m/s.
    pub touchdown_m: [f64; 2],
    pub touchdown_m_s: f64,
}

/// The plan of a frame beside the judge's of the same problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// The plan that flew, or would have.
    pub flown: CountedPlan,
    /// Newton iterations and merit of the flying solver with a cold start.
    pub cold_iterations: usize,
    pub cold_merit: f64,
    /// The judge's.
    pub judge: CountedPlan,
    /// How much more the flown plan costs than the judge's, as a share, with the price of what it
    /// breaks; negative: less.
    pub flown_dearer: f64,
    /// How far the first gimbal angles are apart, deg.
    pub first_input_deg: f64,
    /// In one sentence.
    pub verdict: String,
}

/// A frame that was solved again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameReport {
    /// The log.
    pub file: String,
    pub frame: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    /// Since the thrust began, s.
    pub burning_s: f64,
    pub phase: &'static str,
    /// The control level that decided.
    pub level: &'static str,
    /// The recorded gimbal commands in pitch and yaw, rad.
    pub recorded_gimbal_rad: Vec<f64>,
    /// The gimbal commands of this build, rad.
    pub gimbal_rad: Vec<f64>,
    /// Whether the whole output is equal to the recorded one, bit for bit; and the memory, unless
    /// it covers the pad.
    pub identical: bool,
    /// `None` if this frame planned nothing.
    pub judged: Option<Judged>,
    /// The nearest frame that plans a landing: this frame if it does, `None` if no frame does.
    pub nearest_planned: Option<u64>,
    /// The plan: time from the frame, s, and state at each node ([`ocp::landing::State`]).
    pub path: Vec<(f64, State)>,
}

/// A frame, and the landing that it planned.
struct Explained {
    report: FrameReport,
    solved: Option<LandingSolved>,
}

/// Runs a recorded flight again, up to a frame or to its end, and solves what the frame, or each,
/// planned.
fn inspected(recording: &Recording, only: Option<u64>) -> Result<Vec<Explained>, AgainError> {
    let (start, frames) = recording.replayable_frames()?;
    let computer = LoggedComputer::recorded(recording.profile_toml()?, start, &recording.head.run, &[])?;
    let mut controller = if recording.from_power_up { computer.without_digests() } else { computer };
    let logged = |frame: &ComputerFrame| recording.release_frame + frame.input.frame;
    let planned: Vec<u64> = frames.iter().filter(|frame| plans(frame)).map(logged).collect();
    let mut explained = Vec::new();
    for recorded in frames {
        let number = logged(recorded);
        let again = controller.run_again(recorded)?;
        if only.is_some_and(|only| only != number) || only.is_none() && !planned.contains(&number) {
            continue;
        }
        let pilot = controller.pilot();
        let solved = pilot.landing_solved().filter(|_| plans(&again));
        let path = |solved: &LandingSolved| {
            let time_s = |node: usize| node as f64 * solved.plan.step_s();
            solved.plan.states().iter().enumerate().map(|(node, state)| (time_s(node), *state)).collect()
        };
        explained.push(Explained {
            report: FrameReport {
                file: recording.name.clone(),
                frame: number,
                time_s: recorded.input.time_s,
                burning_s: pilot.burning_s(recorded.input.time_s).unwrap_or(0.0),
                phase: phase_name(&again.output),
                level: level_of(&again.output).map_or("unknown", ControlLevel::name),
                recorded_gimbal_rad: recorded.output.gimbal_rad.clone(),
                gimbal_rad: again.output.gimbal_rad.clone(),
                identical: again.encode_to_vec() == recorded.encode_to_vec(),
                judged: None,
                nearest_planned: planned.iter().copied().min_by_key(|frame| frame.abs_diff(number)),
                path: solved.as_ref().map(path).unwrap_or_default(),
            },
            solved,
        });
        if only.is_some() {
            break;
        }
    }
    match only.filter(|_| explained.is_empty()) {
        None => Ok(explained),
        Some(frame) => {
            let bound = |frame: Option<&ComputerFrame>| frame.map_or(0, logged);
            let (first, last) = (bound(frames.first()), bound(frames.last()));
            Err(AgainError::NoFrame { name: recording.name.clone(), frame, first, last })
        }
    }
}

/// Whether a frame took over the plan of a landing, and flies.
pub(crate) fn plans(frame: &ComputerFrame) -> bool {
    frame.output.planned && frame.output.level != u32::from(ControlLevel::Idle.index())
}

/// Solves one recorded frame again.
///
/// # Errors
/// See [`AgainError`].
pub fn explain(recording: &Recording, number: u64) -> Result<FrameReport, AgainError> {
    // Without that frame it is an error.
    let Explained { report, solved } = inspected(recording, Some(number))?.swap_remove(0);
    Ok(FrameReport { judged: solved.as_ref().map(judged), ..report })
}

/// Solves every frame again that planned a landing.
///
/// # Errors
/// See [`AgainError`].
pub fn explain_all(recording: &Recording) -> Result<Vec<FrameReport>, AgainError> {
    let explained = inspected(recording, None)?;
    let progress = Progress::start();
    let one =
        |frame: &Explained| FrameReport { judged: frame.solved.as_ref().map(judged), ..frame.report.clone() };
    Ok(in_parallel(&explained, one, &|done| progress.show(done, explained.len(), "plans")))
}

fn judged(solved: &LandingSolved) -> Judged {
    let LandingSolved { problem, outcome, plan } = solved;
    let mut workspace = ocp::landing::Workspace::default();
    let cold: SolveOutcome = ocp::landing::solve(&mut workspace, problem, None);
    let (states, inputs) = (plan.states(), plan.inputs());
    let Judgement { converged, iterations, score, states: found, inputs: found_inputs } =
        judge::solve(problem, Some((states, inputs)));
    let flown = facts(
        outcome.status.name(),
        outcome.iterations,
        &judge::score(problem, states, inputs),
        (states, inputs),
    );
    let status = if converged { "converged" } else { "best found" };
    let judge = facts(status, iterations, &score, (&found, &found_inputs));
    let apart = [0, 1].map(|axis| (flown.gimbal_deg[axis] - judge.gimbal_deg[axis]).abs());
    let first_input_deg = apart[0].max(apart[1]);
    let flown_dearer = flown.merit / judge.merit - 1.0;
    let percent = 100.0 * flown_dearer.abs();
    let words = if flown_dearer > SAME_SHARE {
        format!("the judge found a better plan: the flown one is {percent:.2} % dearer")
    } else if flown_dearer < -SAME_SHARE {
        format!("the judge found none as good: the flown plan is {percent:.2} % cheaper")
    } else if first_input_deg > SAME_DEG {
        "the judge found another plan that is as good".to_owned()
    } else {
        "the judge agrees".to_owned()
    };
    Judged {
        verdict: format!("{words}; first gimbal angles are {first_input_deg:.3} deg apart"),
        cold_iterations: cold.iterations,
        cold_merit: cold.merit,
        flown,
        judge,
        flown_dearer,
        first_input_deg,
    }
}

fn facts(
    status: &'static str,
    iterations: usize,
    score: &Score,
    (states, inputs): (&[State], &[[f64; ocp::landing::INPUTS]]),
) -> CountedPlan {
    let [north, west, fins] = inputs.first().copied().unwrap_or([f64::NAN; ocp::landing::INPUTS]);
    let end = states.last().copied().unwrap_or([f64::NAN; ocp::landing::STATES]);
    CountedPlan {
        status,
        iterations,
        cost: score.cost,
        merit: score.merit,
        broken: score.miss,
        broken_condition: score.worst.map(|(what, node)| format!("{what} at node {node}")),
        gimbal_deg: [north.to_degrees(), west.to_degrees()],
        fins,
        touchdown_m: [end[0], end[1]],
        touchdown_m_s: end[5],
    }
}

/// Most nodes of the plan that are shown.
const NODES_SHOWN: usize = 12;

impl Answer for FrameReport {
    fn sentences(&self) -> Vec<String> {
        let Self { file, frame, time_s, phase, level, burning_s, .. } = self;
        let verdict = self.judged.as_ref().map(|judged| format!(": {}", judged.verdict)).unwrap_or_default();
        let same = if self.identical { "identical bit for bit" } else { "NOT IDENTICAL" };
        let [recorded, now] = [&self.recorded_gimbal_rad, &self.gimbal_rad].map(|angles| degrees(angles, 4));
        let mut lines = vec![
            format!("{file}: frame {frame} ({time_s:.3} s, {phase}), decided by {level}{verdict}"),
            format!(
                "command  {recorded} deg as recorded, {now} deg now: {same}; {burning_s:.3} s since the thrust began"
            ),
        ];
        let Some(judged) = &self.judged else {
            let nearest = self.nearest_planned.map_or_else(
                || "no frame of this log does".to_owned(),
                |nearest| format!("the nearest that does is {nearest}"),
            );
            lines.push(format!("plan     this frame plans no landing; {nearest}"));
            return lines;
        };
        lines.extend([("flown", &judged.flown), ("judge", &judged.judge)].map(|(name, plan)| {
            let CountedPlan { status, iterations, cost, merit, broken, gimbal_deg, fins, .. } = plan;
            let broken = plan.broken_condition.as_ref().map_or_else(
                || "nothing broken".to_owned(),
                |condition| format!("{condition} broken by {broken:.1e}"),
            );
            let ([north_deg, west_deg], [north_m, west_m]) = (gimbal_deg, plan.touchdown_m);
            format!(
                "{name:<8} {status}, {iterations} iterations, cost {cost:.4}, with what is broken {merit:.4}; gimbal {north_deg:.3} \
                 and {west_deg:.3} deg, fins {fins:.2}; touches down {north_m:.2} m north, {west_m:.2} m west at {:.3} m/s; {broken}",
                plan.touchdown_m_s
            )
        }));
        let Judged { cold_iterations, cold_merit, .. } = judged;
        lines.push(format!(
            "cold     {cold_iterations} iterations without the plan before it, with what is broken {cold_merit:.4}"
        ));
        let stride = self.path.len().div_ceil(NODES_SHOWN).max(1);
        let shown = self.path.iter().enumerate();
        let shown = shown.filter(|(node, _)| node % stride == 0 || node + 1 == self.path.len());
        lines.extend(shown.map(|(node, (time_s, state))| {
            let name = if node == 0 { "path" } else { "" };
            let [north, west, up, north_m_s, west_m_s, up_m_s, p, r, ..] = state;
            let [p_deg, r_deg] = [p, r].map(|angle| angle.to_degrees());
            format!(
                "{name:<8} +{time_s:.2} s  {north:>7.2} m north {west:>7.2} m west {up:>7.2} m up  {north_m_s:>6.2} {west_m_s:>6.2} \
                 {up_m_s:>6.2} m/s  leans {p_deg:>6.2} deg north {r_deg:>6.2} deg west"
            )
        }));
        lines
    }
}

/// One angle, or pitch and yaw.
pub(crate) fn degrees(rad: &[f64], digits: usize) -> String {
    rad.iter().map(|rad| format!("{:.digits$}", rad.to_degrees())).collect::<Vec<_>>().join(" ")
}

/// Every plan of a flight.
#[derive(Serialize)]
#[serde(transparent)]
struct Plans {
    reports: Vec<FrameReport>,
    #[serde(skip)]
    file: String,
}

impl Answer for Plans {
    fn sentences(&self) -> Vec<String> {
        let judged = || self.reports.iter().filter_map(|report| Some((report, report.judged.as_ref()?)));
        let count = |is: &dyn Fn(&Judged) -> bool| judged().filter(|(_, judged)| is(judged)).count();
        let mut lines = vec![format!(
            "{}: {} plans: the judge agrees within {:.0} % of cost in {} and within {SAME_DEG} deg of the first gimbal angles in {}; \
             it found a better plan in {}, and none as good in {}",
            self.file,
            judged().count(),
            100.0 * SAME_SHARE,
            count(&|judged| judged.flown_dearer.abs() <= SAME_SHARE),
            count(&|judged| judged.first_input_deg <= SAME_DEG),
            count(&|judged| judged.flown_dearer > SAME_SHARE),
            count(&|judged| judged.flown_dearer < -SAME_SHARE),
        )];
        let row = |(report, judged): (&FrameReport, &Judged)| {
            [
                report.frame.to_string(),
                format!("{:.3}", report.time_s),
                report.level.to_owned(),
                format!("{:.3}", judged.flown.merit),
                format!("{:.2} %", 100.0 * judged.flown_dearer),
                format!("{:.3} deg", judged.first_input_deg),
                judged.flown.broken_condition.clone().unwrap_or_default(),
            ]
        };
        let head = ["frame", "T+, s", "level", "merit", "dearer", "first", "broken"].map(str::to_owned);
        let rows = std::iter::once(head).chain(judged().map(row));
        lines.extend(columns(['>', '>', '<', '>', '>', '>', '<'], rows));
        lines
    }
}

pub(super) fn run(file: &Path, frame: &str, json: bool) -> Result<Exit> {
    let recording = Recording::open(file)?;
    warn_of_what_is_missing(&recording);
    if frame == "all" {
        return give(&Plans { reports: explain_all(&recording)?, file: recording.name }, json);
    }
    let number =
        frame.parse().with_context(|| format!("--explain {frame}: neither a frame's number nor `all`"))?;
    give(&explain(&recording, number)?, json)
}
