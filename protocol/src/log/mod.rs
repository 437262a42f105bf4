//! Writes and reads the flight log: an MCAP file of raw frames, controller ticks, simulated truth,
//! telemetry, operator actions and events.
//!
//! The format is MCAP (<https://mcap.dev/spec>). The schemas are those of `crate::records` and,
//! where one fits, those of Foxglove. [`SCHEMA_VERSION`](record::SCHEMA_VERSION) is the version of
//! a log's contents. Records are flushed so often that a killed process loses at most a fraction of
//! a second ([`recorder`]).

pub mod reader;
pub mod record;
pub mod recorder;
pub mod tlog;
pub mod writer;

pub use crate::records::{
    DESCRIPTORS_COMPUTER_V1, DESCRIPTORS_FLIGHT_V1, DESCRIPTORS_V1, computer_v1, flight_v1, v1,
};

/// Identifies the build that wrote a log.
pub mod build {
    use std::collections::BTreeMap;

    /// Returns version, commit, compiler, target and hash of the lock file of this build, as every
    /// log contains them.
    pub fn build_info() -> BTreeMap<String, String> {
        [
            ("version", env!("CARGO_PKG_VERSION")),
            ("git_commit", env!("TOUCHDOWN_GIT_COMMIT")),
            ("rustc", env!("TOUCHDOWN_RUSTC")),
            ("target", env!("TOUCHDOWN_TARGET")),
            ("target_features", env!("TOUCHDOWN_TARGET_FEATURES")),
            ("lock_sha256", env!("TOUCHDOWN_LOCK_SHA256")),
            ("profile", if cfg!(debug_assertions) { "debug" } else { "release" }),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .collect()
    }
}
