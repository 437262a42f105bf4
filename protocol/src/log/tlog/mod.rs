//! Writes and reads `.tlog` files, the telemetry logs of other ground stations.
//!
//! Each entry is the time in microseconds since the Unix epoch (eight bytes, big-endian), followed by the raw frame.
//! MAVProxy's `mavtee` and `MAVExplorer`, Mission Planner and pymavlink's `mavlogfile` read it.

mod reader;
mod writer;

pub use reader::{TlogFrame, TlogReader, frame_length};
pub use writer::TlogWriter;
