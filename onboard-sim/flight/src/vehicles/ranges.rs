//! Range checks of what a file says: one line for each key.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::{String, ToString as _};
use core::fmt::Display;

use crate::vehicle::airframe;
use crate::vehicle::mission::{ArmingLimits, FinalBox, GateLimits, PlanWeights, SolverLimits};

/// A value outside its range.
pub(super) struct BadValue {
    /// The key, with its section.
    pub(super) key: String,
    pub(super) found: String,
    /// The accepted range, in words.
    pub(super) required: &'static str,
}

impl From<airframe::BadValue> for BadValue {
    fn from(bad: airframe::BadValue) -> Self {
        Self { key: bad.key.to_owned(), found: bad.found.to_string(), required: bad.required }
    }
}

pub(super) type Check = Result<(), BadValue>;

pub(super) fn require(
    ok: bool,
    key: impl Into<String>,
    found: impl Display,
    required: &'static str,
) -> Check {
    if ok { Ok(()) } else { Err(BadValue { key: key.into(), found: found.to_string(), required }) }
}

pub(super) fn positive(key: impl Into<String>, value: f64) -> Check {
    require(value.is_finite() && value > 0.0, key, value, "a finite number above 0")
}

pub(super) fn not_negative(key: impl Into<String>, value: f64) -> Check {
    require(value.is_finite() && value >= 0.0, key, value, "a finite number, 0 or more")
}

pub(super) fn share(key: impl Into<String>, value: f64) -> Check {
    require((0.0..=1.0).contains(&value), key, value, "from 0 to 1")
}

pub(super) fn angle_below_right(key: impl Into<String>, value_deg: f64) -> Check {
    require(value_deg > 0.0 && value_deg < 90.0, key, value_deg, "above 0 and below 90")
}

pub(super) fn weights(section: &str, weights: &PlanWeights) -> Check {
    let key = |name: &str| format!("{section}.weights.{name}");
    not_negative(key("x"), weights.x)?;
    not_negative(key("theta"), weights.theta)?;
    not_negative(key("q"), weights.q)?;
    positive(key("delta"), weights.delta)?;
    // Without a weight the fins of a plan are not unique.
    positive(key("fins"), weights.fins)
}

pub(super) fn final_box(section: &str, end: &FinalBox) -> Check {
    let key = |name: &str| format!("{section}.final.{name}");
    positive(key("pitch_error_deg"), end.pitch_error_deg)?;
    require((-10.0..=10.0).contains(&end.u_max_m_s), key("u_max_m_s"), end.u_max_m_s, "from -10 to 10")?;
    require(
        end.u_min_m_s >= -10.0 && end.u_min_m_s < end.u_max_m_s,
        key("u_min_m_s"),
        end.u_min_m_s,
        "from -10 to below u_max_m_s",
    )?;
    positive(key("w_m_s"), end.w_m_s)?;
    positive(key("pitch_rate_deg_s"), end.pitch_rate_deg_s)
}

pub(super) fn solver(section: &str, solver: &SolverLimits) -> Check {
    let key = |name: &str| format!("{section}.solver.{name}");
    require(
        (1..=1000).contains(&solver.max_iterations),
        key("max_iterations"),
        solver.max_iterations,
        "from 1 to 1000",
    )?;
    positive(key("kkt_tolerance"), solver.kkt_tolerance)?;
    positive(key("terminal_penalty"), solver.terminal_penalty)
}

pub(super) fn arming(arming: &ArmingLimits) -> Check {
    positive("arming.tilt_max_deg", arming.tilt_max_deg)?;
    positive("arming.rotation_max_deg_s", arming.rotation_max_deg_s)?;
    positive("arming.speed_max_m_s", arming.speed_max_m_s)?;
    not_negative("arming.battery_min_v", arming.battery_min_v)
}

pub(super) fn gate(gate: &GateLimits) -> Check {
    positive("gate.tilt_max_deg", gate.tilt_max_deg)?;
    positive("gate.pitch_rate_max_deg_s", gate.pitch_rate_max_deg_s)?;
    positive("gate.speed_error_max_fraction", gate.speed_error_max_fraction)?;
    positive("gate.height_disagreement_max_m", gate.height_disagreement_max_m)?;
    positive("gate.fence_radius_m", gate.fence_radius_m)
}
