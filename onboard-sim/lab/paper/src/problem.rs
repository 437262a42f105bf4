//! The landing paper's vehicle and problem: Tables 1 and 2, sections 3.2 and 3.3 of *Definition of
//! a Landing Strategy for a Model-Scale Reusable Rocket* (EuroGNC). For the study of the paper, for
//! tests, and for comparisons with other solvers.

use core::f64::consts::FRAC_PI_2;

use crate::plane::dynamics::{ModelKind, PlanarModel, PlanarState};
use crate::plane::{FinalBox, Problem, SolverLimits};

/// Thrust with which the paper's Table 3 is possible, N: it needs about 11.1 m/s^2, and nothing
/// lands with the printed 10.0 m/s^2.
pub const THRUST_N: f64 = 33.3;

/// The printed thrust, N.
pub const PRINTED_THRUST_N: f64 = 30.0;

/// Time between two commands, s.
pub const SAMPLE_S: f64 = 0.1;

/// Samples from ignition to the end of the burn.
pub const HORIZON: usize = 50;

/// Fastest touchdown that counts as a landing (Table 2), m/s.
pub const TOUCHDOWN_SPEED_MAX_M_S: f64 = 0.4;

/// 3 kg in still air at sea level.
pub fn model() -> PlanarModel {
    PlanarModel {
        kind: ModelKind::Consistent,
        mass_kg: 3.0,
        pitch_inertia_kg_m2: 0.12,
        // Both stations are measured from mid-length, nose positive: the only reading that fits "25
        // % of the length".
        thrust_arm_m: 0.17 + 0.35,
        drag_per_m: 1.225 * 0.0043 / (2.0 * 3.0),
        gravity_m_s2: 9.81,
    }
}

/// Upright at 15 m, sinking at 5 m/s.
pub fn start() -> PlanarState {
    PlanarState { z_m: 15.0, theta_rad: FRAC_PI_2, u_m_s: -5.0, ..PlanarState::default() }
}

/// The paper's own problem from a state, under [`THRUST_N`] throughout: only height and distance
/// are limited at the end.
pub fn problem(initial: PlanarState, intervals: usize) -> Problem {
    Problem {
        model: model(),
        initial,
        intervals,
        step_s: SAMPLE_S,
        thrust_n: THRUST_N,
        state_weights: [0.5, 60.0, 150.0, 50.0, 70.0, 90.0],
        input_weight: 1.0,
        gimbal_limit_rad: 20.0_f64.to_radians(),
        x_final_m: 20.0,
        final_box: None,
        solver: SolverLimits { max_iterations: 60, kkt_tolerance: 1e-6, terminal_penalty: 1000.0 },
    }
}

/// [`problem`] with an end that a vehicle can fly.
///
/// Left to the cost, the optimum dips some millimetres underground 0.2 s before the burn ends and
/// comes back up at 0.15 m/s. A real vehicle would touch there with thrust above weight and lift
/// off again. So the plan must end upright and still sinking: with thrust above weight until
/// burn-out, a path that sinks at the last instant has come down through every instant before it,
/// and contact and burn-out coincide. It must also arrive settled: full gimbal turns the vehicle by
/// 50 rad/s^2, so one millisecond of timing would otherwise cost 3 deg/s. The box is narrower than
/// Table 2, which leaves room for what is not modelled.
pub fn settled(initial: PlanarState, intervals: usize) -> Problem {
    let final_box = FinalBox {
        settled_nodes: 3,
        pitch_error_deg: 1.0,
        u_min_m_s: -0.3,
        u_max_m_s: -0.05,
        w_m_s: 0.03,
        pitch_rate_deg_s: 0.5,
    };
    Problem { final_box: Some(final_box), ..problem(initial, intervals) }
}
