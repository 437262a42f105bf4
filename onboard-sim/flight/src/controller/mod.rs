//! One tick of the controller: from estimate to gimbal command.
//!
//! [`step`] is deterministic: the same sequence of [`ControllerInput`]s from the same [`ControllerConfig`] gives
//! the same bits. Whether an output came too late to be applied is decided outside and comes back as an input.
//!
//! A command computed at a tick is applied one sample later, so each tick first predicts the state over the sample
//! in between, under the gimbal angle the actuator holds. On the pad the controller rehearses: it solves the
//! landing from the profile's start state, so that "controller warm" is an honest arming check and the first
//! powered tick starts from a converged plan. When no converged plan can be had it degrades in announced steps:
//! see [`ControlLevel`].

mod inspect;
mod plan;
mod step;

pub use plan::Plan;
pub use step::step;

use crate::dynamics::{PlanarModel, PlanarState};
use crate::nmpc::{Problem, Solution, SolveStatus, WarmStart, Workspace};
use crate::phase::Phase;
use crate::profile::Profile;
use crate::stabiliser::Stabiliser;

/// The longest horizon a profile may ask for, intervals.
pub const MAX_HORIZON_STEPS: usize = 200;

/// What the controller is built from.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerConfig {
    profile: Profile,
    model: PlanarModel,
    stabiliser: Stabiliser,
}

impl ControllerConfig {
    /// The controller of a profile.
    pub fn from_profile(profile: &Profile) -> Self {
        Self {
            profile: profile.clone(),
            model: PlanarModel::from_profile(profile),
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

/// Room for a tick's work, so that a tick does not allocate. Nothing of it is remembered: all rooms are equal.
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
        let problem =
            Problem::from_profile(&config.profile, config.profile.start.planar_state(), 0.0, 0, 1.0);
        let room = Room {
            workspace: Workspace::default(),
            problem,
            warm: WarmStart::default(),
            solution: Solution::default(),
        };
        Self { config: config.clone(), flown: None, room }
    }

    /// The configuration.
    pub fn config(&self) -> &ControllerConfig {
        &self.config
    }

    /// A number that differs whenever what is remembered differs, to compare a replay with a log.
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

/// A plan and where in the landing it begins.
#[derive(Debug, Clone, PartialEq, Default)]
struct FlownPlan {
    /// Samples between ignition and the plan's beginning.
    first_interval: usize,
    /// The plan is worth flying, not only worth starting the next solve from.
    usable: bool,
    solution: Solution,
}

/// Everything a tick depends on besides [`ControllerState`].
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
    /// The gimbal angle the actuator holds during this sample, rad.
    pub gimbal_applied_rad: f64,
    /// Estimated thrust over nominal thrust.
    pub thrust_scale: f64,
    /// Only the upright law flies.
    pub degraded: bool,
    /// An abort with the motor lit is latched: the vehicle lands on the ground below it, wherever the pad is.
    pub lands_here: bool,
    /// The previous tick's output came too late and was not applied.
    pub deadline_missed: bool,
}

/// What decided the gimbal command, best first in flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
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
    /// The previous plan, shifted to the present: no plan worth flying was found at this tick, and the vehicle is
    /// where the previous one wanted it, or nobody knows where it is.
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

    /// The number sent over the air and written to logs, 0 to 5.
    pub fn index(self) -> u8 {
        self as u8
    }

    /// The level of a number, or `None` above 5.
    pub fn from_index(index: u8) -> Option<Self> {
        Self::ALL.get(usize::from(index)).copied()
    }
}

/// How this tick's solve went.
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
    /// The plan meets its end and path conditions.
    pub landing_feasible: bool,
    /// Lower bound of the touchdown speed under any controller, m/s.
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

    /// The outcome in an operator's words.
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

/// Where the plan ends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PredictedTouchdown {
    /// Time from this tick to the end of the plan, s.
    pub time_from_now_s: f64,
    /// The state there.
    pub state: PlanarState,
}

/// What a tick decides.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerOutput {
    /// Number of the tick, from the input.
    pub tick: u64,
    /// Gimbal angle to be applied one sample later, rad.
    pub gimbal_command_rad: f64,
    /// Fin opening angles, rad.
    pub fin_command_rad: [f64; 4],
    /// What decided the gimbal command.
    pub level: ControlLevel,
    /// How the solve went.
    pub solver: SolverReport,
    /// Where the plan ends.
    pub predicted_touchdown: PredictedTouchdown,
    /// The plan.
    pub plan: Plan,
}

impl ControllerOutput {
    /// The gimbal angle to apply when this is the last output that came in time and `missed` have come too late
    /// since, rad: the plan's own next inputs, and then centred.
    ///
    /// Holding the last command instead may turn the vehicle by radians per second within one sample.
    pub fn command_after_misses_rad(&self, missed: usize) -> f64 {
        if missed == 0 {
            return self.gimbal_command_rad;
        }
        // A rehearsed plan is not being flown.
        let flown = !matches!(self.level, ControlLevel::Idle | ControlLevel::Rehearsal);
        self.plan.used_gimbal_rad().get(missed).copied().filter(|_| flown).unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests;
