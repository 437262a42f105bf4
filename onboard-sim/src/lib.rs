//! The guidance flying a simulated vehicle, and the vehicle's end of the radio.
//!
//! * [`plant`]: the simulated vehicle, which the controller never sees: planar motion, motor, servos, ground.
//! * [`scatter`]: seeded differences between the plant and what the controller believes.
//! * [`craft`]: what every simulated vehicle is to its run loop, its radio and its log.
//! * [`vehicle`]: the flight computer: phases, checks, controller ticks, around one plant. Pure.
//! * [`rocket`]: the flight computer from apogee, with its pad, in the world in space. Pure.
//! * [`pilot_log`]: a flight from apogee as log records.
//! * [`commands`]: what the radio may ask for and how it is answered. Pure.
//! * [`telemetry`], [`streams`] and [`endpoint`]: the vehicle as MAVLink messages, scheduled within a radio's
//!   budget. Pure.
//! * [`parameters`]: what a ground may read by name, and the little that it may set. Pure.
//! * [`landability`]: maps of where a landing exists.
//! * [`paper`]: the landing paper's experiments, its numbers beside ours.
//! * [`fly`]: the run loop: clock, links, log.
//! * [`from_apogee`]: a flight from apogee as the records of a log.
#![warn(missing_docs)]

pub mod commands;
pub mod craft;
pub mod endpoint;
pub mod fly;
pub mod from_apogee;
pub mod landability;
pub mod paper;
pub mod parameters;
pub mod pilot_log;
pub mod plant;
pub mod rocket;
pub mod scatter;
pub mod solve_times;
pub mod stations;
pub mod streams;
pub mod telemetry;
pub mod vehicle;
