//! Runs one simulated flight with its clock, its MAVLink links and its log.
//!
//! The flight computer is the crate `flight`; the simulated flight around it is the crate `sim`. In reading order:
//!
//! * [`fly`]: the run loop with clock, links and log.
//! * [`vehicle`]: the simulated vehicle as run loop, radio and log see it. Pure.
//! * [`endpoint`]: the vehicle's end of MAVLink, frames in and frames out, within a radio's budget. Pure.
//! * [`commands`]: translates MAVLink commands to requests for the vehicle. Pure.
//! * [`stations`]: how well the vehicle hears each ground station. Pure.
//! * [`telemetry`] and [`streams`]: the vehicle's state as MAVLink messages, and their rates. Pure.
//! * [`parameters`]: values that a ground station may read by name, and the few that it may set. Pure.
//! * [`hil`]: hardware in the loop: a world and a flight computer as two processes.
//! * [`solve_times`]: statistics of the controller's solve times.

pub mod commands;
pub mod endpoint;
pub mod fly;
pub mod hil;
pub mod parameters;
pub mod solve_times;
pub mod stations;
pub mod streams;
pub mod telemetry;
pub mod vehicle;
