//! The way up against RocketPy, and against hand values.

use flight::vehicle::launch::Launch;

use super::*;
use crate::world::truth::AscentTruth;

const IGNITING: Actuators = Actuators { ignite_booster: true, ..Actuators::NONE };

/// mk2 on its rail with this lean, degrees, in still air.
fn on_rail(tilt_deg: f64, truth: &Truth, ascent: &AscentTruth) -> World {
    let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let mut launch: Launch = mission.launch.unwrap();
    launch.rail.tilt_deg = tilt_deg;
    // With which RocketPy gave the numbers below: the parts have 2 % more inertia than a mission
    // estimates.
    (launch.rail.length_m, launch.booster.roll_inertia_kg_m2) = (2.5, 0.000_984);
    let truth = Truth { gust_scale: 0.0, ..*truth };
    world("mk2", &truth, &RigidState::upright(1.0)).on_rail(&launch, ascent)
}

/// Time since the thrust began, s, height above the rail, distance, m, and tilt, degrees, at
/// apogee.
fn apogee(world: &mut World) -> [f64; 4] {
    let from_m = world.state().position_m;
    while world.time_s() < 1.0 || world.state().velocity_m_s.z > 0.0 {
        world.step(&IGNITING);
    }
    let state = world.state();
    let travel_m = state.position_m - from_m;
    [world.time_s() - 0.15, travel_m.z, libm::hypot(travel_m.x, travel_m.y), state.tilt_rad().to_degrees()]
}

/// RocketPy 1.13.0 with the same stack (`tests/clients/rocketpy`): six degrees of freedom from the
/// rail to apogee. It has no drag across the body, so ours is switched off.
#[test]
fn val_rocketpy_apogee_of_the_stack() {
    let alike = Truth { crossflow_scale: 0.0, ..Truth::default() };
    for (tilt_deg, time_s, height_m, distance_m, apogee_tilt_deg) in [
        (2.0, 8.3616, 302.787, 22.098, 15.62),
        (5.0, 8.3374, 300.682, 55.007, 38.39),
        (0.0, 8.3665, 303.189, 0.0, 0.0),
    ] {
        let mut world = on_rail(tilt_deg, &alike, &AscentTruth::default());
        let [found_s, found_m, away_m, found_deg] = apogee(&mut world);
        assert!((found_s / time_s - 1.0).abs() < 0.01, "{tilt_deg} deg: {found_s} s, {time_s}");
        assert!((found_m / height_m - 1.0).abs() < 0.01, "{tilt_deg} deg: {found_m} m, {height_m}");
        // In the last second the angle of attack grows beyond what a linear force describes.
        assert!(
            (away_m - distance_m).abs() < 0.02 * distance_m + 0.1,
            "{tilt_deg} deg: {away_m} m, {distance_m}"
        );
        assert!((found_deg - apogee_tilt_deg).abs() < 2.0, "{tilt_deg} deg: {found_deg}, {apogee_tilt_deg}");
    }
}

/// A pad below its target on a slope does not stand inside the hill.
#[test]
fn a_rail_stands_on_the_ground_at_its_place() {
    let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let mut launch: Launch = mission.launch.unwrap();
    (launch.rail.x_m, launch.rail.y_m) = (-9.0, -28.0);
    let standing = |ground_rise| {
        let truth = Truth { ground_rise, ..Truth::default() };
        world("mk2", &truth, &RigidState::upright(1.0)).on_rail(&launch, &AscentTruth::default())
    };
    let [level, hill] = [[0.0; 2], [-0.02, -0.02]].map(standing);
    // The lean of the rail puts the centre of gravity a little downhill.
    assert!((hill.height_m() - level.height_m()).abs() < 0.005, "{} {}", hill.height_m(), level.height_m());
    assert!((hill.state().position_m.z - level.state().position_m.z - 0.74).abs() < 1e-12);
}

#[test]
fn val_rocketpy_rail_exit_and_burn_out() {
    let mut world =
        on_rail(2.0, &Truth { crossflow_scale: 0.0, ..Truth::default() }, &AscentTruth::default());
    let from_m = world.state().position_m;
    let travelled_m = |world: &World| (world.state().position_m - from_m).norm();
    while travelled_m(&world) < 2.5 {
        world.step(&IGNITING);
    }
    assert!((world.time_s() - 0.15 - 0.2763).abs() < 0.003, "{}", world.time_s());
    assert!((world.state().velocity_m_s.norm() - 17.448).abs() < 0.15, "{}", world.state().velocity_m_s);
    while world.time_s() < 0.15 + 1.692 {
        world.step(&IGNITING);
    }
    assert!((world.state().velocity_m_s.norm() - 70.242).abs() < 0.35, "{}", world.state().velocity_m_s);
    assert!((travelled_m(&world) - 76.987).abs() < 0.4, "{}", travelled_m(&world));
}

/// As it leaves the rail at 17.6 m/s, 5 m/s against the lean come from 15.7 degrees. By then 24 %
/// of the propellant is burnt: the forces of nose and fins act 0.1996 m behind the centre of
/// gravity, and the moment of inertia is 0.632 kg m^2.
#[test]
fn val_hand_the_stack_turns_into_the_wind() {
    let windy = Truth {
        crossflow_scale: 0.0,
        wind_m_s: 5.0,
        wind_towards_rad: core::f64::consts::PI,
        wind_exponent: 0.0,
        ..Truth::default()
    };
    let mut world = on_rail(2.0, &windy, &AscentTruth::default());
    let upright_rad = world.state().tilt_rad();
    while world.state().velocity_m_s.norm() < 17.6 {
        world.step(&IGNITING);
    }
    let through_air = world.air_velocity_m_s();
    let nose = world.state().nose_in_world();
    let sine = (through_air.normalize() - nose * through_air.normalize().dot(&nose)).norm();
    let pressure_pa = 0.5 * world.air().density_kg_m3 * through_air.norm_squared();
    let expected_rad_s2 = pressure_pa * 0.0043 * 4.694 * sine * 0.1996 / 0.632;
    assert!((libm::asin(sine).to_degrees() - 15.7).abs() < 0.3, "{sine}");
    let found_rad_s2 = world.inertial().angular_acceleration_rad_s2.norm();
    assert!((found_rad_s2 / expected_rad_s2 - 1.0).abs() < 0.02, "{found_rad_s2}, {expected_rad_s2}");
    world.advance(&IGNITING, 1000);
    assert!(world.state().nose_in_world().x > libm::sin(upright_rad) + 0.1, "into the wind");
}

#[test]
fn val_hand_masses_of_the_stack_on_its_rail() {
    let mut world = on_rail(0.0, &Truth::default(), &AscentTruth::default());
    let stack = world.stack.as_ref().unwrap();
    let mass = stack.mass(&world.mass, &world.cg_m(), 0.0);
    // RocketPy's sums of the same parts; its propellant has an inertia of its own of 0.0014 kg m^2.
    assert!((mass.inertia.mass_kg - 4.4316).abs() < 1e-4);
    assert!((mass.cg_m.x - 0.182_888).abs() < 1e-4);
    assert!((mass.inertia.across_kg_m2[0] - 0.649_426).abs() < 2e-3);
    assert!((mass.inertia.roll_kg_m2 - 0.007_001).abs() < 2e-5);
    // The centre of gravity stands 1 m above the booster's nozzle; the weight acts on it.
    assert!((world.state().position_m.z - 1.0).abs() < 1e-12);
    world.advance(&Actuators::NONE, 500);
    assert!((world.state().position_m.z - 1.0).abs() < 1e-12 && world.booster_attached());
    assert!((world.inertial().specific_force_m_s2 - Vector3::new(9.806_65, 0.0, 0.0)).norm() < 1e-9);
}

#[test]
fn the_charge_parts_the_stages_and_pushes_the_vehicle() {
    let ascent = AscentTruth { tip_off_rad_s: [0.1, -0.05], ..AscentTruth::default() };
    let mut world = on_rail(0.0, &Truth::default(), &ascent);
    world.advance(&IGNITING, 5000);
    let before = *world.state();
    world.advance(&Actuators { separate: true, ..IGNITING }, 21);
    assert!(!world.booster_attached() && world.charge_fired_s().is_some());
    let pushed_m_s = world.state().velocity_m_s.z - before.velocity_m_s.z + 0.021 * 9.8;
    // 2 N s on 3.1 kg, and some drag.
    assert!((pushed_m_s - 2.0 / 3.1).abs() < 0.08, "{pushed_m_s}");
    let turned = world.state().rate_rad_s - before.rate_rad_s;
    assert!((turned - Vector3::new(0.0, 0.1, -0.05)).norm() < 0.01, "{turned}");

    let mut stuck = on_rail(0.0, &Truth::default(), &ascent);
    stuck.inject(&Fault::SeparationFails);
    stuck.advance(&Actuators { separate: true, ..IGNITING }, 6000);
    assert!(stuck.booster_attached());
}

#[test]
fn a_stack_that_falls_back_ends_in_a_body_strike() {
    let mut world = on_rail(5.0, &Truth::default(), &AscentTruth::default());
    world.inject(&Fault::AscentWeak { scale: 0.4 });
    while world.rest().is_none() && world.time_s() < 60.0 {
        world.step(&IGNITING);
    }
    assert_eq!(world.rest().map(|rest| rest.outcome), Some(RestOutcome::BodyStrike));
    assert!(world.touchdown().is_some_and(|touchdown| touchdown.over_ground.vertical_m_s < -15.0));
}

#[test]
fn canted_fins_roll_the_stack_until_the_wind_at_them_is_straight() {
    let ascent = AscentTruth { fin_cant_rad: 0.002, ..AscentTruth::default() };
    let mut world = on_rail(0.0, &Truth::default(), &ascent);
    world.advance(&IGNITING, 4000);
    let speed_m_s = world.state().velocity_m_s.norm();
    // At the fins' radius of 58 mm.
    let steady_rad_s = 0.002 * speed_m_s / 0.058;
    let found_rad_s = world.state().rate_rad_s.x;
    assert!((found_rad_s / steady_rad_s - 1.0).abs() < 0.1, "{found_rad_s}, {steady_rad_s}");
}
