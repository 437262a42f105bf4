mod ascent;
mod invariants;
mod landing;
mod legs;
mod mismatch;
#[path = "../../../../../flight/tests/missions/mod.rs"]
mod missions;

use core::f64::consts::FRAC_PI_2;

use flight::vehicles::{mission, motors};
use nalgebra::UnitQuaternion;

use super::*;

const OPEN: Actuators = Actuators { gimbal_rad: [0.0; 2], fins_rad: [FRAC_PI_2; 4], ..Actuators::NONE };

/// A mission's airframe on four springs without a block that gives way.
fn on_springs(name: &str) -> Airframe {
    let mut missions = mission::BUILTIN.iter().chain(&missions::TEST_MISSIONS);
    let (_, text) = missions.find(|(available, _)| *available == name).unwrap();
    let mut airframe = mission::from_toml(text, name).unwrap().airframe;
    let legs = &mut airframe.legs;
    (legs.foot_station_m, legs.stiffness_n_m, legs.damping_n_s_m, legs.crush) = (-0.06, 2_000.0, 45.0, None);
    airframe
}

fn world(name: &str, truth: &Truth, initial: &RigidState) -> World {
    let airframe = on_springs(name);
    let motor = motors::builtin(&airframe.motor).unwrap();
    World::new(&Site::default(), &airframe, &motor, truth, initial, 1).unwrap()
}

/// Falls from rest, tail first, with the centre of gravity 300 m above the ground. Returns time and
/// speed when the centre of gravity would reach the ground.
fn drop(airframe: &Airframe, opening_rad: f64) -> (f64, f64) {
    let motor = motors::builtin(&airframe.motor).unwrap();
    let mut world =
        World::new(&Site::default(), airframe, &motor, &Truth::default(), &RigidState::upright(300.0), 1)
            .unwrap()
            .with_fins_at(opening_rad);
    let actuators = Actuators { fins_rad: [opening_rad; 4], ..Actuators::default() };
    loop {
        let before = *world.state();
        let time_s = world.time_s();
        world.step(&actuators);
        let after = world.state();
        if after.position_m.z <= 0.0 {
            let share = before.position_m.z / (before.position_m.z - after.position_m.z);
            return (time_s + share * STEP_S, -before.velocity_m_s.z);
        }
    }
}

/// 3 kg from 300 m at rest to sea level by drag area: `RocketPy` and an independent integration.
#[test]
fn val_rocketpy_drop_times() {
    for (drag_area_m2, time_s, speed_m_s) in [
        (0.0043, 8.164, 67.70),
        (0.007_51, 8.423, 62.14),
        (0.030_96, 10.338, 39.05),
        (0.037_28, 10.839, 35.80),
    ] {
        let mut airframe = on_springs("mk2-h53");
        airframe.body.axial_drag_coefficient = drag_area_m2 / airframe.body.reference_area_m2;
        // Legs and hull are out of the way, so the centre of gravity itself falls to sea level.
        airframe.legs.foot_station_m = -1e-9;
        airframe.mass.loaded_cg_station_m = 1e-6;
        (airframe.mass.propellant_station_m, airframe.gimbal.pivot_station_m) = (0.0, 0.0);
        let (found_s, found_m_s) = drop(&airframe, 0.0);
        assert!((found_s - time_s).abs() < 0.02, "{drag_area_m2} m^2: {found_s} s, expected {time_s}");
        assert!((found_m_s - speed_m_s).abs() < 0.02, "{drag_area_m2} m^2: {found_m_s} m/s, {speed_m_s}");
    }
}

/// The same fall with the drag of the fins: open, they and the body have 0.03096 m^2.
#[test]
fn val_rocketpy_drop_time_with_open_fins() {
    let mut airframe = on_springs("mk2-h53");
    airframe.legs.foot_station_m = -1e-9;
    airframe.mass.loaded_cg_station_m = 1e-6;
    (airframe.mass.propellant_station_m, airframe.gimbal.pivot_station_m) = (0.0, 0.0);
    let (found_s, found_m_s) = drop(&airframe, FRAC_PI_2);
    assert!((found_s - 10.338).abs() < 0.02 && (found_m_s - 39.05).abs() < 0.02, "{found_s} {found_m_s}");
}

/// An upright state leaning by pitch (about world y) and yaw (about world x), rad.
fn leaning(height_m: f64, pitch_rad: f64, yaw_rad: f64) -> RigidState {
    let mut state = RigidState::upright(height_m);
    state.world_from_body = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), pitch_rad)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), yaw_rad)
        * state.world_from_body;
    state
}

/// Fig. 5 of the landing paper: fins open, 2 degrees of pitch and 1 degree of yaw. The attitude
/// settles, and the speed at sea level is 39.4 m/s.
#[test]
fn val_landing_paper_fig_5() {
    let (pitch_rad, yaw_rad) = (2.0_f64.to_radians(), 1.0_f64.to_radians());
    let mut world =
        world("mk2-h53", &Truth::default(), &leaning(1000.0, pitch_rad, yaw_rad)).with_fins_at(FRAC_PI_2);
    // The largest tilt in each 200 m of the fall.
    let mut worst_deg = [0.0_f64; 5];
    let mut felt_before_contact = Vector3::zeros();
    while world.touchdown().is_none() {
        felt_before_contact = world.inertial().specific_force_m_s2;
        world.step(&OPEN);
        let band = (world.state().position_m.z / 200.0).clamp(0.0, 4.0) as usize;
        worst_deg[band] = worst_deg[band].max(world.state().tilt_rad().to_degrees());
    }
    assert!(worst_deg.is_sorted_by(|lower, upper| lower < upper), "{worst_deg:?}");
    assert!(worst_deg[4] < 2.25 && worst_deg[0] < 0.25 * worst_deg[4], "{worst_deg:?}");
    // The air gets denser on the way down, so the speed lags a little behind the terminal speed, at
    // which the drag equals the weight.
    let felt_m_s2 = felt_before_contact.norm();
    let speed_m_s = -world.touchdown().unwrap().over_ground.vertical_m_s;
    let terminal_m_s = speed_m_s * (STANDARD_GRAVITY_M_S2 / felt_m_s2).sqrt();
    assert!((terminal_m_s - 39.4).abs() < 0.05, "{terminal_m_s} m/s");
    assert!((speed_m_s - terminal_m_s).abs() < 0.2, "{speed_m_s} m/s, terminal {terminal_m_s}");
}

/// The standard's density at 3,000 m is 0.7422 of that at sea level (table of geometric
/// altitudes): the speed at which drag equals weight is 1.161 times as high.
#[test]
fn val_coesa_1976_terminal_speed_at_3000_m() {
    let airframe = on_springs("mk3");
    let motor = motors::builtin(&airframe.motor).unwrap();
    let still = Truth { gust_scale: 0.0, ..Truth::default() };
    let terminal_m_s = |altitude_m: f64, temperature_c: Option<f64>| {
        let site = Site { altitude_m, temperature_c, ..Site::default() };
        let start = RigidState::upright(600.0);
        let mut world =
            World::new(&site, &airframe, &motor, &still, &start, 1).unwrap().with_fins_at(FRAC_PI_2);
        while world.state().position_m.z > 2.0 {
            world.step(&OPEN);
        }
        -world.state().velocity_m_s.z
            * libm::sqrt(STANDARD_GRAVITY_M_S2 / world.inertial().specific_force_m_s2.norm())
    };
    let sea_level_m_s = terminal_m_s(0.0, None);
    let ratio = terminal_m_s(3_000.0, None) / sea_level_m_s;
    assert!((ratio - 1.161).abs() < 1e-3, "{ratio}");
    // Density falls as the absolute temperature rises: 15 to 45 degrees Celsius at sea level.
    let hot = terminal_m_s(0.0, Some(45.0)) / sea_level_m_s;
    assert!((hot - libm::sqrt(318.15 / 288.15)).abs() < 1e-3, "{hot}");
}

/// Without air and thrust the mechanical energy and the angular momentum are constant.
#[test]
fn energy_is_conserved_without_air() {
    let truth = Truth { drag_scale: 0.0, ..Truth::default() };
    let mut initial = leaning(400.0, 0.7, -0.4);
    initial.velocity_m_s = Vector3::new(3.0, -2.0, 20.0);
    initial.rate_rad_s = Vector3::new(5.0, 2.0, -3.0);
    let mut world = world("mk2", &truth, &initial);
    let energy_j = |world: &World| {
        let (state, mass) = (world.state(), world.mass());
        let rate = state.rate_rad_s;
        let turning = mass.roll_inertia_kg_m2 * rate.x * rate.x
            + mass.pitch_inertia_kg_m2 * (rate.y * rate.y + rate.z * rate.z);
        let moving = mass.mass_kg * state.velocity_m_s.norm_squared();
        0.5 * (turning + moving) + world.weight_n() * state.position_m.z
    };
    let before_j = energy_j(&world);
    world.advance(&Actuators::default(), 5000);
    let after_j = energy_j(&world);
    assert!((after_j / before_j - 1.0).abs() < 1e-10, "{before_j} {after_j}");
    assert!(
        world.inertial().specific_force_m_s2.norm() < 1e-12,
        "an accelerometer in free fall measures nothing"
    );
}

/// A burn in vacuum, straight up, against the rocket equation with the file's own impulse and
/// propellant.
#[test]
fn val_tsiolkovsky_vertical_burn() {
    let truth = Truth { drag_scale: 0.0, ignition_delay_s: 0.0, ..Truth::default() };
    let mut world = world("mk2", &truth, &RigidState::upright(1000.0));
    let motor = motors::builtin("H45W").unwrap();
    let (full_kg, burnt_kg) = (world.mass().mass_kg, motor.propellant_mass_kg());
    let ignite = Actuators { ignite: true, ..Actuators::default() };
    world.advance(&ignite, 8000);
    let exhaust_m_s = motor.total_impulse_n_s() / burnt_kg;
    let expected = exhaust_m_s * libm::log(full_kg / (full_kg - burnt_kg)) - STANDARD_GRAVITY_M_S2 * 8.0;
    let found = world.state().velocity_m_s.z;
    assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    assert!((world.mass().mass_kg - (full_kg - burnt_kg)).abs() < 1e-12);
    assert!(world.state().tilt_rad() < 1e-12);
}

/// A gimbal angle turns the vehicle as [`flight::vehicle::rigid`] says: `q' = -T sin p (X_CG -
/// X_THR) / I`.
#[test]
fn val_gimbal_signs_and_arm() {
    for axis in 0..2 {
        let truth = Truth { drag_scale: 0.0, ignition_delay_s: 0.0, ..Truth::default() };
        let mut world = world("mk2", &truth, &RigidState::upright(1000.0));
        let mut actuators = Actuators { ignite: true, ..Actuators::default() };
        actuators.gimbal_rad[axis] = 0.1;
        world.advance(&actuators, 500);
        // mk2's ring is 0.097 m above the nozzle.
        let arm_m = world.mass().cg_station_m - 0.097;
        let expected = -world.thrust_n() * libm::sin(world.gimbal_rad()[axis]) * arm_m
            / world.mass().pitch_inertia_kg_m2;
        let rate = world.state().rate_rad_s;
        // The most that jet damping takes.
        let slack = 0.02 * rate.norm();
        let found = world.inertial().angular_acceleration_rad_s2[axis + 1];
        assert!((found - expected).abs() < 0.01 * expected.abs() + slack, "axis {axis}: {found} {expected}");
        assert!(world.inertial().angular_acceleration_rad_s2[2 - axis].abs() < 1e-9);
    }
}

/// Free of forces, a motor that swings turns the body back: `w = -m (L^2/12 + r^2/4 + l a) / I` of
/// the gimbal's rate, with mk2's full motor (0.294784 kg, 194 x 38 mm), a ring 0.05 m above its
/// middle, and 0.303 m from there to the centre of gravity. The centre of gravity goes `m l / M` of
/// the angle to the side.
#[test]
fn val_hand_a_swinging_motor_turns_the_body_back() {
    let mut airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
    airframe.gimbal.pivot_station_m = 0.147;
    let motor = motors::builtin(&airframe.motor).unwrap();
    let truth = Truth { drag_scale: 0.0, gust_scale: 0.0, ..Truth::default() };
    for axis in 0..2 {
        let mut world =
            World::new(&Site::default(), &airframe, &motor, &truth, &RigidState::upright(1000.0), 1).unwrap();
        let mut actuators = Actuators::default();
        actuators.gimbal_rad[axis] = 1.0;
        world.advance(&actuators, 30);
        let inertia_kg_m2 = 0.294_784 * (0.194 * 0.194 / 12.0 + 0.038 * 0.038 / 16.0 + 0.05 * 0.303);
        let expected_rad_s = -inertia_kg_m2 / 0.12 * airframe.gimbal.servo.rate_rad_s();
        let found_rad_s = world.state().rate_rad_s[axis + 1];
        assert!((found_rad_s / expected_rad_s - 1.0).abs() < 1e-6, "{axis}: {found_rad_s} {expected_rad_s}");
        let aside_m = 0.294_784 * 0.05 / 3.1 * libm::sin(world.gimbal_rad()[axis]);
        let expected_m = [Vector3::new(0.4, 0.0, aside_m), Vector3::new(0.4, -aside_m, 0.0)][axis];
        assert!((world.cg_m() - expected_m).norm() < 1e-9, "{axis}: {}", world.cg_m());
        // It has reached its stop, and nothing is left.
        world.advance(&actuators, 200);
        assert!(world.state().rate_rad_s.norm() < 1e-12, "{axis}: {}", world.state().rate_rad_s);
    }
}

/// 5 m/s of crosswind push the bare body by 1/2 1.224 25 x 1.2 x 0.0518 m^2 = 0.95 N.
#[test]
fn val_hand_crosswind_on_the_bare_body() {
    let truth = Truth { wind_m_s: 5.0, gust_scale: 0.0, ..Truth::default() };
    let mut world = world("mk2", &truth, &RigidState::upright(10.0));
    world.step(&Actuators::default());
    let in_world = world.state().world_from_body * world.inertial().specific_force_m_s2;
    let push_n = world.mass().mass_kg * in_world.x;
    assert!((push_n - 0.951).abs() < 0.002 && in_world.y.abs() < 1e-12, "{push_n} N");
}
