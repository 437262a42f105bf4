//! Reports as text for people and as JSON for programs.
//!
//! Text from a log is made fit for a terminal first: a log may come from anywhere.

mod info;
mod verify;

pub use info::print_info;
pub use verify::print_verify;

use std::io::{self, Write};

use serde::Serialize;

/// Writes any report as JSON.
///
/// # Errors
/// The output failed.
pub fn print_json(report: &impl Serialize, output: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *output, report)?;
    writeln!(output)
}

/// Text from a log, made fit for a terminal.
fn shown(text: &str) -> String {
    protocol::text::printable(text.as_bytes())
}

/// `1 tick`, `2 ticks`.
fn counted(count: u64, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}
