//! A recorded flight on the same screens.
//!
//! [`film`] reads a log into frames with their times; [`player`] turns time into messages for the model:
//! the same `update` that takes a radio's frames takes a log's. Nothing is sent, nothing is recorded.

pub mod film;
mod footage;
pub mod player;
