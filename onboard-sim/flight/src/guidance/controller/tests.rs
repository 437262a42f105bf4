use proptest::prelude::*;

use super::*;

fn profile() -> Profile {
    crate::vehicles::profile::builtin("paper-calibrated").unwrap()
}

fn controller() -> ControllerState {
    ControllerState::new(&ControllerConfig::from_profile(&profile()))
}

fn input(phase: Phase, time_since_ignition_s: f64) -> ControllerInput {
    ControllerInput {
        tick: 7,
        time_s: 100.0,
        phase,
        time_since_ignition_s,
        state: profile().start.planar_state(),
        gimbal_applied_rad: 0.0,
        thrust_scale: 1.0,
        degraded: false,
        lands_here: false,
        deadline_missed: false,
    }
}

/// A controller that has rehearsed and flown its first tick.
fn flying() -> ControllerState {
    let mut state = controller();
    assert!(step(&mut state, &input(Phase::PadIdle, 0.0)).solver.converged());
    assert_eq!(step(&mut state, &input(Phase::Powered, 0.0)).level, ControlLevel::Converged);
    state
}

#[test]
fn on_the_pad_the_controller_rehearses_once_and_then_only_checks() {
    let mut state = controller();
    let first = step(&mut state, &input(Phase::PadIdle, 0.0));
    assert_eq!(first.level, ControlLevel::Rehearsal);
    assert!(first.solver.converged() && first.solver.iterations > 0);
    assert_eq!(first.gimbal_command_rad.to_bits(), 0);
    assert_eq!(first.fin_command_rad.map(f64::to_bits), [0; 4]);
    assert_eq!(first.plan.len, 49);
    assert!((first.predicted_touchdown.time_from_now_s - 5.0).abs() < 1e-9);

    let second = step(&mut state, &input(Phase::PadArmed, 0.0));
    assert!(second.solver.converged());
    assert_eq!(second.solver.iterations, 0);
    assert_eq!(second.plan, first.plan);
}

#[test]
fn the_first_powered_tick_flies_the_rehearsed_plan() {
    let mut state = controller();
    let rehearsed = step(&mut state, &input(Phase::PadArmed, 0.0));
    let flown = step(&mut state, &input(Phase::Ignition, 0.0));
    assert_eq!((flown.level, flown.solver.iterations), (ControlLevel::Converged, 0));
    assert_eq!(flown.plan, rehearsed.plan);
    assert_eq!(flown.gimbal_command_rad.to_bits(), rehearsed.plan.gimbal_rad[0].to_bits());
    assert_eq!(flown.fin_command_rad.map(f64::to_bits), [profile().fins.deployed_rad().to_bits(); 4]);
}

#[test]
fn the_profile_as_printed_is_not_landable_and_the_bound_is_reported() {
    let printed = crate::vehicles::profile::builtin("paper-as-printed").unwrap();
    let mut state = ControllerState::new(&ControllerConfig::from_profile(&printed));
    let output = step(&mut state, &input(Phase::PadIdle, 0.0));
    assert_eq!(output.solver.status, SolveStatus::NotLandable);
    assert!(!output.solver.converged());
    assert_eq!(output.solver.summary(), "not landable: best touchdown speed 4.3 m/s");
    let falling = step(&mut state, &input(Phase::Powered, 0.0));
    assert_eq!(falling.level, ControlLevel::Stabiliser);
}

#[test]
fn an_abort_with_the_motor_lit_plans_a_landing_on_the_ground_below() {
    let away = PlanarState { x_m: 60.0, ..profile().start.planar_state() };
    let far = ControllerInput { state: away, ..input(Phase::Powered, 0.1) };
    let homing = step(&mut flying(), &far);
    assert!(
        homing.level != ControlLevel::Converged,
        "60 m to the pad must be out of reach: {:?}",
        homing.level
    );
    let mut state = flying();
    let here = step(&mut state, &ControllerInput { lands_here: true, ..far });
    assert_eq!(here.level, ControlLevel::Converged, "{:?}", here.solver);
    let landed = here.predicted_touchdown.state;
    assert!((landed.x_m - 60.0).abs() < 10.0, "{landed:?}");
    // Afterwards the pad is the target again.
    let again = step(&mut state, &far);
    assert!(again.level != ControlLevel::Converged, "{:?}", again.level);
}

#[test]
fn the_upright_law_flies_alone_on_request() {
    let mut state = flying();
    let tilted = PlanarState { theta_rad: 1.2, ..profile().start.planar_state() };
    let output =
        step(&mut state, &ControllerInput { degraded: true, state: tilted, ..input(Phase::Powered, 0.1) });
    assert_eq!(output.level, ControlLevel::Stabiliser);
    assert_eq!(output.solver.status, SolveStatus::NotRun);
    // The nose is below upright, so the vehicle must pitch up, which is a negative gimbal angle.
    assert!(output.gimbal_command_rad < 0.0);
}

#[test]
fn without_an_estimate_the_shifted_plan_is_flown_until_it_ends() {
    let mut state = flying();
    let planned = step(&mut state.clone(), &input(Phase::Powered, 0.0)).plan;
    let lost = PlanarState { w_m_s: f64::NAN, ..PlanarState::default() };
    for tick in [1_u32, 2, 48] {
        let blind = ControllerInput { state: lost, ..input(Phase::Powered, f64::from(tick) * 0.1) };
        let output = step(&mut state, &blind);
        assert_eq!(output.level, ControlLevel::ShiftedPlan);
        assert_eq!(output.solver.status, SolveStatus::BadInput);
        assert_eq!(
            output.gimbal_command_rad.to_bits(),
            planned.gimbal_rad[tick as usize].to_bits(),
            "tick {tick}"
        );
        assert_eq!(output.plan.len, 49 - tick as usize);
    }
    let ended = step(&mut state, &ControllerInput { state: lost, ..input(Phase::Powered, 4.9) });
    assert_eq!((ended.level, ended.gimbal_command_rad.to_bits()), (ControlLevel::Stabiliser, 0));
}

#[test]
fn after_burnout_the_controller_is_idle() {
    let output = step(&mut flying(), &input(Phase::Powered, 5.2));
    assert_eq!(output.level, ControlLevel::Idle);
    assert_eq!(output.gimbal_command_rad.to_bits(), 0);
}

#[test]
fn a_missed_deadline_caps_the_work_of_the_next_tick() {
    let mut state = flying();
    let far = PlanarState { theta_rad: 1.2, w_m_s: 1.0, ..profile().start.planar_state() };
    let late = ControllerInput { state: far, deadline_missed: true, ..input(Phase::Powered, 0.1) };
    let output = step(&mut state, &late);
    assert!(output.solver.iterations <= 10, "{}", output.solver.iterations);
}

#[test]
fn after_missed_outputs_the_plan_continues_until_its_end() {
    let mut state = controller();
    let rehearsed = step(&mut state, &input(Phase::PadIdle, 0.0));
    assert_eq!(rehearsed.command_after_misses_rad(1).to_bits(), 0);
    let flown = step(&mut state, &input(Phase::Powered, 0.0));
    let commands = [0, 1, 48, 49, 500].map(|missed| flown.command_after_misses_rad(missed).to_bits());
    let planned = flown.plan.gimbal_rad.map(f64::to_bits);
    assert_eq!(commands, [planned[0], planned[1], planned[48], 0, 0]);
}

#[test]
fn phases_without_a_landing_are_idle_and_drop_the_plan() {
    for phase in [Phase::Safe, Phase::Boost, Phase::Coast, Phase::Touchdown, Phase::Safed, Phase::Chute] {
        let mut state = flying();
        let before = state.digest();
        let output = step(&mut state, &input(phase, 0.0));
        assert_eq!(output.level, ControlLevel::Idle);
        assert_eq!((output.gimbal_command_rad.to_bits(), output.plan.len), (0, 0));
        assert_ne!(state.digest(), before);
    }
}

#[test]
fn names_and_numbers_of_levels_are_one_to_one() {
    for (index, level) in ControlLevel::ALL.into_iter().enumerate() {
        assert_eq!(usize::from(level.index()), index);
        assert_eq!(ControlLevel::from_index(level.index()), Some(level));
    }
    assert_eq!(ControlLevel::from_index(6), None);
}

/// Mostly plausible numbers, sometimes any float.
fn number(range: core::ops::Range<f64>) -> impl Strategy<Value = f64> {
    prop_oneof![6 => range, 1 => prop::num::f64::ANY]
}

fn any_input() -> impl Strategy<Value = ControllerInput> {
    let state = (
        number(-30.0..30.0),
        number(-1.0..20.0),
        number(0.0..3.2),
        number(-10.0..2.0),
        number(-4.0..4.0),
        number(-3.0..3.0),
    )
        .prop_map(|(x, z, theta, u, w, q)| PlanarState::from_array([x, z, theta, u, w, q]));
    let phase = prop::sample::select(Phase::ALL.to_vec());
    (state, phase, number(0.0..6.0), number(-0.4..0.4), number(0.9..1.1), any::<(bool, bool)>()).prop_map(
        |(state, phase, time, gimbal, thrust_scale, (degraded, deadline_missed))| ControllerInput {
            state,
            gimbal_applied_rad: gimbal,
            thrust_scale,
            degraded,
            deadline_missed,
            ..input(phase, time)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn whatever_comes_in_the_command_is_a_number_within_the_limit(
        inputs in prop::collection::vec(any_input(), 1..4),
    ) {
        let mut state = controller();
        for input in inputs {
            let output = step(&mut state, &input);
            prop_assert!(output.gimbal_command_rad.abs() <= profile().gimbal.limit_rad());
            prop_assert!(output.fin_command_rad.iter().all(|fin| fin.is_finite()));
            prop_assert!(output.plan.used_states().iter().all(PlanarState::is_finite));
            prop_assert!(output.predicted_touchdown.state.is_finite());
            prop_assert!(output.solver.cost.is_finite());
        }
    }
}
