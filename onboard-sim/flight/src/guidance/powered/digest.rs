//! The guidance's memory, for the pilot's digest.

use super::{Flown, Plane, PoweredGuidance, PoweredReport};
use crate::computer::memory::{Memory, Remembers, remembers};
use crate::guidance::powered::ControlLevel;
use crate::vehicle::dynamics::PlanarState;
use nmpc::free_time::FreeTimeSolution;
use nmpc::{Solution, SolveStatus};

// The settings come from the mission. A search does not depend on the workspace. The trial solutions are cleared before
// each solve and only keep their capacity, and so does what becomes the flown plan. (If a problem cannot be posed, the trial
// keeps an older final time, which is reported but decides nothing.)
remembers!(PoweredGuidance { plane, flown, report, space } but { settings, workspace, trial, set_aside, unused });

remembers!(Plane { along, across });
remembers!(Flown { begins_s, turning_rad_s2, plan });
remembers!(FreeTimeSolution { solution, final_time_s, earliest_s, price_slope, solves });
remembers!(Solution {
    status,
    iterations,
    qp_iterations,
    cost,
    price,
    step_s,
    kkt_stationarity,
    kkt_feasibility,
    condition_miss,
    best_touchdown_speed_m_s,
    states,
    costates,
    limit_multipliers,
    inputs_rad,
    end_multipliers,
    floor_multipliers,
});
remembers!(PlanarState { x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s });
remembers!(PoweredReport {
    level,
    status,
    iterations,
    kkt_stationarity,
    kkt_feasibility,
    cost,
    condition_miss,
    touchdown_in_s,
    touchdown,
    largest_tilt_rad,
});

impl Remembers for ControlLevel {
    fn remember(&self, memory: &mut Memory) {
        self.index().remember(memory);
    }
}

impl Remembers for SolveStatus {
    fn remember(&self, memory: &mut Memory) {
        self.index().remember(memory);
    }
}
