//! A lower bound of the touchdown speed with any controller.

use super::Problem;
use crate::dynamics::PlanarParams;

/// Sub-steps of the interval that contains the instant of contact.
const SUB_STEPS: usize = 20;

/// The slowest vertical touchdown that any gimbal commands can reach from the problem's start, m/s; 0 if the vehicle
/// can stop sinking before it reaches the ground.
///
/// The vertical acceleration is largest upright with the nozzle centred, when all the thrust acts against the weight.
/// So a path that is upright from now on sinks slowest at every instant and reaches the ground last, and no other path
/// touches down slower. The bound neglects the drag of sideways flight, which is below one thousandth of gravity at the
/// landing paper's speeds, and the time to turn upright.
pub fn best_touchdown_speed_m_s(problem: &Problem) -> f64 {
    let (_, vertical_m_s) = problem.initial.ground_velocity_m_s();
    let mut state = Upright { z_m: problem.initial.z_m, sink_m_s: -vertical_m_s };
    let mut slowest_m_s = state.sink_m_s;
    let sub_step_s = problem.step_s / SUB_STEPS as f64;
    for (k, thrust_n) in problem.thrust_n.iter().enumerate() {
        let params = problem.model_at(k).params;
        if state.z_m <= 0.0 || slowest_m_s <= 0.0 {
            return slowest_m_s.max(0.0);
        }
        let after = state.after(&params, *thrust_n, problem.step_s);
        if after.z_m > 0.0 {
            state = after;
        } else {
            for _ in 0..SUB_STEPS {
                slowest_m_s = slowest_m_s.min(state.sink_m_s);
                if state.z_m <= 0.0 || slowest_m_s <= 0.0 {
                    return slowest_m_s.max(0.0);
                }
                state = state.after(&params, *thrust_n, sub_step_s);
            }
        }
        slowest_m_s = slowest_m_s.min(state.sink_m_s);
    }
    slowest_m_s.max(0.0)
}

/// Height and rate of descent of an upright vehicle.
#[derive(Clone, Copy)]
struct Upright {
    z_m: f64,
    sink_m_s: f64,
}

impl Upright {
    /// One step of the classical fourth-order Runge-Kutta method; the planar equations at `theta = pi/2`.
    fn after(self, params: &PlanarParams, thrust_n: f64, step_s: f64) -> Self {
        let gained = params.gravity_m_s2 - thrust_n / params.mass_kg;
        let rate = |sink_m_s: f64| gained - params.drag_per_m * sink_m_s * sink_m_s.abs();
        let s1 = self.sink_m_s;
        let a1 = rate(s1);
        let s2 = s1 + 0.5 * step_s * a1;
        let a2 = rate(s2);
        let s3 = s1 + 0.5 * step_s * a2;
        let a3 = rate(s3);
        let s4 = s1 + step_s * a3;
        let a4 = rate(s4);
        Self {
            z_m: self.z_m - step_s / 6.0 * (s1 + 2.0 * (s2 + s3) + s4),
            sink_m_s: s1 + step_s / 6.0 * (a1 + 2.0 * (a2 + a3) + a4),
        }
    }
}
