//! The report of a tick of the landing burn.

use crate::guidance::controller::ControlLevel;
use crate::vehicle::dynamics::PlanarState;
use nmpc::SolveStatus;

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
