//! The vehicle's end of MAVLink: its messages and their rates, and the handling of requests from
//! ground stations.
//!
//! It is pure: frames, times and the vehicle are arguments. A simulated vehicle and
//! a board's program use the same code.
//!
//! * [`vehicle`]: a vehicle as its links see it, at one instant.
//! * [`endpoint`]: frames in and frames out, within a radio's budget.
//! * [`commands`]: translates MAVLink commands to requests for the vehicle.
//! * [`stations`]: the uplink quality of each ground station.
//! * [`telemetry`] and [`streams`]: that state as MAVLink messages, and their rates.
//! * [`parameters`]: values that a ground station may read by name, and the few that it may set.

pub mod commands;
pub mod endpoint;
pub mod parameters;
pub mod stations;
pub mod streams;
pub mod telemetry;
pub mod vehicle;
