//! One recorded tick, solved again alone.
//!
//! The controller is brought to the tick by running every one before it, so that its warm start is the one it had in
//! flight. Then the same landing problem is solved once more from nothing, and the two are put side by side.

mod pilot;
mod planar;

use flight::nmpc::{Problem, Solution};
use serde::Serialize;
use tick_log::TickLogError;
use tick_log::pilot::PilotLogError;

use crate::controller::{FrameError, PilotStartError};
use crate::log::{Recording, RecordingError};
use crate::settings::SettingError;

/// A condition or limit closer than this to being broken is active, in its own unit (m, rad, m/s or rad/s).
const ACTIVE: f64 = 1e-4;

/// State components in order, with their units.
const COMPONENTS: [&str; 6] = ["x_m", "z_m", "theta_rad", "u_m_s", "w_m_s", "q_rad_s"];

/// Why a tick cannot be solved again.
#[derive(Debug, thiserror::Error)]
pub enum TickError {
    /// The log has not what it takes.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The log names settings that this build does not have.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A recorded input has no meaning in this build.
    #[error(transparent)]
    Input(#[from] TickLogError),
    /// The flight computer cannot be let go again.
    #[error(transparent)]
    PilotStart(#[from] PilotStartError),
    /// A recorded frame has no meaning in this build.
    #[error(transparent)]
    FrameInput(#[from] PilotLogError),
    /// A recorded frame cannot be run again.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// No such tick.
    #[error("{name}: no tick {tick} that can be re-executed; there are {first} to {last}")]
    NoTick {
        /// The file.
        name: String,
        /// What was asked for.
        tick: u64,
        /// The first there is.
        first: u64,
        /// The last there is.
        last: u64,
    },
}

/// How a solve went.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Solved {
    /// How it ended.
    pub status: &'static str,
    /// Newton iterations.
    pub iterations: usize,
    /// Cost of the plan.
    pub cost: f64,
    /// Stationarity residual.
    pub kkt_stationarity: f64,
    /// Feasibility residual.
    pub kkt_feasibility: f64,
    /// How far the path misses its conditions at worst, m, rad, m/s or rad/s.
    pub condition_miss: f64,
    /// The first input, rad.
    pub gimbal_rad: f64,
}

/// A limit or condition that the plan touches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActiveConstraint {
    /// What it is about, as in `w_m_s <= 0.03`.
    pub what: String,
    /// Nodes or intervals of the plan at which it is active.
    pub at: Vec<usize>,
    /// The largest multiplier among them; what loosening by one unit would save.
    pub multiplier: f64,
}

/// A tick, solved again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TickReport {
    /// The log.
    pub file: String,
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    /// Its phase.
    pub phase: &'static str,
    /// The recorded input.
    pub input: InputFacts,
    /// What decided.
    pub level: &'static str,
    /// The gimbal command as recorded, rad: one angle, or pitch and yaw.
    pub recorded_gimbal_rad: Vec<f64>,
    /// As decided now, rad.
    pub gimbal_rad: Vec<f64>,
    /// Whether the whole output and the memory are the recorded ones, bit for bit, but for the recorded plan.
    pub identical: bool,
    /// The solve as in flight; `None` if this tick solved nothing.
    pub warm: Option<Solved>,
    /// The same problem from nothing.
    pub cold: Option<Solved>,
    /// The nearest tick that solves a landing; this one if it does, `None` if none does.
    pub nearest_solved: Option<u64>,
    /// Limits and conditions that the warm plan touches.
    pub active: Vec<ActiveConstraint>,
    /// The plan: time from the tick, s, and state at each node.
    pub path: Vec<PathPoint>,
}

/// What the tick was given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputFacts {
    /// State components in order: x, z, theta, u, w, q. Of a flight from apogee those in the plane of the landing, with
    /// velocities through the air.
    pub state: [f64; 6],
    /// Time since ignition, s.
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
    if recording.is_from_apogee() { pilot::frame(recording, number) } else { planar::tick(recording, number) }
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
