//! What the landing burn is set to and what it reports: its settings in a mission, the report of a tick, and how a replay
//! reads and changes the guidance.

use nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, pose, solve_free_time};
use nmpc::{Problem, SolveStatus};
use serde::{Deserialize, Serialize};

use super::situation::Ahead;
use super::{Homing, Plane, PoweredGuidance, PoweredSituation, SpaceSettings};
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::mission::{FinalBox, SolverLimits, StateWeights};
use crate::vehicle::rigid::RigidState;

/// What decides where the nose points; the levels in flight are ordered from best to worst.
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
    /// The previous plan goes on: this tick found none that is good enough.
    ShiftedPlan = 4,
    /// Upright, with a lean against the sideways velocity.
    Stabiliser = 5,
}

impl ControlLevel {
    /// The level after a plan was tried. `usable`: it is finite and flyable; `left_s`: time that an earlier plan still has, s;
    /// `too_low`: no landing is left to plan; `lands`: the plan converged on its end.
    pub(super) fn of_plan(usable: bool, left_s: Option<f64>, too_low: bool, lands: bool) -> Self {
        if !usable {
            if left_s.is_some_and(|left_s| left_s > 0.0) { Self::ShiftedPlan } else { Self::Stabiliser }
        } else if too_low {
            Self::Stabiliser
        } else if lands {
            Self::Converged
        } else {
            Self::BestFeasible
        }
    }

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

/// The report of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PoweredReport {
    /// The source of the nose's direction.
    pub level: ControlLevel,
    /// How the last solve ended.
    pub status: SolveStatus,
    /// Iterations over all final times tried.
    pub iterations: usize,
    /// Work of the tick: the solver's passes over an interval, as in [`PoweredSettings::max_passes`].
    pub passes: usize,
    /// Residuals of the optimality conditions.
    pub kkt_stationarity: f64,
    /// Largest defect or complementarity.
    pub kkt_feasibility: f64,
    /// Cost of the plan.
    pub cost: f64,
    /// Largest miss of the plan's end conditions.
    pub condition_miss: f64,
    /// Time to the planned touchdown, s.
    pub touchdown_in_s: f64,
    /// The planned state at touchdown; velocities are through the air.
    pub touchdown: PlanarState,
    /// Largest planned tilt, rad.
    pub largest_tilt_rad: f64,
}

impl PoweredReport {
    /// Before the first tick.
    pub fn idle() -> Self {
        Self {
            level: ControlLevel::Idle,
            status: SolveStatus::NotRun,
            iterations: 0,
            passes: 0,
            kkt_stationarity: 0.0,
            kkt_feasibility: 0.0,
            cost: 0.0,
            condition_miss: 0.0,
            touchdown_in_s: 0.0,
            touchdown: PlanarState::default(),
            largest_tilt_rad: 0.0,
        }
    }
}

// The settings of the landing burn in a mission.

/// The settings of the landing burn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoweredSettings {
    /// Largest length of a planned interval, s.
    pub interval_s: f64,
    /// Weights of the plan.
    pub weights: StateWeights,
    /// A plan that tilts further than this is planned again with more weight on being upright, degrees.
    pub tilt_max_deg: f64,
    /// Largest planned gimbal angle on either side, degrees; the attitude loop has the rest of the travel.
    pub gimbal_deg: f64,
    /// Choice of the landing point along the plane.
    pub homing: Homing,
    /// Largest horizontal distance from that point at the end, m.
    pub x_final_m: f64,
    /// Box in which the plan ends; its lateral speed is over the ground.
    #[serde(rename = "final")]
    pub final_box: FinalBox,
    /// Smallest height of the feet per second before touchdown, m/s.
    pub floor_rise_m_s: f64,
    /// Latest end of a plan after the thrust has fallen through the weight, s.
    pub latest_after_s: f64,
    /// How long before touchdown a plan is inside the box, except for its axial velocity, s.
    pub settled_s: f64,
    /// A plan that ends sooner than this is flown to its end, s.
    pub flown_out_s: f64,
    /// During this time before the plan's end the nose is not turned any more, only held, s.
    pub quiet_s: f64,
    /// The same during this time before the lowest foot is expected to touch, whatever the plan says, s.
    #[serde(default)]
    pub contact_quiet_s: f64,
    /// Largest number of final times tried in a tick.
    pub max_solves: u32,
    /// Largest number of passes of the solver over an interval in a tick, over all its guesses and final times
    /// ([`stages::Workspace::allow`](nmpc::free_time::FreeTimeWorkspace::allow)): the best plan until then stands, and the next
    /// tick goes on from it. Without it there is no bound.
    #[serde(default)]
    pub max_passes: Option<usize>,
    /// Largest miss of a plan's end (m, rad, m/s or rad/s) that still counts as a landing.
    pub landing_miss: f64,
    /// Decay rate of the velocity across the plane, 1/s.
    pub across_decay_per_s: f64,
    /// Acceleration towards the pad across the plane per metre, 1/s^2.
    pub across_homing_per_s2: f64,
    /// Largest lean across the plane, degrees.
    pub across_lean_max_deg: f64,
    /// If it is there, the landing is planned in space, not in a plane.
    #[serde(default)]
    pub space: Option<SpaceSettings>,
    /// Limits of the solver.
    pub solver: SolverLimits,
}

// Reads the guidance's memory and changes its settings, for a replay.

/// A landing that is planned again outside the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct LandingSolved {
    /// The problem at the final time of the warm plan, with its conditions, limits and motor.
    pub problem: Problem,
    /// Solved as in flight, from the previous plan.
    pub warm: FreeTimeSolution,
    /// Solved cold.
    pub cold: FreeTimeSolution,
}

impl PoweredGuidance {
    /// The plane of the landing, once there is one.
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// The planned planar states and the step between them, s, if there is a plan. They are in the frame that moves
    /// with the air along the plane; [`Plane::over_ground`] converts them.
    pub fn planned(&self) -> Option<(&[PlanarState], f64)> {
        if let Some(in_space) = self.space.projected() {
            return Some(in_space);
        }
        let flown = self.flown.as_ref()?;
        Some((&flown.plan.solution.states, flown.plan.solution.step_s))
    }

    /// The same memory with other settings.
    #[must_use]
    pub(crate) fn reconfigured(&self, settings: &PoweredSettings) -> Self {
        Self { settings: *settings, ..self.clone() }
    }

    /// Solves the landing that [`plan`](Self::plan) solves, outside the flight; `None` if there is none. `self` is the
    /// memory before the plan, `decided` the memory after it.
    pub(crate) fn inspect(
        &self,
        decided: &Self,
        time_s: f64,
        state: &RigidState,
        preferred: &PoweredSituation<'_>,
        fallback: Option<&PoweredSituation<'_>>,
    ) -> Option<LandingSolved> {
        let plane = decided.plane?;
        if self.is_flown_out(time_s) || self.settings.space.is_some() {
            return None;
        }
        let mut again = self.clone();
        let (posed, situation) = again.solve_either(time_s, &plane, state, preferred, fallback)?;
        let (ahead, warm) = (Ahead(situation), again.trial);
        let cold = solve_free_time(&posed, &ahead, None);
        Some(LandingSolved { problem: at_final_time(&posed, &ahead, warm.final_time_s), warm, cold })
    }
}

impl PoweredGuidance {
    pub(crate) fn inspect_space(
        &self,
        time_s: f64,
        state: &RigidState,
        preferred: &PoweredSituation<'_>,
    ) -> Option<super::SpaceSolved> {
        let space = self.settings.space.as_ref().filter(|_| !self.is_flown_out(time_s))?;
        self.space.inspect(time_s, state, preferred, &self.settings, space)
    }
}

/// The problem of one final time.
fn at_final_time(posed: &FreeTimeProblem, ahead: &Ahead<'_, '_>, final_time_s: f64) -> Problem {
    let mut problem = posed.landing.clone();
    pose(posed, ahead, final_time_s, &mut problem);
    problem
}

// The guidance's memory, for the pilot's digest.
