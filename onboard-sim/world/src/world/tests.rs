use core::f64::consts::FRAC_PI_2;

use flight::motors;
use nalgebra::UnitQuaternion;

use super::*;

const OPEN: Actuators =
    Actuators { gimbal_rad: [0.0; 2], fins_rad: [FRAC_PI_2; 4], ignite: false, parachute: false };

fn world(name: &str, truth: &Truth, initial: &RigidState) -> World {
    let airframe = Airframe::builtin(name).unwrap();
    let motor = motors::builtin(&airframe.motor).unwrap();
    World::new(&airframe, &motor, truth, initial, 1).unwrap()
}
