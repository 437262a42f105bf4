//! Decides where to steer, when to light the motor, and how to land.
//!
//! * [`descent`] steers by the fins before ignition.
//! * [`vertical`] computes the band of heights from which a landing exists, [`ignition`] when to light the motor.
//! * [`powered`] plans and flies the landing burn.
//! * [`baseline`]: simpler laws, for comparison.

pub mod baseline;
pub mod descent;
pub mod ignition;
pub mod powered;
pub mod vertical;
