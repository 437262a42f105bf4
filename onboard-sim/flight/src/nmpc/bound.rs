//! A bound on what any controller can do: can this be landed at all?

use super::Problem;
use crate::dynamics::PlanarState;

/// Sub-steps of an interval when looking for the instant of contact.
const SUB_STEPS: usize = 20;

/// The slowest vertical touchdown any gimbal programme can reach from the problem's start, m/s; 0 if it can stop
/// sinking before it reaches the ground.
///
/// The vertical acceleration is largest upright with the nozzle straight, all the thrust working against the weight.
/// So the path that is upright from now on sinks slowest at every instant and reaches the ground last, and no other
/// touches down slower than it ever sinks. Left out is the drag of sideways flight, below one thousandth of gravity
/// at these speeds; turning upright costs time that the bound does not count.
pub fn best_touchdown_speed_m_s(problem: &Problem) -> f64 {
    let (_, vertical_m_s) = problem.initial.ground_velocity_m_s();
    let mut state = PlanarState {
        x_m: 0.0,
        z_m: problem.initial.z_m,
        theta_rad: core::f64::consts::FRAC_PI_2,
        u_m_s: vertical_m_s,
        w_m_s: 0.0,
        q_rad_s: 0.0,
    };
    let mut slowest_m_s = -state.u_m_s;
    let sub_step_s = problem.step_s / SUB_STEPS as f64;
    for thrust_n in &problem.thrust_n {
        for _ in 0..SUB_STEPS {
            slowest_m_s = slowest_m_s.min(-state.u_m_s);
            if state.z_m <= 0.0 || slowest_m_s <= 0.0 {
                return slowest_m_s.max(0.0);
            }
            state = problem.model.rk4_step(&state, 0.0, *thrust_n, sub_step_s);
        }
    }
    slowest_m_s.min(-state.u_m_s).max(0.0)
}
