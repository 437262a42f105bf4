//! Runs one simulated flight with its clock, its MAVLink links and its log.
//!
//! * [`field`]: the lines of a mission's field.
//! * [`fly`]: the run loop with clock, links and log.
//! * [`vehicle`]: the simulated vehicle as run loop, radio and log see it. Pure.
//! * [`endpoint`]: a frame of the simulated vehicle and of its end of MAVLink (`avionics::link`,
//!   which a board has, too).
//! * [`record`]: a flight as log records, with the truth.
//! * [`solve_times`]: statistics of the controller's solve times.

pub mod endpoint;
pub mod field;
pub mod fly;
pub mod record;
pub mod solve_times;
pub mod vehicle;
