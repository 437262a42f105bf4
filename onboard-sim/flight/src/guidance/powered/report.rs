//! The report of a tick of the landing burn.

use serde::{Deserialize, Serialize};

use crate::vehicle::dynamics::PlanarState;
use nmpc::SolveStatus;

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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoweredReport {
    /// The source of the nose's direction.
    pub level: ControlLevel,
    /// How the last solve ended.
    pub status: SolveStatus,
    /// Iterations over all final times tried.
    pub iterations: usize,
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
