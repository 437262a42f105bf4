//! This crate is the flight software: it turns sensor samples into commands, and does nothing else.
//!
//! The crate is pure: state, inputs and time are arguments, and the same arguments give the same bits on any machine.
//! It uses no clock, socket, file, thread or random source, and it needs no operating system. So a log of the inputs
//! is enough to fly a flight again.
//!
//! The modules, in reading order:
//!
//! * [`vehicle`] describes the rocket, its motor, the air and a mission, as data.
//! * [`estimation`] estimates from the sensors where the rocket is and how strong its motor is.
//! * [`guidance`] decides where to steer, when to light the motor, and how to land.
//! * [`control`] turns a wanted direction into commands for gimbal and fins.
//! * [`rules`] decides what the vehicle may do: phases, checks and limits.
//! * [`computer`] is the flight computer: one frame, from sensor samples to commands.
//!
//! The crate `vehicles` reads the files that describe a vehicle, and the crate [`nmpc`] solves the landing problem.
//!
//! A chosen number says what it decides: `Halved and doubled: 132, 144` are the landings of 160 `real` flights of mk2 (seed 78)
//! with half and with twice its value. 144 land with all numbers as they are; differences of up to 5 may be chance.
//!
//! Units are SI and radians; names carry units and frames. The frames are those of [`nmpc::dynamics`] in the plane and
//! of [`vehicle::rigid`] in space.
#![cfg_attr(not(test), no_std)]

extern crate alloc;
#[cfg(test)]
extern crate self as flight;

pub mod vehicle;

pub mod estimation;

pub mod guidance;

pub mod control;

pub mod rules;

pub mod computer;

// The unit tests fly the built-in vehicles. They cannot use the crate `vehicles`, because that crate is linked with
// another build of `flight` than the one under test.
#[cfg(test)]
#[path = "../../vehicles/src/lib.rs"]
#[allow(
    dead_code,
    unreachable_pub,
    unused_imports,
    reason = "a crate's public items, of which the unit tests use some"
)]
mod vehicles;
