//! The paper's numbers and equations exactly as printed: what they predict, and what really happens.

use flight::guidance::landing::landing_problem;
use flight::vehicle::dynamics::{PlanarModel, PlanarState};
use flight::vehicle::profile::{ModelKind, Profile};
use nmpc::{Solution, SolveStatus};

use super::{PaperError, builtin};
use sim::plane::draw::draw;
use sim::plane::plant::{Plant, STEP_S};

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
///
/// # Errors
/// A built-in profile is missing: a defect of the build.
pub fn as_printed() -> Result<AsPrinted, PaperError> {
    let profile = builtin("paper-as-printed")?;
    let intervals = profile.nmpc.horizon_steps;
    let initial = profile.start.planar_state();
    let true_problem = landing_problem(&profile, initial, 0.0, intervals, 1.0);
    let promise = promise(&profile);
    let promised = promise.states.last().copied().unwrap_or(initial);
    let printed_model = PlanarModel { kind: ModelKind::AsPrinted, ..profile.planar_model() };
    Ok(AsPrinted {
        thrust_n: profile.motor.thrust_n,
        best_touchdown_speed_m_s: nmpc::best_touchdown_speed_m_s(&true_problem),
        limit_m_s: profile.touchdown_limits.u_m_s,
        energy_error_j_kg: [ModelKind::AsPrinted, ModelKind::Consistent]
            .map(|kind| coasting_energy_error(&profile, kind)),
        promised,
        promised_vertical_m_s: printed_model.derivative(&promised.to_array(), 0.0, 0.0)[1],
        promised_lowest_m: promise.states.iter().map(|state| state.z_m).fold(f64::INFINITY, f64::min),
        promise_converged: promise.status == SolveStatus::Converged,
        happens: fly_plan(&profile, &promise.inputs_rad),
    })
}

/// The plan of a solver that uses the printed equations.
fn promise(profile: &Profile) -> Solution {
    let mut believed = profile.clone();
    believed.nmpc.model = ModelKind::AsPrinted;
    believed.nmpc.limits.final_box = None;
    believed.nmpc.solver.max_iterations = MAX_ITERATIONS;
    let initial = believed.start.planar_state();
    let mut problem = landing_problem(&believed, initial, 0.0, believed.nmpc.horizon_steps, 1.0);
    // The bound that proves "not landable" follows from physics, which the printed equations violate.
    problem.touchdown_speed_max_m_s = f64::INFINITY;
    nmpc::solve(&problem, None)
}

/// Change of specific energy over 1 s without thrust and drag, from 30 degrees of tilt.
fn coasting_energy_error(profile: &Profile, kind: ModelKind) -> f64 {
    let mut model = PlanarModel { kind, ..profile.planar_model() };
    model.params.drag_per_m = 0.0;
    let tilted = PlanarState { theta_rad: 60f64.to_radians(), ..profile.start.planar_state() };
    let mut state = tilted;
    for _ in 0..1000 {
        state = model.rk4_step(&state, 0.0, 0.0, 0.001);
    }
    model.specific_energy_j_kg(&state) - model.specific_energy_j_kg(&tilted)
}

/// The true vehicle under the plan's inputs.
fn fly_plan(profile: &Profile, inputs_rad: &[f64]) -> Option<PlanarState> {
    let mut plant = Plant::new(profile, &draw(profile, 0));
    plant.release(profile.start.planar_state());
    plant.ignite();
    let steps_per_sample = (profile.nmpc.sample_time_s / STEP_S).round() as usize;
    for input_rad in inputs_rad.iter().chain(std::iter::repeat_n(&0.0, 50)) {
        plant.command(*input_rad, [profile.fins.deployed_rad(); 4]);
        for _ in 0..steps_per_sample {
            if let Some(impact) = plant.step() {
                return Some(impact.state);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 30 N on 3 kg from 15 m at -5 m/s: at best -4.3 m/s at the ground, by hand integration.
    #[test]
    fn val_hand_integration_the_printed_thrust_cannot_land() {
        let printed = as_printed().unwrap();
        assert!((printed.best_touchdown_speed_m_s - 4.3).abs() < 0.05, "{printed:?}");
        assert!(printed.best_touchdown_speed_m_s > printed.limit_m_s);
    }

    #[test]
    fn the_printed_equations_create_energy_and_the_corrected_ones_do_not() {
        let [printed, mended] = as_printed().unwrap().energy_error_j_kg;
        assert!(printed.abs() > 1.0, "{printed}");
        assert!(mended.abs() < 1e-9, "{mended}");
    }

    /// By the printed equations the motor brings the vehicle back up to the ground from below; in truth it cannot even
    /// stop it.
    #[test]
    fn the_landing_predicted_by_the_printed_equations_does_not_happen() {
        let printed = as_printed().unwrap();
        assert!(printed.promise_converged && printed.promised.z_m.abs() < 1e-6, "{printed:?}");
        assert!(printed.promised_vertical_m_s > 0.0, "{printed:?}");
        let happens = printed.happens.unwrap();
        assert!(happens.ground_velocity_m_s().1 <= -printed.best_touchdown_speed_m_s + 0.01, "{happens:?}");
    }
}
