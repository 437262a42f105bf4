//! Differences between the true vehicle and its data, against hand values.

use super::*;
use crate::world::wind::Wind;

const IGNITING: Actuators =
    Actuators { gimbal_rad: [0.0; 2], fins_rad: [FRAC_PI_2; 4], ignite: true, ..Actuators::NONE };

/// Air force along the nose, N, at 30 m/s down with the fins open, without and with a burning
/// motor.
fn air_n(truth: &Truth, lit: bool) -> f64 {
    let truth = Truth { gust_scale: 0.0, ignition_delay_s: 0.0, ..*truth };
    let mut state = RigidState::upright(100.0);
    state.velocity_m_s.z = -30.0;
    let mut world = world("mk2", &truth, &state).with_fins_at(FRAC_PI_2);
    world.advance(if lit { &IGNITING } else { &OPEN }, 500);
    (world.state.position_m, world.state.velocity_m_s) = (state.position_m, state.velocity_m_s);
    world.step(if lit { &IGNITING } else { &OPEN });
    world.inertial().specific_force_m_s2.x * world.mass().mass_kg - world.thrust_n()
}

#[test]
fn val_hand_scales_and_exhaust_change_body_and_fin_drag() {
    let airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
    let (body_m2, all_m2) = (airframe.drag_area_m2(0.0), airframe.drag_area_m2(FRAC_PI_2));
    let pressure_pa = 0.5 * Site::default().air_at_m(100.0).density_kg_m3 * 900.0;
    let expect = |truth: &Truth, lit: bool, area_m2: f64| {
        let found_n = air_n(truth, lit);
        // Speed changes by half a step of braking, thrust by half a step of burning.
        assert!(
            (found_n / (pressure_pa * area_m2) - 1.0).abs() < 3e-3,
            "{found_n} for {}",
            pressure_pa * area_m2
        );
    };
    let nominal = Truth::default();
    expect(&nominal, false, all_m2);
    expect(&nominal, true, all_m2);
    let fins_m2 = all_m2 - body_m2;
    let scaled = Truth { body_drag_scale: 0.5, fin_drag_scale: 1.2, ..nominal };
    expect(&scaled, false, 0.5 * body_m2 + 1.2 * fins_m2);
    // The thrust is far above the dynamic pressure on the base, so the exhaust has its whole
    // effect.
    let plume = Truth { plume_body_loss: 0.7, plume_fin_loss: 0.1, ..nominal };
    expect(&plume, false, all_m2);
    expect(&plume, true, 0.3 * body_m2 + 0.9 * fins_m2);
}

#[test]
fn val_hand_inertia_and_gimbal_gain_change_the_turning() {
    let turning = |truth: &Truth| {
        let truth = Truth { drag_scale: 0.0, ignition_delay_s: 0.0, ..*truth };
        let mut world = world("mk2", &truth, &RigidState::upright(100.0));
        world.advance(&Actuators { gimbal_rad: [0.03, 0.0], ..IGNITING }, 400);
        let gimbal_rad = world.gimbal_rad()[0];
        (
            gimbal_rad,
            world.inertial().angular_acceleration_rad_s2.y / world.thrust_n() / libm::sin(gimbal_rad),
        )
    };
    let (nominal_rad, nominal) = turning(&Truth::default());
    let (gained_rad, gained) = turning(&Truth { gimbal_gain: 1.1, inertia_scale: 1.25, ..Truth::default() });
    assert!((gained_rad / nominal_rad - 1.1).abs() < 1e-12);
    // The jet damps a turn that is slower by 1.1 / 1.25 a little less.
    assert!((gained * 1.25 / nominal - 1.0).abs() < 0.01, "{gained} {nominal}");
}

#[test]
fn feedback_does_not_see_misalignment_and_play() {
    let truth = Truth {
        fin_offset_rad: [0.02, -0.02, 0.0, 0.0],
        fin_slop_rad: 0.04,
        gimbal_slop_rad: 0.02,
        ..Truth::default()
    };
    let mut world = world("mk2", &truth, &RigidState::upright(100.0));
    let play = Truth::default();
    let mut sound = super::world("mk2", &play, &RigidState::upright(100.0));
    let command = Actuators { gimbal_rad: [0.05, -0.05], fins_rad: [0.8; 4], ..Actuators::default() };
    world.advance(&command, 1000);
    sound.advance(&command, 1000);
    assert_eq!(world.fins_feedback_rad().map(f64::to_bits), sound.fins_rad().map(f64::to_bits));
    assert_eq!(world.gimbal_feedback_rad().map(f64::to_bits), sound.gimbal_rad().map(f64::to_bits));
    // Opening, the fins trail by half the play.
    for (fin, offset_rad) in truth.fin_offset_rad.into_iter().enumerate() {
        let expected_rad = world.fins_feedback_rad()[fin] - 0.02 + offset_rad;
        assert!((world.fins_rad()[fin] - expected_rad).abs() < 1e-12);
    }
    assert!((world.gimbal_rad()[0] - (world.gimbal_feedback_rad()[0] - 0.01)).abs() < 1e-12);
}

#[test]
fn a_vehicle_stands_at_right_angles_to_a_slope_and_at_its_height() {
    let rise = libm::tan(3_f64.to_radians());
    let truth = Truth { ground_rise: [rise, 0.0], gust_scale: 0.0, ..Truth::default() };
    let cg_m = 0.6;
    let mut state = RigidState::upright(20.0 * rise + cg_m + 0.1);
    state.position_m.x = 20.0;
    let mut world = world("mk2", &truth, &state);
    assert!((world.height_m() - (state.position_m.z - 20.0 * rise - world.cg_above_feet_m())).abs() < 1e-12);
    world.advance(&OPEN, 5000);
    let rest = world.rest().expect("at rest");
    assert_eq!(rest.outcome, RestOutcome::Upright);
    assert!((rest.tilt_rad.to_degrees() - 3.0).abs() < 0.3, "{}", rest.tilt_rad.to_degrees());
    let along_m = world.state().position_m.x;
    assert!((world.state().position_m.z - along_m * rise - world.cg_above_feet_m()).abs() < 0.02);
}

#[test]
fn val_hand_wind_over_height() {
    let wind = Wind::new(5.0, 0.0, 0.0, 1).over_height(0.25, 0.001);
    // 16^0.25 is 2, and 150 m above the reference height the wind has turned by 0.15 rad.
    let at_160_m = wind.mean_m_s(160.0);
    assert!((at_160_m - Vector3::new(10.0 * libm::cos(0.15), 10.0 * libm::sin(0.15), 0.0)).norm() < 1e-9);
    assert!((wind.mean_m_s(10.0) - Vector3::new(5.0, 0.0, 0.0)).norm() < 1e-12);
}
