//! Converts flights into log records and back, bit for bit.
//!
//! The flight code is independent of the log format, and the log of the flight code. Programs that
//! write or replay a log use this.
//!
//! * [`frame`]: the flight computer's frames.
//! * [`again`]: the flight computer of a log, run again on these frames.
//! * [`logged`]: its types and their records.

pub mod again;
pub mod frame;
pub mod logged;
