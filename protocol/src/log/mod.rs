//! Writes and reads the flight log: an MCAP file of raw frames, controller ticks, simulated truth, telemetry,
//! operator actions and events.
//!
//! The format is MCAP (<https://mcap.dev/spec>). The schemas are those of `log_records` and, where one fits,
//! Foxglove's own.
//! [`SCHEMA_VERSION`](record::SCHEMA_VERSION) is the version of a log's contents. Records are flushed so often that a
//! killed process loses at most a fraction of a second ([`recorder`]).

pub mod build;
pub mod reader;
pub mod record;
pub mod recorder;
pub mod tlog;
pub mod writer;

pub use log_records::{
    DESCRIPTORS_COMPUTER_V1, DESCRIPTORS_FLIGHT_V1, DESCRIPTORS_V1, computer_v1, flight_v1, v1,
};
