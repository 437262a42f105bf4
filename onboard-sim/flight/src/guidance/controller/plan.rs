//! The predicted path, with room for the longest horizon, so that it does not allocate.

use super::MAX_HORIZON_STEPS;
use crate::vehicle::dynamics::PlanarState;

/// A predicted path: `len` intervals of held gimbal angle between `len + 1` states.
#[derive(Clone, Copy, PartialEq)]
pub struct Plan {
    /// Number of intervals used, at most [`MAX_HORIZON_STEPS`]; 0 is no plan.
    pub len: usize,
    /// Time from this tick to the first state, s.
    pub starts_in_s: f64,
    /// Length of an interval, s.
    pub step_s: f64,
    /// States at the nodes; the first `len + 1` are used.
    pub states: [PlanarState; MAX_HORIZON_STEPS + 1],
    /// Gimbal angle of each interval, rad; the first `len` are used.
    pub gimbal_rad: [f64; MAX_HORIZON_STEPS],
}

impl Plan {
    /// No plan.
    pub fn none() -> Self {
        const REST: PlanarState =
            PlanarState { x_m: 0.0, z_m: 0.0, theta_rad: 0.0, u_m_s: 0.0, w_m_s: 0.0, q_rad_s: 0.0 };
        Self {
            len: 0,
            starts_in_s: 0.0,
            step_s: 0.0,
            states: [REST; MAX_HORIZON_STEPS + 1],
            gimbal_rad: [0.0; MAX_HORIZON_STEPS],
        }
    }

    /// The plan through these states with these inputs, cut off at the longest horizon.
    pub(super) fn through(states: &[PlanarState], inputs_rad: &[f64], starts_in_s: f64, step_s: f64) -> Self {
        let mut plan = Self::none();
        if states.is_empty() {
            return plan;
        }
        plan.len = inputs_rad.len().min(states.len() - 1).min(MAX_HORIZON_STEPS);
        plan.starts_in_s = starts_in_s;
        plan.step_s = step_s;
        for (place, state) in plan.states.iter_mut().zip(states.iter().take(plan.len + 1)) {
            *place = *state;
        }
        for (place, gimbal_rad) in plan.gimbal_rad.iter_mut().zip(inputs_rad.iter().take(plan.len)) {
            *place = *gimbal_rad;
        }
        plan
    }

    /// A plan without intervals, from a first state.
    pub(super) fn starting(state: PlanarState, starts_in_s: f64, step_s: f64) -> Self {
        let mut plan = Self::none();
        plan.starts_in_s = starts_in_s;
        plan.step_s = step_s;
        if let Some(place) = plan.states.first_mut() {
            *place = state;
        }
        plan
    }

    /// Adds an interval and the state after it, if there is room.
    pub(super) fn push(&mut self, gimbal_rad: f64, state: PlanarState) {
        if let (Some(input), Some(place)) =
            (self.gimbal_rad.get_mut(self.len), self.states.get_mut(self.len + 1))
        {
            *input = gimbal_rad;
            *place = state;
            self.len += 1;
        }
    }

    /// The states in use; empty without a plan.
    pub fn used_states(&self) -> &[PlanarState] {
        if self.len == 0 { &[] } else { self.states.get(..=self.len).unwrap_or_default() }
    }

    /// The gimbal angles in use, rad.
    pub fn used_gimbal_rad(&self) -> &[f64] {
        self.gimbal_rad.get(..self.len).unwrap_or_default()
    }
}

/// Compares only the entries in use.
impl core::fmt::Debug for Plan {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter
            .debug_struct("Plan")
            .field("starts_in_s", &self.starts_in_s)
            .field("step_s", &self.step_s)
            .field("states", &self.used_states())
            .field("gimbal_rad", &self.used_gimbal_rad())
            .finish_non_exhaustive()
    }
}
