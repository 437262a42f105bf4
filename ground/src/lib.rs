//! The ground station: what the crew sees, and what it may do.
//!
//! Three rooms keep apart what is known, what changes it, and what shows it:
//!
//! * [`model`]: everything known, as plain data; every value with the time it was received.
//! * [`update`]: one pure function from a message and the time to a changed model and the actions it
//!   wants (send, record, quit). Every decision of the ground is here, none reads a clock.
//! * [`view`]: one pure function from a model and the time to a screen.
//!
//! [`replay`] is a recorded flight on the same screens; [`attach`] is what crosses the socket between a
//! station and screens of other processes.
//!
//! Around them, [`app`] does what they may not: terminal, links, log file, clock, signals. [`demo`] runs
//! the embedded simulator, [`cli`] reads the command line, [`exit`] decides the exit code.

pub mod app;
pub mod attach;
pub mod cli;
pub mod config;
pub mod demo;
pub mod exit;
pub mod key;
pub mod limits;
pub mod model;
pub mod replay;
pub mod update;
pub mod view;
