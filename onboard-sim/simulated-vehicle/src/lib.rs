//! Runs one simulated flight with its clock, its MAVLink links and its log.
//!
//! The flight computer is the crate `flight`; the simulated flight around it is the crate `sim`. In reading order:
//!
//! * [`fly`]: the run loop with clock, links and log.
//! * [`vehicle`]: the simulated vehicle as run loop, radio and log see it. Pure.
//! * [`endpoint`]: a frame of the simulated vehicle and of its end of MAVLink (`vehicle_link`, which a board has, too).
//! * [`solve_times`]: statistics of the controller's solve times.

pub mod endpoint;
pub mod fly;
pub mod solve_times;
pub mod vehicle;
