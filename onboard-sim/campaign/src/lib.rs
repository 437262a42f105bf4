//! Flights from apogee to touchdown by the thousand: drawn, flown, judged and counted.
//!
//! * [`dispersion`]: what is uncertain about a flight and by how much, as data.
//! * [`draw`]: one flight's truth from a seed and its number.
//! * [`fault`]: what breaks in a flight, when, and what is expected then.
//! * [`baseline`], [`timing`]: simpler controllers, to be beaten, and the height they light at.
//! * [`fly`]: one flight, from apogee until it lies still.
//! * [`outcome`]: what became of it, judged twice.
//! * [`order`], [`sortie`], [`row`]: what a campaign flies, one flight of it, and that flight in a table.
//! * [`run`], [`store`], [`table`]: many flights on several threads, and where their rows are kept.
//! * [`statistics`], [`summary`], [`picture`], [`results`]: what a thousand rows say.
//!
//! A flight is a function of the order and its number, so a campaign can be cut into shards, stopped, gone on with and
//! flown on any number of threads with the same results.
#![warn(missing_docs)]

pub mod baseline;
mod braking;
pub mod dispersion;
pub mod draw;
pub mod fault;
pub mod fly;
pub mod order;
pub mod outcome;
pub mod picture;
pub mod results;
pub mod row;
pub mod run;
pub mod sortie;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod table;
pub mod timing;
