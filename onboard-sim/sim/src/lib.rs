//! This crate simulates one flight: a world, a flight computer, faults and random differences.
//!
//! But for `wire` it has no clock and no network. The live vehicle, a campaign and a replay all use
//! it, so all three fly the same flight.
//!
//! * [`world`]: the simulated truth.
//! * [`recipe`]: everything that a flight is made from.
//! * [`dispersion`]: which values of a flight are uncertain and by how much, as data.
//! * [`draw`]: the random values of one flight, from a seed and the flight's number.
//! * [`fault`]: faults of a flight with their times.
//! * [`sortie`]: the flight itself.
//! * `surroundings`: everything of it but its flight computer.
//! * [`outside`]: the input from the crew and the ground in one frame.
//! * [`outcome`]: how the flight ended, judged.
//! * [`wire`] (feature `wire`): the flight with its clock, its MAVLink links and its log.

pub mod dispersion;
pub mod draw;
pub mod fault;
pub mod outcome;
pub mod outside;
pub mod recipe;
pub mod sortie;
mod surroundings;
#[cfg(feature = "wire")]
pub mod wire;
pub mod world;
