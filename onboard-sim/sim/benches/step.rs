//! Times a millisecond of the world, and a whole fall with its landing burn.
//!
//! `cargo bench -p world`.
#![expect(clippy::expect_used, reason = "a bench without its built-in vehicle cannot run")]

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use flight::vehicles::motors;
use sim::world::{Actuators, Truth, World};

fn main() {
    divan::main();
}

fn windy(height_m: f64) -> World {
    let airframe = flight::vehicles::mission::builtin_airframe("mk2").expect("a built-in airframe");
    let motor = motors::builtin(&airframe.motor).expect("a built-in motor");
    let truth = Truth { wind_m_s: 5.0, ..Truth::default() };
    World::new(&Site::default(), &airframe, &motor, &truth, &RigidState::upright(height_m), 1)
        .expect("a valid world")
        .with_fins_at(FRAC_PI_2)
}

const OPEN: Actuators = Actuators { gimbal_rad: [0.0; 2], fins_rad: [FRAC_PI_2; 4], ..Actuators::NONE };

/// A thousand steps of the fall, in wind and gusts: a microsecond in the table is a nanosecond per
/// step.
#[divan::bench]
fn a_thousand_steps_in_the_air(bencher: divan::Bencher) {
    bencher.with_inputs(|| windy(500.0)).bench_refs(|world| world.advance(&OPEN, 1000));
}

/// A thousand steps of the fall with the motor burning.
#[divan::bench]
fn a_thousand_steps_under_thrust(bencher: divan::Bencher) {
    let burning = || {
        let mut world = windy(500.0);
        world.advance(&Actuators { ignite: true, ..OPEN }, 300);
        world
    };
    bencher.with_inputs(burning).bench_refs(|world| world.advance(&OPEN, 1000));
}

/// Two hundred steps of four substeps near the ground.
#[divan::bench]
fn two_hundred_steps_on_the_legs(bencher: divan::Bencher) {
    bencher.with_inputs(|| windy(0.6)).bench_refs(|world| world.advance(&OPEN, 200));
}
