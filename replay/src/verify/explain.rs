//! Solves the plan of a recorded frame again, and judges it.
//!
//! The controller first runs every earlier frame, so that it has the warm start it had in flight.
//! The landing that a frame planned is then solved cold, and by the [`judge`], which is written
//! independently and solves another way. Both plans are counted by the judge's own dynamics and
//! conditions.

use std::path::Path;

use anyhow::Result;
use avionics::log::frame::level_of;
use flight::guidance::powered::{ControlLevel, LandingSolved};
use judge::{Judgement, Score};
use ocp::Outcome as SolveOutcome;
use ocp::landing::State;
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, give, recording};
use crate::controller::{AgainError, LoggedComputer, phase_name};
use crate::log::Recording;

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
    pub excess_cost: f64,
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

/// Whether a frame took over the plan of a landing, and flies.
pub(crate) fn plans(frame: &ComputerFrame) -> bool {
    frame.output.planned && frame.output.level != u32::from(ControlLevel::Idle.index())
}

/// Solves one recorded frame again.
///
/// # Errors
/// See [`AgainError`].
pub fn explain(recording: &Recording, number: u64) -> Result<FrameReport, AgainError> {
    let (start, frames) = recording.replayable_frames()?;
    let mut controller =
        LoggedComputer::recorded(recording.profile_toml()?, start, &recording.head.run, &[])?;
    controller.compares_digests = !recording.from_power_up;
    let logged = |frame: &ComputerFrame| recording.release_frame + frame.input.frame;
    for recorded in frames {
        let again = controller.run_again(recorded)?;
        if logged(recorded) != number {
            continue;
        }
        let pilot = controller.pilot();
        let solved = pilot.landing_solved().filter(|_| plans(&again));
        let path = |solved: &LandingSolved| {
            let time_s = |node: usize| node as f64 * solved.plan.step_s();
            solved.plan.states().iter().enumerate().map(|(node, state)| (time_s(node), *state)).collect()
        };
        let planned = frames.iter().filter(|frame| plans(frame)).map(logged);
        return Ok(FrameReport {
            file: recording.name.clone(),
            frame: number,
            time_s: recorded.input.time_s,
            burning_s: pilot.burning_s(recorded.input.time_s).unwrap_or(0.0),
            phase: phase_name(&again.output),
            level: level_of(&again.output).map_or("unknown", ControlLevel::name),
            recorded_gimbal_rad: recorded.output.gimbal_rad.clone(),
            gimbal_rad: again.output.gimbal_rad.clone(),
            identical: again.encode_to_vec() == recorded.encode_to_vec(),
            judged: solved.as_ref().map(judged),
            nearest_planned: planned.min_by_key(|frame| frame.abs_diff(number)),
            path: solved.as_ref().map(path).unwrap_or_default(),
        });
    }
    let bound = |frame: Option<&ComputerFrame>| frame.map_or(0, logged);
    let (first, last) = (bound(frames.first()), bound(frames.last()));
    Err(AgainError::NoFrame { name: recording.name.clone(), frame: number, first, last })
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
    let excess_cost = flown.merit / judge.merit - 1.0;
    let percent = 100.0 * excess_cost.abs();
    let words = if excess_cost > SAME_SHARE {
        format!("the judge found a better plan: the flown one is {percent:.2} % dearer")
    } else if excess_cost < -SAME_SHARE {
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
        excess_cost,
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

impl Answer for FrameReport {
    fn sentences(&self) -> Vec<String> {
        let Self { file, frame, time_s, phase, level, burning_s, .. } = self;
        let verdict = self.judged.as_ref().map(|judged| format!(": {}", judged.verdict)).unwrap_or_default();
        let same = if self.identical { "identical bit for bit" } else { "NOT IDENTICAL" };
        let degrees = |rad: &f64| format!("{:.4}", rad.to_degrees());
        let [recorded, now] = [&self.recorded_gimbal_rad, &self.gimbal_rad]
            .map(|angles| angles.iter().map(degrees).collect::<Vec<_>>().join(" "));
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
        lines
    }
}

pub(super) fn run(file: &Path, frame: u64, json: bool) -> Result<Exit> {
    give(&explain(&recording(file)?, frame)?, json)
}
