//! Flights from apogee to touchdown by the thousand: drawn, flown, judged and counted.
//!
//! * [`dispersion`]: what is uncertain about a flight and by how much, as data.
//! * [`draw`]: one flight's truth from a seed and its number.
//! * [`fly`]: one flight, from apogee until it lies still.
//! * [`outcome`]: what became of it, judged twice.
//!
//! Pure: a flight is a function of mission, dispersion, seed and number, so a campaign can be cut into shards, stopped,
//! gone on with and flown on any number of threads with the same results.
#![warn(missing_docs)]

pub mod dispersion;
pub mod draw;
pub mod fly;
pub mod outcome;
