//! The landing in space: the nose may lean in any direction.
//!
//! A surplus of impulse is best wasted with a lean of constant size whose direction turns once around: the vehicle then
//! never passes through upright on the way, as it must in a plane, and comes to rest sideways by itself.
//!
//! Ground frame: `x`, `y` level, `z` up. The nose is `n = (sin p, cos p sin r, cos p cos r)`, so `p` is the lean towards
//! `x` and `r` the lean towards `y`, both zero upright. States are the position of the feet, the velocity, `p`, `r` and
//! their rates. Inputs are the gimbal angles that turn the nose towards growing `p` and `r`, and the share of the fins'
//! drag area that stands in the air.
//!
//! ```text
//! v'  = (T/m) (n - dp e_p - dr e_r) - g e_z + drag
//! p'' = (T l / I) dp - r'^2 sin p cos p
//! r'' = ((T l / I) dr + 2 p' r' sin p) / cos p
//! ```
//!
//! with `e_p = dn/dp`, `e_r = dn/dr / cos p`: a slender axisymmetric body that does not roll. The gimbal's angles are
//! small; their second order in the thrust is left out (0.3 % at 4.5 degrees).

mod air;
mod interval;
mod model;
mod nose;
#[cfg(test)]
mod tests;

use alloc::vec::Vec;

use crate::problem::SolverLimits;

pub use model::last_multipliers;
pub use nose::Nose;
pub use stages::{Outcome, Start, Status};

/// Number of states and inputs.
pub const STATES: usize = 10;
pub const INPUTS: usize = 3;

/// A state: feet (x, y, z), m; velocity, m/s; leans p and r, rad; their rates, rad/s.
pub type State = [f64; STATES];

/// The buffers of a solve, and its result.
pub type SpaceWorkspace = stages::Workspace<SpaceProblem, STATES, INPUTS>;

/// What an interval has of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Thrust over mass, m/s^2.
    pub thrust_m_s2: f64,
    /// Rotational acceleration of a radian of the gimbal, rad/s^2.
    pub turning_rad_s2: f64,
    /// One over the mass, 1/kg.
    pub per_kg: f64,
}

/// Half the air's density times drag areas, kg/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drag {
    /// Of the open fins, as wide as long: against the velocity.
    pub fins: f64,
    /// Along the axis.
    pub axial: f64,
    /// Across the axis.
    pub crossflow: f64,
}

/// The box of the end. A component may miss its centre by this on either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    /// Range of the vertical velocity, m/s, up positive.
    pub vertical_m_s: [f64; 2],
    pub lateral_m_s: f64,
    pub lean_rad: f64,
    pub rate_rad_s: f64,
    /// Number of last nodes inside the box, except for the vertical velocity, at least 1.
    pub settled_nodes: usize,
}

/// The weights of the running cost, per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the distance from the target, 1/m^2.
    pub place: f64,
    /// Of the leans, 1/rad^2.
    pub lean: f64,
    /// Of the rates, s^2/rad^2.
    pub rate: f64,
    /// Of the gimbal angles, 1/rad^2.
    pub gimbal: f64,
    /// Of the fins' distance from half open.
    pub fins: f64,
}

/// One landing: from a state now, through intervals of held gimbal angles, to the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceProblem {
    pub initial: State,
    pub step_s: f64,
    pub pushes: Vec<Push>,
    pub drag: Drag,
    /// Wind, m/s.
    pub wind_m_s: [f64; 2],
    pub gravity_m_s2: f64,
    /// Level place to land at, m.
    pub target_m: [f64; 2],
    pub weights: Weights,
    pub gimbal_limit_rad: f64,
    /// Largest lean `p` and `r`, rad.
    pub lean_max_rad: f64,
    pub end: End,
    /// Smallest height of the feet per second before the end, m/s.
    pub floor_rise_m_s: f64,
    /// Size of the lean of the cold guesses, rad, and its first direction from `x` towards `y`, rad.
    pub guess_lean_rad: f64,
    pub guess_towards_rad: f64,
    pub solver: SolverLimits,
}
