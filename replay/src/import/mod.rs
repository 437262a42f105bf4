//! Converts a ground station's `.tlog` to a flight log that has telemetry only.
//!
//! The frames are kept whole. The messages of the dialect are also decoded as a ground station would have decoded them,
//! so that a flight without its own log can still be described, compared and reported. There are no ticks, so nothing
//! can be re-executed: the log gets the grade telemetry-only.

mod fold;
mod tlog;

pub use tlog::{ImportError, ImportProgress, ImportedTlog, import_tlog};
