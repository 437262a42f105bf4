//! Contact: standing, bouncing, sliding, tipping over, and the parachute.

use super::*;
use crate::world::ground::RestOutcome;

/// A world with the feet at a height, m, a velocity (x, z), m/s, a lean, rad, and a rate about body
/// y, rad/s.
fn approaching(height_m: f64, [x_m_s, z_m_s]: [f64; 2], lean_rad: f64, rate_rad_s: f64) -> World {
    let airframe = on_springs("mk2");
    let above_feet_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
    let mut state = leaning(height_m + above_feet_m, lean_rad, 0.0);
    state.velocity_m_s = Vector3::new(x_m_s, 0.0, z_m_s);
    state.rate_rad_s.y = rate_rad_s;
    world("mk2", &Truth::default(), &state).with_fins_at(FRAC_PI_2)
}

fn until_rest(world: &mut World) -> Rest {
    for _ in 0..20_000 {
        world.step(&OPEN);
        if let Some(rest) = world.rest() {
            return *rest;
        }
    }
    panic!("no rest after 20 s: {:?}", world.state());
}

#[test]
fn a_standing_vehicle_rests_on_its_legs_and_its_accelerometer_measures_gravity() {
    let mut world = approaching(0.02, [0.0, 0.0], 0.0, 0.0);
    let rest = until_rest(&mut world);
    assert_eq!(rest.outcome, RestOutcome::Upright);
    // 30.7 N on four springs of 2,000 N/m.
    let sunk_m = world.weight_n() / (4.0 * 2000.0);
    assert!((world.height_m() + sunk_m).abs() < 1e-3, "{}", world.height_m());
    let measured = world.inertial().specific_force_m_s2 - Vector3::new(STANDARD_GRAVITY_M_S2, 0.0, 0.0);
    assert!(measured.norm() < 1e-6, "{measured}");
    let touchdown = world.touchdown().unwrap();
    let fallen_m_s = (2.0 * STANDARD_GRAVITY_M_S2 * 0.02).sqrt();
    assert!((touchdown.over_ground.vertical_m_s + fallen_m_s).abs() < 0.01, "{touchdown:?}");
}

/// Landings at each limit of the legs' verdict, one at a time, and at the vertical and lateral
/// limits together.
#[test]
fn landings_at_the_limits_of_the_verdict_stay_upright() {
    for (velocity_m_s, lean_deg, rate_deg_s) in [
        ([0.0, -1.0], 0.0, 0.0),
        ([0.7, -0.3], 0.0, 0.0),
        ([0.0, -0.3], 10.0, 0.0),
        ([0.0, -0.3], 0.0, 30.0),
        ([0.7, -1.0], 0.0, 0.0),
        ([0.0, -1.0], 10.0, 30.0),
    ] {
        let mut world =
            approaching(0.1, velocity_m_s, f64::to_radians(lean_deg), f64::to_radians(rate_deg_s));
        let rest = until_rest(&mut world);
        assert_eq!(rest.outcome, RestOutcome::Upright, "{velocity_m_s:?} {lean_deg} {rate_deg_s}");
    }
}

#[test]
fn a_fast_or_leaning_landing_tips_over() {
    for (velocity_m_s, lean_deg) in [([4.0, -0.5], 0.0), ([0.0, -0.2], 43.0), ([2.0, -0.5], 15.0)] {
        let mut world = approaching(0.1, velocity_m_s, f64::to_radians(lean_deg), 0.0);
        let rest = until_rest(&mut world);
        assert_eq!(rest.outcome, RestOutcome::TippedOver, "{velocity_m_s:?} {lean_deg}");
    }
}

#[test]
fn after_a_fall_from_height_the_body_hits_the_ground() {
    let mut world = approaching(30.0, [0.0, -20.0], 0.0, 0.0);
    assert_eq!(until_rest(&mut world).outcome, RestOutcome::BodyStrike);
    assert!(world.touchdown().unwrap().over_ground.vertical_m_s < -25.0);
}

/// Legs without damping return the energy: the vehicle bounces to the height it fell from. Damping
/// takes the energy.
#[test]
fn legs_bounce_without_damping() {
    let peak_m = |damping_n_s_m: f64| {
        let mut airframe = on_springs("mk2");
        airframe.legs.damping_n_s_m = damping_n_s_m;
        let motor = motors::builtin(&airframe.motor).unwrap();
        let truth = Truth { drag_scale: 0.0, ..Truth::default() };
        let above_feet_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
        let mut world = World::new(
            &Site::default(),
            &airframe,
            &motor,
            &truth,
            &RigidState::upright(above_feet_m + 0.05),
            1,
        )
        .unwrap();
        let mut peak_m: f64 = 0.0;
        while world.time_s() < 0.4 {
            world.step(&OPEN);
            if world.touchdown().is_some() {
                peak_m = peak_m.max(world.height_m());
            }
        }
        peak_m
    };
    assert!((peak_m(0.0) - 0.05).abs() < 1e-3, "{}", peak_m(0.0));
    assert!(peak_m(45.0) < 0.015, "{}", peak_m(45.0));
}

/// Ejected at full falling speed, the parachute is open after its delay and distance, and the
/// vehicle sinks at 6 m/s.
#[test]
fn the_parachute_brings_the_vehicle_down_slowly() {
    for (name, slowest, fastest) in
        [("mk2", 5.8, 6.3), ("mk3", 5.8, 6.3), ("mk2-h53", 5.8, 6.3), ("mini-f10", 5.8, 6.3)]
    {
        let mut world = world(name, &Truth::default(), &RigidState::upright(400.0)).with_fins_at(FRAC_PI_2);
        world.advance(&OPEN, 5000);
        let from_m = world.height_m();
        let eject = Actuators { parachute: true, ..OPEN };
        while world.parachute_open_share() < 1.0 {
            world.step(&eject);
        }
        let lost_m = from_m - world.height_m();
        assert!((20.0..120.0).contains(&lost_m), "{name}: opened {lost_m} m lower");
        world.advance(&OPEN, 5000);
        let sink_m_s = -world.state().velocity_m_s.z;
        assert!((slowest..fastest).contains(&sink_m_s), "{name}: {sink_m_s} m/s");
        assert!(world.state().tilt_rad() < 0.1, "{name}");
    }
}
