//! Good files are read into flight's types, and bad files give a helpful error.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod mission;
#[path = "../missions/mod.rs"]
mod missions;
mod mk3_parts;
mod motors;
mod thrust_curve;
