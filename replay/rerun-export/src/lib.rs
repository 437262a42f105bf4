//! Exports flight logs as recordings for the Rerun viewer (<https://rerun.io>).
//!
//! The viewer opens a log by itself: its import of MCAP makes series of every field, a text log of
//! the events and a transform of `/tf`. Here is what it cannot know: the [`shape`](mod@shape) of
//! the vehicle that moves there, the pad, the path that was flown, a [`layout`], and a second
//! flight [`beside`](BESIDE) the first, on the same clock.
//!
//! This is a separate crate because Rerun costs more to compile than everything else here together.

mod export;
mod layout;
mod shape;

pub use export::{BESIDE, ExportError, Exported, FLIGHT_TIME, export};
pub use layout::{PLOTS, Plot, component};
