//! Describes the rocket, its motor, the air and a mission as data.
//!
//! * [`mission`] holds a flight from apogee: the vehicle, the start, the settings and the limits.
//! * [`airframe`] holds masses, shape and actuators.
//! * [`thrust_curve`] is the certified motor, and [`burn`] the expected burn of this motor.
//! * [`atmosphere`] and [`fins`] give the air and its forces on the fins.
//! * [`dynamics`] has the state and the equations of motion in the plane, [`rigid`] the state in space.
//! * [`site`] is the place of the pad on the Earth.
//! * [`launch`] is the ascent: the rail, and the booster stage; [`drop`] the release from a drone.

pub mod airframe;
pub mod atmosphere;
pub mod burn;
pub mod drop;
pub mod fins;
pub mod launch;
pub mod mission;
pub mod rigid;
pub mod site;
pub mod thrust_curve;

pub use nmpc::dynamics;
