//! Everything that decides in flight, and nothing else.
//!
//! The crate is pure: state, inputs and time are arguments, and the same arguments give the same bits on any
//! machine. There is no clock, socket, file, thread or random source in it, so a log of
//! [`controller::ControllerInput`] is enough to fly the controller again.
//!
//! * [`profile`]: the vehicle, motor, start, weights and limits, as data.
//! * [`phase`]: the flight phases and the one table that moves between them.
//! * [`arming`] and [`gate`]: the checks before arming and before ignition, each with the value found.
//! * [`airframe`]: the vehicle's masses, shape and actuators, as data.
//! * [`atmosphere`], [`thrust_curve`], [`motors`] and [`fins`]: the air, the motors and the fins' aerodynamics, for
//!   the controller's model and the simulated truth alike.
//! * [`rigid`]: the state of a rocket in space, and its frames.
//! * [`estimator`]: the state and the wind, from the sensors.
//! * [`dynamics`]: the planar equations of motion, their integrator and their exact derivatives.
//! * [`nmpc`]: the landing optimal-control problem and its solver.
//! * [`stabiliser`]: the upright law that flies when no plan can be had.
//! * [`thrust_estimate`]: how strong the motor is, from the accelerometer.
//! * [`motor_estimate`]: impulse, burn time and ignition of the motor, in space.
//! * [`controller`]: one tick of the controller, from estimate to gimbal command.
//! * [`verdict`]: the touchdown limits and whether a landing kept them.
//!
//! Units are SI and radians; names carry units and frames. The frames are those of [`dynamics`].
#![warn(missing_docs)]

pub mod aim;
pub mod airframe;
pub mod arming;
pub mod atmosphere;
pub mod burn;
pub mod check;
pub mod controller;
pub mod descent;
pub mod dynamics;
pub mod estimator;
pub mod fins;
pub mod gate;
pub mod ignition;
mod memory;
pub mod mission;
pub mod motor_estimate;
pub mod motors;
pub mod nmpc;
pub mod phase;
pub mod pilot;
pub mod powered;
pub mod profile;
pub mod rigid;
pub mod site;
pub mod stabiliser;
pub mod thrust_curve;
pub mod thrust_estimate;
pub mod verdict;
pub mod vertical;
