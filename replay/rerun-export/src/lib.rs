//! Flight logs as recordings for the Rerun viewer (<https://rerun.io>): the flight in space, what the controller
//! planned at every tick, plots with their limits, and the events.
//!
//! * [`export`]: a log into a recording; [`export_file`] into an `.rrd` file.
//! * [`pose`]: the planar state in the viewer's space.
//! * [`survey`]: what has to be known of a log before its first record is exported.
//!
//! What the recording holds, with its entity paths and units, is listed in [`entity`]. Its two timelines are
//! `flight_time` (a duration, vehicle time) and `tick` (a sequence, the controller's tick that was running).
//!
//! This is a crate of its own because Rerun costs more to compile than everything else here together.
#![warn(missing_docs)]

mod again;
pub mod entity;
mod error;
pub mod export;
mod file;
mod flown;
mod identity;
mod layout;
mod plot_list;
mod plots;
pub mod pose;
mod rrd;
mod scene;
mod shape;
pub mod survey;
mod times;
mod words;

pub use error::ExportError;
pub use export::Exported;
pub use file::{Overwrite, export_file};
