//! The landing paper's vehicle and problem, for tests: the numbers of the built-in profile `paper-calibrated`.

use alloc::vec;
use core::f64::consts::FRAC_PI_2;

use crate::dynamics::{ModelKind, PlanarModel, PlanarParams, PlanarState};
use crate::{FinalBox, Problem, SolverLimits};

/// 3 kg in still air at sea level.
pub(crate) fn model() -> PlanarModel {
    PlanarModel {
        params: PlanarParams {
            mass_kg: 3.0,
            pitch_inertia_kg_m2: 0.12,
            thrust_arm_m: 0.17 + 0.35,
            drag_per_m: 1.225 * 0.0043 / (2.0 * 3.0),
            lateral_drag_per_m: 0.0,
            crossflow_per_m: 0.0,
            gravity_m_s2: 9.81,
        },
        kind: ModelKind::Consistent,
    }
}

/// Upright at 15 m, sinking at 5 m/s.
pub(crate) fn start() -> PlanarState {
    PlanarState { z_m: 15.0, theta_rad: FRAC_PI_2, u_m_s: -5.0, ..PlanarState::default() }
}

/// The landing from a state, under 33.3 N throughout.
pub(crate) fn problem(initial: PlanarState, intervals: usize) -> Problem {
    Problem {
        model: model(),
        initial,
        step_s: 0.1,
        thrust_n: vec![33.3; intervals],
        mass_kg: vec![],
        target: PlanarState { theta_rad: FRAC_PI_2, ..PlanarState::default() },
        state_weights: [0.5, 60.0, 150.0, 50.0, 70.0, 90.0],
        input_weight: 1.0,
        gimbal_limit_rad: 20.0_f64.to_radians(),
        x_final_m: 20.0,
        final_box: Some(FinalBox {
            settled_nodes: 3,
            pitch_error_deg: 1.0,
            u_min_m_s: -0.3,
            u_max_m_s: -0.05,
            w_m_s: 0.03,
            pitch_rate_deg_s: 0.5,
        }),
        altitude_min_m: None,
        floor_rise_m_s: 0.0,
        touchdown_speed_max_m_s: 0.4,
        solver: SolverLimits {
            max_iterations: 60,
            max_iterations_after_miss: 10,
            kkt_tolerance: 1e-6,
            terminal_penalty: 1000.0,
            qp_max_iterations: 60,
            guess_amplitude_rad: 0.3,
            guess_half_waves: 2,
        },
    }
}
