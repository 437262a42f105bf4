//! Exports flight logs as recordings for the Rerun viewer (<https://rerun.io>): the flight in space, the paths that
//! its computer planned, plots with their limits, and the events.
//!
//! In reading order:
//!
//! * [`export`]: writes a log into a recording; [`export_file`] writes it into an `.rrd` file.
//! * [`follow_file`]: the same while the log is being written, into a growing file or a running viewer.
//! * [`survey`]: reads the log once before the export, for facts that the first record already needs.
//! * [`entity`]: the entity paths of the recording, with their units.
//! * [`pose`]: converts states to the viewer's space.
//!
//! The recording has two timelines: `flight_time` (a duration, vehicle time) and `tick` (a sequence, the number of the
//! flight computer's frame).
//!
//! This is a separate crate because Rerun costs more to compile than everything else here together.

mod again;
pub mod entity;
mod error;
pub mod export;
mod file;
mod flown;
mod follow;
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
mod viewer;
mod words;

pub use error::ExportError;
pub use export::Exported;
pub use file::{Overwrite, export_file, export_file_with, send_file};
pub use follow::{Growing, Towards, follow_file};
pub use viewer::DEFAULT_ADDRESS;
