//! Tests the export: logs are exported and read back with Rerun's own decoder.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod command_line;
mod content;
mod files;
#[path = "../../../tests/replay/simulated.rs"]
#[expect(dead_code, reason = "other tests fly more")]
mod flown;
mod logs;
mod outside_reader;
mod read_back;
#[path = "../../../tests/replay/station.rs"]
mod station;
