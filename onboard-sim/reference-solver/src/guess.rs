//! Bent initial guesses.

use core::f64::consts::PI;

use flight::guidance::stabiliser::Stabiliser;
use nmpc::Problem;

/// Inputs whose path follows the pitch `pi/2 + amplitude sin(m pi t / T)`: the vehicle tilts one way and then the
/// other, which wastes surplus thrust and ends upright.
///
/// The upright law flies this pitch history as a moving reference, so the guess is a flyable path from any start.
pub(super) fn bent(problem: &Problem, amplitude_rad: f64) -> Vec<f64> {
    let law = Stabiliser::from_rate(&problem.model.params, problem.step_s, GUESS_DECAY_RATE_PER_S);
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
        let gimbal_rad = law.gimbal_towards(&state, theta_rad, q_rad_s, *thrust_n, problem.gimbal_limit_rad);
        state = problem.model_at(k).rk4_step(&state, gimbal_rad, *thrust_n, problem.step_s);
        inputs_rad.push(gimbal_rad);
    }
    inputs_rad
}

/// Fast enough to follow the reference within a few samples, slow enough to stay off the gimbal limit.
const GUESS_DECAY_RATE_PER_S: f64 = 4.0;
