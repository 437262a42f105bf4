//! One tick of the controller: from estimate to gimbal command.
//!
//! [`step`] is deterministic: the same sequence of [`ControllerInput`]s from the same [`ControllerConfig`] gives
//! the same bits. The caller decides whether an output came too late to be applied, and tells the next tick.
//!
//! A command computed at a tick is applied one sample later, so each tick first predicts the state over the sample
//! in between, with the gimbal angle that the actuator holds. On the pad the controller rehearses: it solves the
//! landing from the profile's start state. So "controller warm" is a real arming check, and the first powered tick
//! starts from a converged plan. Without a converged plan the controller degrades in reported steps: see
//! [`ControlLevel`].

mod inspect;
mod plan;
mod step;

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use serde::{Deserialize, Serialize};

pub use plan::Plan;
pub use step::step;

use crate::guidance::landing::landing_problem;
use crate::guidance::stabiliser::Stabiliser;
use crate::rules::phase::Phase;
use crate::vehicle::dynamics::{PlanarModel, PlanarState};
use crate::vehicle::profile::Profile;
use nmpc::{Problem, Solution, SolveStatus, WarmStart, Workspace};

/// The longest horizon a profile may ask for, intervals.
pub const MAX_HORIZON_STEPS: usize = 200;

/// The configuration of the controller.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerConfig {
    profile: Profile,
    model: PlanarModel,
    stabiliser: Stabiliser,
}

impl ControllerConfig {
    /// The configuration from a profile.
    pub fn from_profile(profile: &Profile) -> Self {
        Self {
            profile: profile.clone(),
            model: profile.planar_model(),
            stabiliser: Stabiliser::from_profile(profile),
        }
    }

    /// The profile it was built from.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Time between ticks, s.
    pub fn sample_time_s(&self) -> f64 {
        self.profile.nmpc.sample_time_s
    }
}

/// What the controller remembers between ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerState {
    config: ControllerConfig,
    /// The plan being flown or rehearsed, if any.
    flown: Option<FlownPlan>,
    room: Room,
}

/// Buffers of a tick, so that a tick does not allocate. They are not memory: the result does not depend on them.
#[derive(Debug, Clone)]
struct Room {
    workspace: Workspace,
    problem: Problem,
    warm: WarmStart,
    solution: Solution,
}

impl PartialEq for Room {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl ControllerState {
    /// The state before the first tick.
    pub fn new(config: &ControllerConfig) -> Self {
        let problem = landing_problem(&config.profile, config.profile.start.planar_state(), 0.0, 0, 1.0);
        let room = Room {
            workspace: Workspace::default(),
            problem,
            warm: WarmStart::default(),
            solution: Solution::default(),
        };
        Self { config: config.clone(), flown: None, room }
    }

    pub fn config(&self) -> &ControllerConfig {
        &self.config
    }

    /// A digest of the memory, to compare a replay with a log.
    pub fn digest(&self) -> u64 {
        let Some(flown) = &self.flown else {
            return FNV_OFFSET;
        };
        let solution = &flown.solution;
        let states = solution.states.iter().flat_map(|state| state.to_array());
        let costates = solution.costates.iter().flatten().chain(solution.limit_multipliers.iter().flatten());
        let multipliers = solution.end_multipliers.iter().chain(&solution.floor_multipliers).chain(costates);
        let numbers = solution.inputs_rad.iter().chain(multipliers).copied().chain(states);
        let words =
            [flown.first_interval as u64, u64::from(flown.usable), u64::from(solution.status.index())];
        words.into_iter().chain(numbers.map(f64::to_bits)).fold(FNV_OFFSET, fnv)
    }
}

/// FNV-1a, 64 bits: Fowler, Noll and Vo's offset basis.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;

fn fnv(hash: u64, word: u64) -> u64 {
    word.to_le_bytes()
        .iter()
        .fold(hash, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// A plan and its beginning within the landing.
#[derive(Debug, Clone, PartialEq, Default)]
struct FlownPlan {
    /// Samples between ignition and the plan's beginning.
    first_interval: usize,
    /// The plan is good enough to be flown, not only a start for the next solve.
    usable: bool,
    solution: Solution,
}

/// All inputs of a tick except [`ControllerState`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerInput {
    /// Number of the tick.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    /// The phase, after this tick's transitions.
    pub phase: Phase,
    /// Time since the ignition command, s; 0 before.
    pub time_since_ignition_s: f64,
    /// The state estimate at this tick.
    pub state: PlanarState,
    /// The gimbal angle that the actuator holds during this sample, rad.
    pub gimbal_applied_rad: f64,
    /// Estimated thrust over nominal thrust.
    pub thrust_scale: f64,
    /// Only the upright law flies.
    pub degraded: bool,
    /// An abort with the motor lit is latched: the vehicle lands on the ground below, not on the pad.
    pub lands_here: bool,
    /// The previous tick's output came too late and was not applied.
    pub deadline_missed: bool,
}

/// The source of the gimbal command; the levels in flight are ordered from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum ControlLevel {
    /// Nothing to control; the gimbal is centred.
    Idle = 0,
    /// On the pad: the landing is rehearsed, the gimbal is centred.
    Rehearsal = 1,
    /// A converged plan that lands.
    Converged = 2,
    /// The best plan found: not converged, or missing its end conditions by a little.
    BestFeasible = 3,
    /// The previous plan, shifted to the present. This tick found no plan that is good enough, and the vehicle is where
    /// the previous plan expected it, or its position is unknown.
    ShiftedPlan = 4,
    /// The upright law.
    Stabiliser = 5,
}

impl ControlLevel {
    /// Every level, in index order.
    pub const ALL: [Self; 6] = [
        Self::Idle,
        Self::Rehearsal,
        Self::Converged,
        Self::BestFeasible,
        Self::ShiftedPlan,
        Self::Stabiliser,
    ];

    /// The name operators see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "IDLE",
            Self::Rehearsal => "REHEARSAL",
            Self::Converged => "CONVERGED",
            Self::BestFeasible => "BEST_FEASIBLE",
            Self::ShiftedPlan => "SHIFTED_PLAN",
            Self::Stabiliser => "STABILISER",
        }
    }

    /// The number in telemetry and logs, 0 to 5.
    pub fn index(self) -> u8 {
        self as u8
    }

    /// The level of a number, or `None` above 5.
    pub fn from_index(index: u8) -> Option<Self> {
        Self::ALL.get(usize::from(index)).copied()
    }
}

/// The result of this tick's solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverReport {
    /// How it ended; [`SolveStatus::NotRun`] if nothing was solved.
    pub status: SolveStatus,
    /// Newton iterations at this tick.
    pub iterations: u32,
    /// Iterations of the quadratic subproblems at this tick.
    pub qp_iterations: u32,
    /// Cost of the plan (Eq. 28 of the landing paper), from its beginning.
    pub cost: f64,
    /// Stationarity residual of the plan.
    pub kkt_stationarity: f64,
    /// Feasibility residual of the plan, m.
    pub kkt_feasibility: f64,
    /// Whether the plan meets its end and path conditions.
    pub landing_feasible: bool,
    /// Lower bound of the touchdown speed with any controller, m/s.
    pub best_touchdown_speed_m_s: f64,
}

impl SolverReport {
    /// No solve at this tick.
    pub const NOT_RUN: Self = Self {
        status: SolveStatus::NotRun,
        iterations: 0,
        qp_iterations: 0,
        cost: 0.0,
        kkt_stationarity: 0.0,
        kkt_feasibility: 0.0,
        landing_feasible: false,
        best_touchdown_speed_m_s: 0.0,
    };

    /// Whether the solve converged to a plan that lands.
    pub fn converged(&self) -> bool {
        self.status == SolveStatus::Converged && self.landing_feasible
    }

    /// The outcome in words for an operator.
    pub fn summary(&self) -> String {
        match self.status {
            SolveStatus::NotLandable => {
                format!("not landable: best touchdown speed {:.1} m/s", self.best_touchdown_speed_m_s)
            }
            SolveStatus::Converged if !self.landing_feasible => "converged, but misses the ground".to_owned(),
            status => status.name().to_owned(),
        }
    }
}

/// The end of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PredictedTouchdown {
    /// Time from this tick to the end of the plan, s.
    pub time_from_now_s: f64,
    /// The state there.
    pub state: PlanarState,
}

/// The output of a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerOutput {
    /// Number of the tick, from the input.
    pub tick: u64,
    /// Gimbal angle to be applied one sample later, rad.
    pub gimbal_command_rad: f64,
    /// Fin opening angles, rad.
    pub fin_command_rad: [f64; 4],
    /// The source of the gimbal command.
    pub level: ControlLevel,
    /// The result of the solve.
    pub solver: SolverReport,
    /// The end of the plan.
    pub predicted_touchdown: PredictedTouchdown,
    pub plan: Plan,
}

impl ControllerOutput {
    /// The gimbal angle to apply when this is the last output in time and `missed` later outputs came too late, rad:
    /// the plan's next input, and zero after the plan's end.
    ///
    /// Holding the last command instead could turn the vehicle by radians per second within one sample.
    pub fn command_after_misses_rad(&self, missed: usize) -> f64 {
        if missed == 0 {
            return self.gimbal_command_rad;
        }
        // A rehearsed plan is not flown.
        let flown = !matches!(self.level, ControlLevel::Idle | ControlLevel::Rehearsal);
        self.plan.used_gimbal_rad().get(missed).copied().filter(|_| flown).unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests;
