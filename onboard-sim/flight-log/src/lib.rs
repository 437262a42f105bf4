//! Converts flights into log records and back, bit for bit.
//!
//! The flight code does not know the log, and the log does not know the flight code. Programs that write or replay a
//! log use this crate.
//!
//! * [`frame`]: the flight computer's frames.
//! * [`again`]: the flight computer of a log, run again on these frames.
//! * [`logged`]: its types and their records.
//! * [`sortie`]: a simulated flight as records, with the truth.
//!
//! Without the feature `simulated` (the last one) the crate needs no operating system.
#![cfg_attr(not(any(test, feature = "simulated")), no_std)]

extern crate alloc;

pub mod again;
pub mod frame;
pub mod logged;
#[cfg(feature = "simulated")]
pub mod sortie;
