//! A step of the world does not allocate: in the air, under thrust, under the parachute and on the
//! ground.
#![expect(clippy::expect_used, reason = "a missing built-in vehicle is a failed test")]

use core::f64::consts::FRAC_PI_2;

use flight::vehicle::rigid::RigidState;
use flight::vehicle::site::Site;
use flight::vehicles::motors;
use sim::world::{Actuators, Truth, World};

#[test]
fn steps_do_not_allocate() {
    let airframe = flight::vehicles::mission::builtin_airframe("mk2").expect("a built-in airframe");
    let motor = motors::builtin(&airframe.motor).expect("a built-in motor");
    let truth = Truth { wind_m_s: 5.0, ..Truth::default() };
    let mut world = World::new(&Site::default(), &airframe, &motor, &truth, &RigidState::upright(60.0), 1)
        .expect("a valid world");
    let open = Actuators { fins_rad: [FRAC_PI_2; 4], ..Actuators::default() };
    let allocated = allocation_counter::measure(|| {
        world.advance(&open, 500);
        world.advance(&Actuators { ignite: true, ..open }, 500);
        world.advance(&Actuators { parachute: true, ..open }, 14_000);
    });
    assert!(world.touchdown().is_some());
    assert_eq!(allocated.count_total, 0);
}
