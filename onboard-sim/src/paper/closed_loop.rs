//! The paper's closed loop: the controller at 10 Hz against the same equations integrated a hundred times finer.

use flight::guidance::controller::{ControllerConfig, ControllerInput, ControllerState, step};
use flight::rules::phase::Phase;
use flight::rules::verdict::TouchdownLimits;
use flight::vehicle::profile::Profile;

use super::{Finish, Sample};
use sim::plane::plant::STEP_S;

/// Flies from ignition to the end of the burn. As in the paper there is no ground in between: its final state is
/// the state at the end of its 5 s, and its optimum dips some millimetres below the ground just before.
pub(super) fn fly(profile: &Profile, limits: &TouchdownLimits) -> Finish {
    let config = ControllerConfig::from_profile(profile);
    let mut controller = ControllerState::new(&config);
    let model = profile.planar_model();
    let sample_s = profile.nmpc.sample_time_s;
    let steps_per_sample = (sample_s / STEP_S).round() as u32;
    let mut state = profile.start.planar_state();
    let mut gimbal_rad = 0.0;
    let (mut first_cost, mut converged) = (None, true);
    let mut path = vec![Sample { time_s: 0.0, state, gimbal_rad }];
    for tick in 0..profile.nmpc.horizon_steps as u32 {
        let time_s = f64::from(tick) * sample_s;
        let input = ControllerInput {
            tick: u64::from(tick),
            time_s,
            phase: Phase::Powered,
            time_since_ignition_s: time_s,
            state,
            gimbal_applied_rad: gimbal_rad,
            thrust_scale: 1.0,
            degraded: false,
            lands_here: false,
            deadline_missed: false,
        };
        let output = step(&mut controller, &input);
        first_cost.get_or_insert(output.solver.cost);
        // At the last tick there is nothing left to plan.
        converged &= output.solver.converged() || tick + 1 == profile.nmpc.horizon_steps as u32;
        for plant_step in 0..steps_per_sample {
            let plant_s = time_s + f64::from(plant_step) * STEP_S;
            let thrust_n = profile.motor.mean_thrust_n(plant_s, STEP_S);
            state = model.rk4_step(&state, gimbal_rad, thrust_n, STEP_S);
        }
        path.push(Sample { time_s: time_s + sample_s, state, gimbal_rad });
        gimbal_rad = output.gimbal_command_rad;
    }
    Finish::judged(limits, path, first_cost.unwrap_or(0.0), converged)
}
