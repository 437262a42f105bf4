//! The plan being flown, and its values at a given time.

use alloc::vec::Vec;

use core::f64::consts::FRAC_PI_2;

use crate::vehicle::dynamics::PlanarState;
use nmpc::free_time::FreeTimeSolution;

/// A plan being flown.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Flown {
    pub(super) begins_s: f64,
    /// Rotational acceleration of a unit sine of the gimbal angle in each interval, rad/s^2.
    pub(super) turning_rad_s2: Vec<f64>,
    pub(super) plan: FreeTimeSolution,
}

impl Flown {
    pub(super) fn left_s(&self, time_s: f64) -> f64 {
        self.begins_s + self.plan.final_time_s - time_s
    }

    /// Planned velocity over the ground along the plane at a time, m/s; zero after the plan's end.
    pub(super) fn along_m_s(&self, time_s: f64, wind_m_s: f64) -> f64 {
        let solution = &self.plan.solution;
        let since = (time_s - self.begins_s).max(0.0) / solution.step_s;
        let k = since as usize;
        let along_m_s = |state: &PlanarState| {
            let (sin, cos) = libm::sincos(state.theta_rad);
            state.u_m_s * cos + state.w_m_s * sin + wind_m_s
        };
        match (solution.states.get(k), solution.states.get(k + 1)) {
            (Some(before), Some(after)) => {
                let share = since - k as f64;
                (1.0 - share) * along_m_s(before) + share * along_m_s(after)
            }
            _ => 0.0,
        }
    }

    /// Elevation, its rate and its acceleration at a time; upright and at rest after the plan's end.
    pub(super) fn elevation(&self, time_s: f64) -> (f64, f64, f64) {
        let solution = &self.plan.solution;
        let since_s = (time_s - self.begins_s).max(0.0);
        let k = (since_s / solution.step_s) as usize;
        let planned = solution.states.get(k).zip(solution.inputs_rad.get(k)).zip(self.turning_rad_s2.get(k));
        let Some(((state, input_rad), turning)) = planned else {
            return (FRAC_PI_2, 0.0, 0.0);
        };
        let along_s = since_s - k as f64 * solution.step_s;
        let acceleration = -turning * libm::sin(*input_rad);
        (
            state.theta_rad + along_s * (state.q_rad_s + 0.5 * along_s * acceleration),
            state.q_rad_s + along_s * acceleration,
            acceleration,
        )
    }
}

/// Largest planned tilt, rad.
pub(super) fn largest_tilt_rad(plan: &FreeTimeSolution) -> f64 {
    plan.solution.states.iter().map(|planned| (planned.theta_rad - FRAC_PI_2).abs()).fold(0.0, f64::max)
}
