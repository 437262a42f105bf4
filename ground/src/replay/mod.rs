//! Plays a recorded flight on the same screens.
//!
//! [`recording`] reads a log; [`player`] turns its events into messages for the same `update` that handles live
//! frames. Nothing is sent or recorded.

mod log_events;
pub mod player;
pub mod recording;
