//! RocketPy flies the stack of vehicle and booster from its rail to apogee, as ours does.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use clients::{ROCKETPY, file};
use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use serde_json::Value;
use sim::world::{Actuators, AscentTruth, Truth, World};

/// Height and time of our apogee since the thrust began, m and s, from a rail with this lean,
/// degrees.
fn ours(tilt_deg: f64) -> (f64, f64) {
    let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let mut launch = mission.launch.unwrap();
    launch.rail.tilt_deg = tilt_deg;
    // RocketPy has no drag across the body.
    let truth = Truth { gust_scale: 0.0, crossflow_scale: 0.0, ..Truth::default() };
    let ascent = AscentTruth { ignition_delay_s: 0.0, ..AscentTruth::default() };
    let start = RigidState::upright(1.0);
    let world = World::new(&Site::default(), &mission.airframe, &mission.motor_curve, &truth, &start, 1);
    let mut world = world.unwrap().on_rail(&launch, &ascent);
    let from_m = world.state().position_m.z;
    while world.time_s() < 1.0 || world.state().velocity_m_s.z > 0.0 {
        world.step(&Actuators { ignite_booster: true, ..Actuators::NONE });
    }
    (world.state().position_m.z - from_m, world.time_s())
}

#[test]
fn val_rocketpy_the_stack_has_its_masses_and_its_apogee() {
    let output = ROCKETPY.python().arg(file("rocketpy/ascent.py")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let number =
        |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));

    let booster = flight::vehicles::mission::builtin("mk2").unwrap().unwrap().launch.unwrap().booster;
    for (ours, path) in [
        (booster.dry_kg, "/mass/booster_dry_with_casing/kg"),
        (booster.cg_station_m, "/mass/booster_dry_with_casing/cg_station_m"),
        (booster.pitch_inertia_kg_m2, "/mass/booster_dry_with_casing/pitch_inertia_kg_m2"),
        (booster.nose.slope_per_rad, "/aero/nose/cn_alpha_per_rad"),
        (booster.nose.station_m, "/aero/nose/cp_station_m"),
        (booster.fin_force.slope_per_rad, "/aero/fins/cn_alpha_per_rad"),
        (booster.fin_force.station_m, "/aero/fins/cp_station_m"),
    ] {
        assert!((ours / number(path) - 1.0).abs() < 1e-3, "{path}: {}, ours is {ours}", number(path));
    }
    // Ours is an estimate from mass and diameter.
    let roll_kg_m2 = number("/mass/booster_dry_with_casing/roll_inertia_kg_m2");
    assert!((booster.roll_inertia_kg_m2 / roll_kg_m2 - 1.0).abs() < 0.03, "{roll_kg_m2}");
    for flight in 0..3 {
        let (height_m, time_s) = ours(number(&format!("/flights/{flight}/rail_tilt_deg")));
        let theirs = |what: &str| number(&format!("/flights/{flight}/apogee/{what}"));
        assert!((height_m / theirs("height_m") - 1.0).abs() < 0.01, "{height_m} m, {}", theirs("height_m"));
        assert!((time_s / theirs("t_s") - 1.0).abs() < 0.01, "{time_s} s, {}", theirs("t_s"));
    }
}
