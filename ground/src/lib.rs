//! The terminal ground station: shows a flight, and lets the crew arm, start and abort it.
//!
//! The modules in the order in which to read them:
//!
//! 1. [`model`]: everything that the ground knows, as plain data; every received value carries its
//!    time.
//! 2. [`update`]: every decision. One pure function takes a message and the time, changes the
//!    model, and returns actions for the run loop (send, record, quit).
//! 3. [`view`]: draws the screen. One pure function from the model and the time to a frame.
//! 4. [`app`]: the run loops, which do what the other modules may not: terminal, links, log, clock,
//!    signals.
//! 5. [`attach`]: the messages between a station and screens in other processes.
//! 6. [`replay`]: plays a recorded flight through the same `update` on the same screens.
//! 7. [`demo`]: runs the embedded simulator for the demonstration.
//! 8. [`cli`] reads the command line, [`config`] the settings file; [`key`] names the keys that
//!    have a meaning, and [`exit`] decides the exit code.
//!
//! Imports go one way: `app` -> `update` -> `model`, and `app` -> `view` -> `model`.

pub mod app;
pub mod attach;
pub mod cli;
pub mod config;
pub mod demo;
pub mod exit;
pub mod key;
pub mod model;
pub mod replay;
pub mod update;
pub mod view;
