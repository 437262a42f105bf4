//! Bent initial guesses.

use core::f64::consts::PI;

use nmpc::Problem;

/// Inputs whose path follows the pitch `pi/2 + amplitude sin(m pi t / T)`: the vehicle tilts one way and then the
/// other, which wastes surplus thrust and ends upright.
///
/// A law with two equal real poles flies this pitch history as a moving reference, so the guess is a flyable path from any
/// start: under thrust the pitch is a double integrator of the gimbal angle.
pub(super) fn bent(problem: &Problem, amplitude_rad: f64) -> Vec<f64> {
    let params = &problem.model.params;
    let pole = libm::exp(-GUESS_DECAY_RATE_PER_S * problem.step_s);
    let pitch_gain_per_s2 = (1.0 - pole) * (1.0 - pole) / (problem.step_s * problem.step_s);
    let rate_gain_per_s = (1.0 - pole) * (3.0 + pole) / (2.0 * problem.step_s);
    let arm_per_inertia = params.thrust_arm_m / params.pitch_inertia_kg_m2;
    let sine_limit = libm::sin(problem.gimbal_limit_rad);
    let count = problem.intervals();
    let half_waves = f64::from(problem.solver.guess_half_waves);
    let reference = |k: usize| {
        let phase = half_waves * PI * k as f64 / count as f64;
        let rate = half_waves * PI / (count as f64 * problem.step_s);
        (problem.target.theta_rad + amplitude_rad * libm::sin(phase), amplitude_rad * rate * libm::cos(phase))
    };
    let mut state = problem.initial;
    let mut inputs_rad = Vec::with_capacity(count);
    for (k, thrust_n) in problem.thrust_n.iter().enumerate() {
        let (theta_rad, q_rad_s) = reference(k);
        let wanted_rad_s2 =
            -pitch_gain_per_s2 * (state.theta_rad - theta_rad) - rate_gain_per_s * (state.q_rad_s - q_rad_s);
        // q' = -T sin(delta) arm / I; the sine's limit is the gimbal's.
        let sine = -wanted_rad_s2 / (thrust_n * arm_per_inertia);
        let gimbal_rad = if sine.is_finite() { libm::asin(sine.clamp(-sine_limit, sine_limit)) } else { 0.0 };
        state = problem.model_at(k).rk4_step(&state, gimbal_rad, *thrust_n, problem.step_s);
        inputs_rad.push(gimbal_rad);
    }
    inputs_rad
}

/// Fast enough to follow the reference within a few samples, slow enough to stay off the gimbal limit.
const GUESS_DECAY_RATE_PER_S: f64 = 4.0;
