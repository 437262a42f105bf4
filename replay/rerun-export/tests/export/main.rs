//! Logs in, recordings out: flown by the real controller, exported, and read back with Rerun's own decoder.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod command_line;
mod content;
mod files;
mod logs;
mod read_back;
