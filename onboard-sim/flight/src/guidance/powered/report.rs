//! Settings of the landing burn in a mission, and the report of a tick.

use ocp::Status;
use ocp::landing::SolverLimits;
use serde::{Deserialize, Serialize};

use super::Homing;
use crate::vehicle::mission::{FinalBox, PlanWeights};

numbered_enum! {
/// Source of the attitude command; the levels in flight are ordered from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub enum ControlLevel {
    /// Nothing to control; the gimbal is centred.
    #[default]
    Idle = "IDLE",
    /// On the pad: the landing is rehearsed, the gimbal is centred.
    Rehearsal = "REHEARSAL",
    /// A converged plan that lands.
    Converged = "CONVERGED",
    /// The best plan found: not converged, or missing its end conditions by a little.
    BestFeasible = "BEST_FEASIBLE",
    /// The previous plan continues: this tick found none that is good enough.
    ShiftedPlan = "SHIFTED_PLAN",
    /// Upright, with a lean against the sideways velocity.
    Stabiliser = "STABILISER",
}
}

impl ControlLevel {
    /// The level after a plan was tried. `usable`: it is finite and flyable; `left_s`: time that an
    /// earlier plan still has, s; `too_low`: no landing is left to plan; `lands`: the plan
    /// converged on its end.
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
}

/// The report of a tick; the default is that before the first.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PoweredReport {
    /// The source of the nose's direction.
    pub level: ControlLevel,
    /// How the last solve ended.
    pub status: Status,
    /// Iterations over all final times tried.
    pub iterations: usize,
    /// Work of the tick: the solver's passes over an interval, as in
    /// [`PoweredSettings::max_passes`].
    pub passes: usize,
    /// Time of the landing's request, s since the release.
    pub requested_at_s: f64,
    /// From then until the plan was taken over, s. The next one waits for that, if it is longer
    /// than a period.
    pub took_s: f64,
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
    /// Vertical velocity at the planned touchdown, m/s.
    pub touchdown_m_s: f64,
    /// Largest planned tilt, rad.
    pub largest_tilt_rad: f64,
}

/// The settings of the landing burn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PoweredSettings {
    /// Largest length of a planned interval, s.
    #[serde(default)]
    pub interval_s: f64,
    /// Weights of the plan.
    pub weights: PlanWeights,
    /// Size of the lean of the cold guesses, degrees.
    pub guess_lean_deg: f64,
    /// Largest lean of a plan in north and in west, degrees.
    #[serde(default)]
    pub tilt_max_deg: f64,
    /// Largest planned gimbal angle on either side, degrees; the attitude loop has the rest of the
    /// travel.
    #[serde(default)]
    pub gimbal_deg: f64,
    /// Choice of the landing point.
    pub homing: Homing,
    /// Box in which the plan ends; its lateral speed is over the ground.
    #[serde(rename = "final")]
    pub final_box: FinalBox,
    /// Smallest height of the feet per second before touchdown, m/s.
    #[serde(default)]
    pub floor_rise_m_s: f64,
    /// Latest end of a plan after the thrust has fallen through the weight, s.
    pub latest_after_s: f64,
    /// How long before touchdown a plan is inside the box, except for its axial velocity, s.
    #[serde(default)]
    pub settled_s: f64,
    /// A plan that ends sooner than this is flown to its end, s.
    pub flown_out_s: f64,
    /// During this time before the plan's end the nose is not turned any more, only held, s.
    pub quiet_s: f64,
    /// The same during this time before the expected contact of the lowest foot, whatever the plan,
    /// s.
    pub contact_quiet_s: f64,
    /// Largest number of final times tried in a tick.
    pub max_solves: u32,
    /// Largest number of solver passes over an interval in a tick, over all its guesses and final
    /// times (`ocp::Workspace::allow`): the best plan until then is used, and the next tick
    /// continues from it. Unbounded if absent.
    pub max_passes: Option<usize>,
    /// Largest miss of a plan's end (m, rad, m/s or rad/s) that still counts as a landing.
    pub landing_miss: f64,
    /// Without a plan, and at the end of one, the vehicle leans against a velocity that is to be
    /// lost: decay rate, 1/s.
    pub upright_decay_per_s: f64,
    /// Largest such lean, degrees.
    pub upright_lean_max_deg: f64,
    /// Limits of the solver.
    pub solver: SolverLimits,
}
