//! Interfaces of the flight computer, simulated or real: its links, its log, and the loop that
//! steps it on a board.
//!
//! * [`link`]: the vehicle's end of MAVLink.
//! * [`log`]: flights as log records, and back, bit for bit.
//! * [`board`]: the interface that a board implements, and the loop that flies it.
//!
//! It is pure, and needs no operating system.
#![cfg_attr(not(test), no_std)]

extern crate alloc;

pub mod board;
pub mod link;
pub mod log;
