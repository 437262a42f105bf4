//! Turns wanted directions into commands for gimbal and fins.
//!
//! * [`aim`] points the rocket by its gimbal.
//! * [`fins`] finds the four openings for wanted moments and drag.

pub mod aim;
pub mod fins;
