//! The paper's numbers and equations exactly as printed: what they predict, and what really happens.

use nmpc::dynamics::{ModelKind, PlanarModel, PlanarState};
use nmpc::paper::{HORIZON, PRINTED_THRUST_N, model, problem, start};
use nmpc::{Problem, SolveStatus};

use super::flown::contact;

/// Iterations that the printed equations need; they are harder for the solver than the corrected ones.
const MAX_ITERATIONS: usize = 1000;

/// Results of the printed numbers and equations.
#[derive(Debug, Clone, PartialEq)]
pub struct AsPrinted {
    /// Printed thrust, N.
    pub thrust_n: f64,
    /// The slowest touchdown that is possible with it, m/s: upright under full thrust all the way.
    pub best_touchdown_speed_m_s: f64,
    /// The slowest touchdown that counts as a landing, m/s.
    pub limit_m_s: f64,
    /// Energy gained or lost in one second of coasting from a tilted attitude without thrust or drag, J/kg: by the
    /// printed equations, and by the corrected ones.
    pub energy_error_j_kg: [f64; 2],
    /// The landing that a solver with the printed equations and the printed thrust predicts.
    pub promised: PlanarState,
    /// Its vertical velocity there by the printed equations, whose frames are their own, m/s.
    pub promised_vertical_m_s: f64,
    /// The lowest altitude on the way there, m.
    pub promised_lowest_m: f64,
    /// Whether that solve converged.
    pub promise_converged: bool,
    /// The contact that the true vehicle makes when it flies that plan; `None` if it does not come down in time.
    pub happens: Option<PlanarState>,
}

/// Solves and flies the landing with the equations as printed.
pub fn as_printed() -> AsPrinted {
    let of_kind = |kind| PlanarModel { kind, ..model() };
    let in_truth = Problem { thrust_n: vec![PRINTED_THRUST_N; HORIZON], ..problem(start(), HORIZON) };
    let mut believed = Problem { model: of_kind(ModelKind::AsPrinted), ..in_truth.clone() };
    believed.solver.max_iterations = MAX_ITERATIONS;
    // The bound that proves "not landable" follows from physics, which the printed equations violate.
    believed.touchdown_speed_max_m_s = f64::INFINITY;
    let promise = nmpc::solve(&believed, None);
    let promised = promise.states.last().copied().unwrap_or(in_truth.initial);
    AsPrinted {
        thrust_n: PRINTED_THRUST_N,
        best_touchdown_speed_m_s: nmpc::best_touchdown_speed_m_s(&in_truth),
        limit_m_s: in_truth.touchdown_speed_max_m_s,
        energy_error_j_kg: [ModelKind::AsPrinted, ModelKind::Consistent]
            .map(of_kind)
            .map(coasting_energy_error),
        promised,
        promised_vertical_m_s: believed.model.derivative(&promised.to_array(), 0.0, 0.0)[1],
        promised_lowest_m: promise.states.iter().map(|state| state.z_m).fold(f64::INFINITY, f64::min),
        promise_converged: promise.status == SolveStatus::Converged,
        happens: contact(model(), start(), PRINTED_THRUST_N, &promise.inputs_rad).map(|(_, state)| state),
    }
}

/// Change of specific energy over 1 s without thrust and drag, from 30 degrees of tilt.
fn coasting_energy_error(mut model: PlanarModel) -> f64 {
    model.params.drag_per_m = 0.0;
    let tilted = PlanarState { theta_rad: 60f64.to_radians(), ..start() };
    let mut state = tilted;
    for _ in 0..1000 {
        state = model.rk4_step(&state, 0.0, 0.0, 0.001);
    }
    model.specific_energy_j_kg(&state) - model.specific_energy_j_kg(&tilted)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 30 N on 3 kg from 15 m at -5 m/s: at best -4.3 m/s at the ground, by hand integration.
    #[test]
    fn val_hand_integration_the_printed_thrust_cannot_land() {
        let printed = as_printed();
        assert!((printed.best_touchdown_speed_m_s - 4.3).abs() < 0.05, "{printed:?}");
        assert!(printed.best_touchdown_speed_m_s > printed.limit_m_s);
    }

    #[test]
    fn the_printed_equations_create_energy_and_the_corrected_ones_do_not() {
        let [printed, mended] = as_printed().energy_error_j_kg;
        assert!(printed.abs() > 1.0, "{printed}");
        assert!(mended.abs() < 1e-9, "{mended}");
    }

    /// By the printed equations the motor brings the vehicle back up to the ground from below; in truth it cannot even
    /// stop it.
    #[test]
    fn the_landing_predicted_by_the_printed_equations_does_not_happen() {
        let printed = as_printed();
        assert!(printed.promise_converged && printed.promised.z_m.abs() < 1e-6, "{printed:?}");
        assert!(printed.promised_vertical_m_s > 0.0, "{printed:?}");
        let happens = printed.happens.unwrap();
        assert!(happens.ground_velocity_m_s().1 <= -printed.best_touchdown_speed_m_s + 0.01, "{happens:?}");
    }
}
