//! The telemetry log that other ground stations write and read: `.tlog`.
//!
//! Microseconds since the Unix epoch (eight bytes, big-endian), then the raw frame; again and again. MAVProxy's
//! `mavtee` and `MAVExplorer`, Mission Planner and pymavlink's `mavlogfile` read it.

mod reader;
mod writer;

pub use reader::{TlogFrame, TlogReader, frame_length};
pub use writer::TlogWriter;
