//! Solves one recorded frame again.
//!
//! The controller first runs every earlier frame, so that it has the warm start it had in flight. Then the same landing
//! problem is solved again with a cold start, and the two solutions are compared. The third is the judge's:
//! [`reference_solver`] shares only the equations of motion with the solver that flies.

use std::io::{self, Write};
use std::path::Path;

use anyhow::Result;
use flight::computer::pilot::{FRAMES_PER_PLAN, Pilot};
use flight::guidance::powered::ControlLevel;
use flight::guidance::powered::Plane;
use flight::vehicle::dynamics::PlanarState;
use flight_log::frame::level_of;
use nalgebra::Vector3;
use nmpc::{Problem, Solution};
use prost::Message as _;
use protocol::log::computer_v1::ComputerFrame;
use serde::Serialize;

use crate::cli::{Outcome, answer, warn_of_what_is_missing};
use crate::controller::{FrameError, LoggedComputer, phase_name};
use crate::log::{Recording, RecordingError};
use crate::print::{print_json, shown};
use crate::settings::SettingError;

/// A condition or limit with less margin than this counts as active; in its own unit (m, rad, m/s or rad/s).
const ACTIVE: f64 = 1e-4;

/// State components in order, with their units.
const COMPONENTS: [&str; 6] = ["x_m", "z_m", "theta_rad", "u_m_s", "w_m_s", "q_rad_s"];

/// Why a frame cannot be solved again.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// The log lacks the records that are needed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The log names settings that this build does not have.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A recorded frame cannot be executed again.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The log has no such frame.
    #[error("{name}: no frame {frame} that can be re-executed; there are {first} to {last}")]
    NoFrame {
        /// The file.
        name: String,
        /// The request.
        frame: u64,
        /// The first frame in the log.
        first: u64,
        /// The last frame in the log.
        last: u64,
    },
}

/// The result of a solve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Solved {
    /// The solver status.
    pub status: &'static str,
    /// Newton iterations.
    pub iterations: usize,
    /// Cost of the plan.
    pub cost: f64,
    /// Stationarity residual.
    pub kkt_stationarity: f64,
    /// Feasibility residual.
    pub kkt_feasibility: f64,
    /// The largest violation of a condition along the path, m, rad, m/s or rad/s.
    pub condition_miss: f64,
    /// The first input, rad.
    pub gimbal_rad: f64,
}

/// The flown plan beside the reference solver's of the same problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// What the reference solver finds from its own guesses; it may settle on another branch.
    pub reference: Solved,
    /// How much more the flown plan costs, as a fraction, with what it misses of its conditions; negative if it is better.
    pub flown_dearer: f64,
    /// How far the first inputs are apart, rad.
    pub first_input_rad: f64,
    /// How far the touchdowns are apart, m.
    pub touchdown_m: f64,
    /// How far the velocities there are apart, m/s.
    pub touchdown_m_s: f64,
}

/// A limit or condition that the plan touches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActiveConstraint {
    /// The limit as text, as in `w_m_s <= 0.03`.
    pub what: String,
    /// Nodes or intervals of the plan at which it is active.
    pub at: Vec<usize>,
    /// The largest multiplier among them: how much cost would be saved if the limit were one unit looser.
    pub multiplier: f64,
}

/// A frame that was solved again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameReport {
    /// The log.
    pub file: String,
    pub frame: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// The recorded input.
    pub input: InputFacts,
    /// The control level that decided.
    pub level: &'static str,
    /// The recorded gimbal commands in pitch and yaw, rad.
    pub recorded_gimbal_rad: Vec<f64>,
    /// The gimbal commands of this build, rad.
    pub gimbal_rad: Vec<f64>,
    /// Whether the whole output is equal to the recorded one, bit for bit; and the memory, unless it covers the pad.
    pub identical: bool,
    /// The solve as in flight; `None` if this frame solved nothing.
    pub warm: Option<Solved>,
    /// The same problem with a cold start.
    pub cold: Option<Solved>,
    /// What an independent solver says about the plan.
    pub judged: Option<Judged>,
    /// The nearest frame that solves a landing: this frame if it does, `None` if no frame does.
    pub nearest_solved: Option<u64>,
    /// Limits and conditions that the warm plan touches.
    pub active: Vec<ActiveConstraint>,
    /// The plan: time from the frame, s, and state at each node.
    pub path: Vec<PathPoint>,
}

/// The input of the frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputFacts {
    /// State components in order: x, z, theta, u, w, q; in the plane of the landing, with velocities relative to the air.
    pub state: [f64; 6],
    pub time_since_ignition_s: f64,
    /// The gimbal angles held, rad.
    pub gimbal_applied_rad: Vec<f64>,
    /// Estimated thrust over nominal thrust.
    pub thrust_scale: f64,
}

/// A node of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PathPoint {
    /// Time from the frame, s.
    pub time_s: f64,
    /// State components in order: x, z, theta, u, w, q.
    pub state: [f64; 6],
    /// The input from here on, rad; `None` at the end.
    pub gimbal_rad: Option<f64>,
}

/// Solves one recorded frame again.
///
/// # Errors
/// See [`ExplainError`].
pub fn explain(recording: &Recording, number: u64) -> Result<FrameReport, ExplainError> {
    let (start, frames) = recording.replayable_frames()?;
    let computer = LoggedComputer::recorded(recording.profile_toml()?, start, &recording.head.run, &[])?;
    let mut controller = if recording.from_power_up { computer.without_digests() } else { computer };
    let logged = |frame: &ComputerFrame| recording.release_frame + frame.input.frame;
    let place = frames.iter().position(|frame| logged(frame) == number).ok_or_else(|| {
        let bound = |frame: Option<&ComputerFrame>| frame.map_or(0, logged);
        ExplainError::NoFrame {
            name: recording.name.clone(),
            frame: number,
            first: bound(frames.first()),
            last: bound(frames.last()),
        }
    })?;
    for before in &frames[..place] {
        controller.run_again(before)?;
    }
    let recorded = &frames[place];
    let time_s = recorded.input.time_s;
    let held = place.checked_sub(1).and_then(|before| frames.get(before));
    let (again, solved) = controller.run_inspected(recorded)?;
    let pilot = controller.pilot();
    let warm = solved.as_ref().map(|solved| &solved.warm.solution);
    let state = match &solved {
        Some(solved) => solved.problem.initial,
        None => in_plane(pilot),
    };
    Ok(FrameReport {
        file: recording.name.clone(),
        frame: number,
        time_s,
        phase: phase_name(&again.output),
        input: InputFacts {
            state: state.to_array(),
            time_since_ignition_s: pilot.burning_s(time_s).unwrap_or(0.0),
            gimbal_applied_rad: held.map_or_else(Vec::new, |held| held.output.gimbal_rad.clone()),
            thrust_scale: pilot.scales()[0],
        },
        level: level_of(&again.output).map_or("unknown", ControlLevel::name),
        recorded_gimbal_rad: recorded.output.gimbal_rad.clone(),
        gimbal_rad: again.output.gimbal_rad.clone(),
        identical: again.encode_to_vec() == recorded.encode_to_vec(),
        warm: warm.map(solved_facts),
        cold: solved.as_ref().map(|solved| solved_facts(&solved.cold.solution)),
        judged: solved.as_ref().map(|solved| judged(&solved.problem, &solved.warm.solution)),
        nearest_solved: nearest(number, frames.iter().filter(|frame| plans(frame)).map(logged)),
        active: solved
            .as_ref()
            .map(|solved| active_constraints(&solved.problem, &solved.warm.solution))
            .unwrap_or_default(),
        path: warm.map(path).unwrap_or_default(),
    })
}

fn nearest(number: u64, solved: impl Iterator<Item = u64>) -> Option<u64> {
    solved.min_by_key(|frame| frame.abs_diff(number))
}

fn solved_facts(solution: &Solution) -> Solved {
    Solved {
        status: solution.status.name(),
        iterations: solution.iterations,
        cost: solution.cost,
        kkt_stationarity: solution.kkt_stationarity,
        kkt_feasibility: solution.kkt_feasibility,
        condition_miss: solution.condition_miss,
        gimbal_rad: solution.inputs_rad.first().copied().unwrap_or(f64::NAN),
    }
}

fn judged(problem: &Problem, flown: &Solution) -> Judged {
    let reference = reference_solver::solve(problem, None);
    let merit = |plan: &Solution| plan.cost + problem.solver.terminal_penalty * plan.condition_miss;
    let first_rad = |plan: &Solution| plan.inputs_rad.first().copied().unwrap_or(f64::NAN);
    let end = |plan: &Solution| plan.states.last().copied().unwrap_or_default();
    let (ours, theirs) = (end(flown), end(&reference));
    Judged {
        flown_dearer: merit(flown) / merit(&reference) - 1.0,
        first_input_rad: (first_rad(flown) - first_rad(&reference)).abs(),
        touchdown_m: libm::hypot(ours.x_m - theirs.x_m, ours.z_m - theirs.z_m),
        touchdown_m_s: libm::hypot(ours.u_m_s - theirs.u_m_s, ours.w_m_s - theirs.w_m_s),
        reference: solved_facts(&reference),
    }
}

fn active_constraints(problem: &Problem, solution: &Solution) -> Vec<ActiveConstraint> {
    let mut active: Vec<ActiveConstraint> = Vec::new();
    let mut note = |what: String, at: usize, multiplier: f64| match active
        .iter_mut()
        .find(|constraint| constraint.what == what)
    {
        Some(known) => {
            known.at.push(at);
            if multiplier.abs() > known.multiplier.abs() {
                known.multiplier = multiplier;
            }
        }
        None => active.push(ActiveConstraint { what, at: vec![at], multiplier }),
    };
    let limit_rad = problem.gimbal_limit_rad;
    for (interval, input_rad) in solution.inputs_rad.iter().enumerate() {
        let [lower, upper] = solution.limit_multipliers.get(interval).copied().unwrap_or_default();
        if limit_rad - input_rad.abs() < ACTIVE {
            let multiplier = if *input_rad > 0.0 { upper } else { lower };
            let sign = if *input_rad > 0.0 { "<= " } else { ">= -" };
            note(format!("gimbal_rad {sign}{limit_rad:.4}"), interval, multiplier);
        }
    }
    let states: Vec<[f64; 6]> = solution.states.iter().map(|state| state.to_array()).collect();
    let multipliers = solution.end_multipliers.iter().chain(&solution.floor_multipliers);
    for (condition, multiplier) in problem.conditions().iter().zip(multipliers) {
        let name = COMPONENTS.get(condition.component).copied().unwrap_or("?");
        let bound = condition.sign * condition.offset;
        if condition.equality {
            note(format!("{name} = {bound:.4}"), condition.node, *multiplier);
        } else if condition.value(&states) < ACTIVE {
            let sign = if condition.sign > 0.0 { ">=" } else { "<=" };
            note(format!("{name} {sign} {bound:.4}"), condition.node, *multiplier);
        }
    }
    active
}

/// Whether a landing is planned in a frame.
fn plans(frame: &ComputerFrame) -> bool {
    let idle = u32::from(ControlLevel::Idle.index());
    frame.input.frame.is_multiple_of(FRAMES_PER_PLAN) && frame.output.level != idle
}

/// The estimated motion in the plane of the landing; before such a plane exists, in the world's x-z plane.
fn in_plane(pilot: &Pilot) -> PlanarState {
    let nil = Vector3::zeros();
    let plane = pilot.plane().copied().unwrap_or_else(|| Plane::choose(&nil, &nil, &nil));
    pilot.estimate().map_or_else(PlanarState::default, |estimate| {
        let wind_m_s = estimate.wind_m_s.push(0.0).dot(&plane.along);
        plane.project(&estimate.state, 0.0, wind_m_s)
    })
}

fn path(solution: &Solution) -> Vec<PathPoint> {
    let inputs = solution.inputs_rad.iter().copied().map(Some).chain(std::iter::repeat(None));
    let points = solution.states.iter().zip(inputs).enumerate();
    points
        .map(|(node, (state, gimbal_rad))| PathPoint {
            time_s: node as f64 * solution.step_s,
            state: state.to_array(),
            gimbal_rad,
        })
        .collect()
}

/// Most nodes of the plan that are shown.
const NODES_SHOWN: usize = 12;

/// Writes a frame as text.
///
/// # Errors
/// The output failed.
pub fn print_explained(report: &FrameReport, output: &mut impl Write) -> io::Result<()> {
    let FrameReport { frame, time_s, phase, level, input, .. } = report;
    writeln!(output, "{}: frame {frame} ({time_s:.3} s, {phase}), decided by {level}", shown(&report.file))?;
    let [x, z, theta, u, w, q] = input.state;
    writeln!(
        output,
        "input    x {x:.3} m, z {z:.3} m, theta {:.3} deg, u {u:.3} m/s, w {w:.3} m/s, q {:.3} deg/s",
        theta.to_degrees(),
        q.to_degrees()
    )?;
    writeln!(
        output,
        "         {:.3} s since ignition, gimbal held {} deg, thrust {:.4} of nominal",
        input.time_since_ignition_s,
        degrees(&input.gimbal_applied_rad),
        input.thrust_scale
    )?;
    let same = if report.identical { "identical bit for bit" } else { "NOT IDENTICAL" };
    writeln!(
        output,
        "command  {} deg as recorded, {} deg now: {same}",
        degrees(&report.recorded_gimbal_rad),
        degrees(&report.gimbal_rad)
    )?;
    if report.warm.is_none() && report.cold.is_none() {
        let nearest = report.nearest_solved.map_or_else(
            || "no frame of this log does".to_owned(),
            |nearest| format!("the nearest that does is {nearest}"),
        );
        return writeln!(output, "solve    this frame solves no landing; {nearest}");
    }
    for (name, solved) in [("warm", &report.warm), ("cold", &report.cold)] {
        match solved {
            Some(solved) => print_solved(name, solved, output)?,
            None => writeln!(output, "{name:<8} nothing was kept from a solve at this frame")?,
        }
    }
    if let (Some(warm), Some(cold)) = (&report.warm, &report.cold) {
        writeln!(
            output,
            "         the warm start saves {} iterations; costs differ by {:.3e}, first inputs by {:.3e} rad",
            cold.iterations.cast_signed() - warm.iterations.cast_signed(),
            (warm.cost - cold.cost).abs(),
            (warm.gimbal_rad - cold.gimbal_rad).abs()
        )?;
    }
    if let Some(judged) = &report.judged {
        print_solved("clarabel", &judged.reference, output)?;
        let word = if judged.flown_dearer > 0.0 { "dearer" } else { "cheaper" };
        writeln!(
            output,
            "         the flown plan is {:.1e} % {word}; first inputs are {:.1e} rad apart, touchdowns {:.1e} m and {:.1e} m/s",
            100.0 * judged.flown_dearer.abs(),
            judged.first_input_rad,
            judged.touchdown_m,
            judged.touchdown_m_s
        )?;
    }
    for (place, constraint) in report.active.iter().enumerate() {
        let name = if place == 0 { "active" } else { "" };
        let at: Vec<String> = constraint.at.iter().map(ToString::to_string).collect();
        writeln!(
            output,
            "{name:<8} {} at {}, multiplier {:.4e}",
            constraint.what,
            at.join(" "),
            constraint.multiplier
        )?;
    }
    if report.active.is_empty() {
        writeln!(output, "active   none")?;
    }
    print_path(report, output)
}

/// One angle, or pitch and yaw.
fn degrees(rad: &[f64]) -> String {
    rad.iter().map(|rad| format!("{:.4}", rad.to_degrees())).collect::<Vec<_>>().join(" ")
}

fn print_solved(name: &str, solved: &Solved, output: &mut impl Write) -> io::Result<()> {
    writeln!(
        output,
        "{name:<8} {}, {} iterations, cost {:.6}, stationarity {:.1e}, feasibility {:.1e}, conditions missed by {:.1e}",
        solved.status,
        solved.iterations,
        solved.cost,
        solved.kkt_stationarity,
        solved.kkt_feasibility,
        solved.condition_miss
    )
}

fn print_path(report: &FrameReport, output: &mut impl Write) -> io::Result<()> {
    let nodes = &report.path;
    let stride = nodes.len().div_ceil(NODES_SHOWN).max(1);
    for (node, point) in nodes.iter().enumerate() {
        if node % stride != 0 && node + 1 != nodes.len() {
            continue;
        }
        let name = if node == 0 { "path" } else { "" };
        let [x, z, theta, u, w, q] = point.state;
        let gimbal =
            point.gimbal_rad.map_or_else(String::new, |rad| format!(", gimbal {:.3} deg", rad.to_degrees()));
        writeln!(
            output,
            "{name:<8} +{:.1} s  x {x:>7.3} m  z {z:>7.3} m  theta {:>8.3} deg  u {u:>7.3} m/s  w {w:>7.3} m/s  q {:>8.3} deg/s{gimbal}",
            point.time_s,
            theta.to_degrees(),
            q.to_degrees()
        )?;
    }
    Ok(())
}

pub(super) fn run(file: &Path, number: u64, json: bool) -> Result<Outcome> {
    let recording = Recording::open(file)?;
    warn_of_what_is_missing(&recording);
    let report = explain(&recording, number)?;
    answer(|output| if json { print_json(&report, output) } else { print_explained(&report, output) })?;
    Ok(Outcome::Given)
}
