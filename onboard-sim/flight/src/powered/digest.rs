//! What the guidance remembers, for a pilot's digest.

use super::{Flown, Plane, PoweredGuidance, PoweredReport};
use crate::controller::ControlLevel;
use crate::dynamics::PlanarState;
use crate::memory::{Memory, Remembers, remembers};
use crate::nmpc::free_time::FreeTimeSolution;
use crate::nmpc::{Solution, SolveStatus};

// The settings are the mission's. The workspace holds nothing that a search depends on, and the trial and what was set
// aside for another are cleared before they are solved into: they only keep their room. (Of a problem that cannot be
// posed the trial keeps an older final time, which is reported and decides nothing.)
remembers!(PoweredGuidance { plane, flown, report } but { settings, workspace, trial, set_aside });

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
