//! A `.tlog` of a ground station as a flight log, telemetry only.
//!
//! The frames are kept whole; what the dialect's messages tell is decoded beside them as a ground station would have
//! known it, so that a flight without its own log can still be described, compared and reported. There are no ticks,
//! so nothing can be re-executed: the log is graded telemetry-only.

mod fold;
mod tlog;

pub use tlog::{ImportError, ImportProgress, ImportedTlog, import_tlog};
