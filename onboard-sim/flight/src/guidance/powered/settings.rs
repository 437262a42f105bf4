//! The settings of the landing burn in a mission.

use serde::Deserialize;

use super::{Homing, SpaceSettings};
use crate::vehicle::mission::{FinalBox, SolverLimits, StateWeights};

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
