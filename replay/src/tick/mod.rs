//! Solves one recorded tick again.
//!
//! The controller first runs every earlier tick, so that it has the warm start it had in flight. Then the same landing
//! problem is solved again with a cold start, and the two solutions are compared.

mod pilot;
mod planar;

use nmpc::{Problem, Solution};
use serde::Serialize;
use tick_log::TickLogError;
use tick_log::pilot::PilotLogError;

use crate::controller::FrameError;
use crate::log::{FlightKind, Recording, RecordingError};
use crate::settings::SettingError;

/// A condition or limit with less margin than this counts as active; in its own unit (m, rad, m/s or rad/s).
const ACTIVE: f64 = 1e-4;

/// State components in order, with their units.
const COMPONENTS: [&str; 6] = ["x_m", "z_m", "theta_rad", "u_m_s", "w_m_s", "q_rad_s"];

/// Why a tick cannot be solved again.
#[derive(Debug, thiserror::Error)]
pub enum TickError {
    /// The log lacks the records that are needed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The log names settings that this build does not have.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// This build cannot interpret a recorded input.
    #[error(transparent)]
    Input(#[from] TickLogError),
    /// This build cannot interpret a recorded frame.
    #[error(transparent)]
    FrameInput(#[from] PilotLogError),
    /// A recorded frame cannot be executed again.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The log has no such tick.
    #[error("{name}: no tick {tick} that can be re-executed; there are {first} to {last}")]
    NoTick {
        /// The file.
        name: String,
        /// The request.
        tick: u64,
        /// The first tick in the log.
        first: u64,
        /// The last tick in the log.
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

/// A tick that was solved again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TickReport {
    /// The log.
    pub file: String,
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// The recorded input.
    pub input: InputFacts,
    /// The control level that decided.
    pub level: &'static str,
    /// The recorded gimbal command, rad: one angle, or pitch and yaw.
    pub recorded_gimbal_rad: Vec<f64>,
    /// The gimbal command of this build, rad.
    pub gimbal_rad: Vec<f64>,
    /// Whether the whole output (except the plan) and the memory are equal to the recorded ones, bit for bit.
    pub identical: bool,
    /// The solve as in flight; `None` if this tick solved nothing.
    pub warm: Option<Solved>,
    /// The same problem with a cold start.
    pub cold: Option<Solved>,
    /// The nearest tick that solves a landing: this tick if it does, `None` if no tick does.
    pub nearest_solved: Option<u64>,
    /// Limits and conditions that the warm plan touches.
    pub active: Vec<ActiveConstraint>,
    /// The plan: time from the tick, s, and state at each node.
    pub path: Vec<PathPoint>,
}

/// The input of the tick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputFacts {
    /// State components in order: x, z, theta, u, w, q. For a flight from apogee, those in the plane of the landing,
    /// with velocities relative to the air.
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
    /// Time from the tick, s.
    pub time_s: f64,
    /// State components in order: x, z, theta, u, w, q.
    pub state: [f64; 6],
    /// The input from here on, rad; `None` at the end.
    pub gimbal_rad: Option<f64>,
}

/// Solves one recorded tick again.
///
/// # Errors
/// See [`TickError`].
pub fn tick(recording: &Recording, number: u64) -> Result<TickReport, TickError> {
    match recording.kind() {
        FlightKind::InSpace => pilot::frame(recording, number),
        FlightKind::Planar => planar::tick(recording, number),
    }
}

fn nearest(number: u64, solved: impl Iterator<Item = u64>) -> Option<u64> {
    solved.min_by_key(|tick| tick.abs_diff(number))
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
