//! A tick of the controller does not allocate, once it has rehearsed.
#![expect(clippy::expect_used, reason = "a missing built-in profile is a failed test")]

use flight::controller::{ControlLevel, ControllerConfig, ControllerInput, ControllerState, step};
use flight::dynamics::{PlanarModel, PlanarState};
use flight::phase::Phase;
use flight::profile::Profile;

/// A kicked landing with two blind ticks and an abort at its end: every way a tick can go.
#[test]
fn powered_ticks_do_not_allocate() {
    let profile = Profile::builtin("paper-calibrated").expect("built in");
    let model = PlanarModel::from_profile(&profile);
    let mut controller = ControllerState::new(&ControllerConfig::from_profile(&profile));
    let mut input = ControllerInput {
        tick: 0,
        time_s: 0.0,
        phase: Phase::PadIdle,
        time_since_ignition_s: 0.0,
        state: profile.start.planar_state(),
        gimbal_applied_rad: 0.0,
        thrust_scale: 1.0,
        degraded: false,
        deadline_missed: false,
    };
    for _ in 0..2 {
        assert!(step(&mut controller, &input).solver.converged());
    }
    input.phase = Phase::Powered;
    let mut levels = Vec::new();
    for tick in 0_u32..49 {
        input.tick = u64::from(tick);
        input.time_since_ignition_s = 0.1 * f64::from(tick);
        input.degraded = tick >= 47;
        let mut told = input;
        if matches!(tick, 30 | 31) {
            told.state.u_m_s = f64::NAN;
        }
        let mut output = None;
        let allocated = allocation_counter::measure(|| output = Some(step(&mut controller, &told)));
        assert_eq!(allocated.count_total, 0, "tick {tick}");
        let output = output.expect("measured");
        levels.push(output.level);
        input.state = model.rk4_step(&input.state, input.gimbal_applied_rad, 33.3, 0.1);
        if tick % 7 == 3 {
            let kicked = input.state;
            input.state =
                PlanarState { w_m_s: kicked.w_m_s + 0.02, q_rad_s: kicked.q_rad_s - 0.01, ..kicked };
        }
        input.gimbal_applied_rad = output.gimbal_command_rad;
    }
    for level in [ControlLevel::Converged, ControlLevel::ShiftedPlan, ControlLevel::Stabiliser] {
        assert!(levels.contains(&level), "{level:?}");
    }
}
