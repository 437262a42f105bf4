//! Hardware in the loop: what the wire between a simulated world and a flight computer carries, and who waits for whom.
//!
//! The crate is pure and needs no operating system: frames and times are arguments. It knows no message and no link.
//!
//! * [`readings`]: everything that a flight computer is told in a frame.
//! * [`carried`]: readings and commands in the units of the wire, and how they are narrowed to them.
//! * [`start`]: what begins a flight.
//! * [`computer`]: the computer's end, which decides for each frame whether it is flown.
//! * [`lockstep`]: the world's end, waiting for each answer.
//! * [`real_time`]: the world's end, waiting for nothing.
#![cfg_attr(not(test), no_std)]

pub mod carried;
pub mod computer;
pub mod lockstep;
pub mod readings;
pub mod real_time;
pub mod start;
