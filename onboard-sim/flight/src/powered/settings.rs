//! How the landing burn is planned and flown, as a mission has it.

use serde::Deserialize;

use super::Homing;
use crate::profile::{FinalBox, SolverLimits, StateWeights};

/// How the landing burn is planned and flown.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoweredSettings {
    /// Length of a planned interval at most, s.
    pub interval_s: f64,
    /// Weights of the plan.
    pub weights: StateWeights,
    /// A plan that tilts further than this is planned again with more weight on being upright, degrees.
    pub tilt_max_deg: f64,
    /// Largest planned gimbal angle on either side, degrees; the rest of the travel is the attitude loop's.
    pub gimbal_deg: f64,
    /// Where along the plane a plan is drawn to.
    pub homing: Homing,
    /// Largest horizontal distance at the end from there, m.
    pub x_final_m: f64,
    /// Box the plan ends in; its lateral speed is over the ground.
    #[serde(rename = "final")]
    pub final_box: FinalBox,
    /// Least height of the feet for each second before touchdown, m/s.
    pub floor_rise_m_s: f64,
    /// How long after thrust has fallen through the weight a plan may end, s.
    pub latest_after_s: f64,
    /// How long before touchdown a plan is inside the box but for its axial velocity, s.
    pub settled_s: f64,
    /// A plan that ends sooner than this is flown out, s.
    pub flown_out_s: f64,
    /// So long before the plan's end the nose is no longer turned, only kept from turning, s.
    pub quiet_s: f64,
    /// Most final times tried in a tick.
    pub max_solves: u32,
    /// Largest miss of a plan's end (m, rad, m/s or rad/s) that still counts as a landing.
    pub landing_miss: f64,
    /// Decay rate of the velocity across the plane, 1/s.
    pub across_decay_per_s: f64,
    /// Push towards the pad across the plane for each metre, 1/s^2.
    pub across_homing_per_s2: f64,
    /// Largest lean across the plane, degrees.
    pub across_lean_max_deg: f64,
    /// Limits of the solver.
    pub solver: SolverLimits,
}
