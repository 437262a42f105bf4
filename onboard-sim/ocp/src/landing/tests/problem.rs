//! A landing, for the tests of the solver and of its judge.

use super::{Drag, End, Problem, Push, SolverLimits, Weights};

pub(super) const GRAVITY_M_S2: f64 = 9.806_65;

/// A stage of 1.2 kg that falls at 12.5 m/s in a light wind. Its thrust falls to its weight in 3.8
/// s.
pub(super) fn problem(thrust_over_weight: f64) -> Problem {
    const INTERVALS: usize = 38;
    let pushes = (0..INTERVALS).map(|k| {
        let share = k as f64 / INTERVALS as f64;
        let thrust_m_s2 = GRAVITY_M_S2 * (thrust_over_weight - (thrust_over_weight - 1.0) * share * share);
        Push { thrust_m_s2, turning_rad_s2: 6.0 * thrust_m_s2, per_kg: 1.0 / 1.2 }
    });
    Problem {
        initial: [0.3, 0.0, 17.6, -0.4, -0.5, -12.5, -0.05, 0.03, 0.0, 0.0],
        step_s: 0.1,
        pushes: pushes.collect(),
        drag: Drag { fins: 0.05, axial: 0.003, crossflow: 0.04 },
        wind_m_s: [2.0, 0.5],
        gravity_m_s2: GRAVITY_M_S2,
        target_m: [0.0, 0.0],
        weights: Weights {
            place: 1.0,
            height: 0.0,
            velocity: [0.0; 2],
            lean: 1000.0,
            rate: 0.0,
            gimbal: 20_000.0,
            fins: 20.0,
        },
        gimbal_limit_rad: 4.5_f64.to_radians(),
        lean_max_rad: 50.0_f64.to_radians(),
        end: End {
            vertical_m_s: [-0.3, -0.05],
            lateral_m_s: 0.06,
            lean_rad: 1.0_f64.to_radians(),
            rate_rad_s: 1.0_f64.to_radians(),
            settled_nodes: 3,
        },
        floor_rise_m_s: 0.4,
        guess_lean_rad: 0.5,
        guess_towards_rad: 0.6,
        solver: SolverLimits { max_iterations: 200, kkt_tolerance: 1e-6, terminal_penalty: 1000.0 },
    }
}
