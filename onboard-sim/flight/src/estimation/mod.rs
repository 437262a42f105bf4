//! Estimates the rocket's state and the strength of its motor from the sensors.
//!
//! * [`estimator`] finds state and wind from the sensors.
//! * [`motor_estimate`] finds impulse, burn time and ignition of the motor.

pub mod estimator;
pub mod motor_estimate;
