//! Poses the landing problem of a profile for the solver.

use alloc::vec::Vec;
use core::f64::consts::FRAC_PI_2;

use nmpc::Problem;

use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::profile::Profile;

/// The problem of a profile from `initial`, `starts_s` after ignition, over `intervals` samples, with the motor at
/// `thrust_scale` of nominal.
pub fn landing_problem(
    profile: &Profile,
    initial: PlanarState,
    starts_s: f64,
    intervals: usize,
    thrust_scale: f64,
) -> Problem {
    let nmpc = &profile.nmpc;
    let mut problem = Problem {
        model: profile.planar_model(),
        initial,
        step_s: nmpc.sample_time_s,
        thrust_n: Vec::new(),
        mass_kg: Vec::new(),
        target: PlanarState { theta_rad: FRAC_PI_2, ..PlanarState::default() },
        state_weights: nmpc.weights.state_diagonal(),
        input_weight: nmpc.weights.delta,
        gimbal_limit_rad: nmpc.limits.gimbal_rad(),
        x_final_m: nmpc.limits.x_final_m,
        final_box: nmpc.limits.final_box,
        altitude_min_m: nmpc.limits.altitude_min_m,
        floor_rise_m_s: 0.0,
        touchdown_speed_max_m_s: profile.touchdown_limits.u_m_s,
        solver: nmpc.solver,
    };
    pose_again(&mut problem, profile, initial, starts_s, intervals, thrust_scale);
    problem
}

/// [`landing_problem`] in place, for a problem of the same profile. It allocates only if the problem never had this
/// many intervals.
pub fn pose_again(
    problem: &mut Problem,
    profile: &Profile,
    initial: PlanarState,
    starts_s: f64,
    intervals: usize,
    thrust_scale: f64,
) {
    let step_s = problem.step_s;
    problem.initial = initial;
    problem.solver = profile.nmpc.solver;
    problem.thrust_n.clear();
    problem.thrust_n.extend(
        (0..intervals)
            .map(|k| thrust_scale * profile.motor.mean_thrust_n(starts_s + k as f64 * step_s, step_s)),
    );
}
