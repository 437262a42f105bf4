//! Decides where to steer, when to light the motor, and how to land.
//!
//! * [`descent`] steers by the fins before ignition.
//! * [`vertical`] computes the band of heights from which a landing exists, [`ignition`] when to light the motor.
//! * [`powered`] plans and flies the landing burn in space.
//! * [`landing`] poses a profile's landing problem, [`controller`] plans and flies it in the plane.
//! * [`stabiliser`] keeps the rocket upright when there is no plan.

pub mod baseline;
pub mod controller;
pub mod descent;
pub mod ignition;
pub mod landing;
pub mod powered;
pub mod stabiliser;
pub mod vertical;
