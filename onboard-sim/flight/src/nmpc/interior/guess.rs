//! Where a cold solve starts from.

use core::f64::consts::{FRAC_PI_2, PI};

use crate::nmpc::Problem;

/// States on the straight line from the start to the target, the pitch bent by `amplitude sin(m pi k / N)`: tilting
/// one way and then the other, the shape that throws surplus thrust away and ends upright. It need not be flyable.
pub(super) fn straight(problem: &Problem, amplitude_rad: f64, states: &mut [[f64; 6]]) {
    let count = problem.intervals();
    let half_waves = f64::from(problem.solver.guess_half_waves);
    let start = problem.initial.to_array();
    let target = [0.0, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0];
    for (k, state) in states.iter_mut().enumerate() {
        let share = k as f64 / count as f64;
        *state = core::array::from_fn(|i| start[i] + share * (target[i] - start[i]));
        if k > 0 {
            state[2] += amplitude_rad * libm::sin(half_waves * PI * share);
        }
    }
}
