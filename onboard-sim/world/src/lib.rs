//! The simulated truth: a rigid rocket in wind, its actuators, its sensors and the ground.
//!
//! Pure like `flight`: time is a count of steps, chance is a seed, and the same arguments give the same bits on any
//! machine. The flight code sees of it only what `sensors` measures. Frames are those of [`flight::rigid`].
//!
//! * [`truth`]: how one true vehicle and its day differ from the data.
//! * [`fault`]: what can break in flight.
//! * [`world`]: everything together, one millisecond at a time.
//! * `body`, `aero`, `motor`, `servo`, `parachute`, `ground`: the parts, each on its own.
//! * [`sensors`]: what the flight computer is given of it all.
//! * [`wind`]: the mean wind over height and the gusts in it.
#![warn(missing_docs)]

mod aero;
mod body;
pub mod fault;
pub mod ground;
mod motor;
mod parachute;
pub mod sensors;
mod servo;
pub mod truth;
pub mod wind;
pub mod world;

pub use fault::Fault;
pub use ground::{Rest, RestOutcome, Touchdown};
pub use truth::Truth;
pub use world::{Actuators, World};

/// Length of one step, s.
pub const STEP_S: f64 = 1e-3;
