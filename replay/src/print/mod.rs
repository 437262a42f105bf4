//! Prints reports as text for people, as JSON for programs and as JUnit XML for build servers.
//!
//! Control characters are removed from the text of a log first, because a log may come from anywhere.

mod audit;
mod compare;
mod evaluate;
mod fit;
mod gate;
mod info;
mod junit;
mod learn;
mod recover;
mod refly;
mod sweep;
mod tick;
mod verdicts;
mod verify;

pub use audit::print_audit;
pub use compare::{compare_cases, print_compare};
pub use evaluate::{print_evaluate, print_evaluate_csv};
pub use fit::{FitReport, print_fit};
pub use gate::{GateReport, gate_cases, print_gate};
pub use info::print_info;
pub use junit::{JunitCase, JunitOutcome, print_junit};
pub use learn::print_learn;
pub use recover::print_recovery;
pub use refly::print_refly;
pub use sweep::{print_bisect, print_sweep, print_sweep_csv};
pub use tick::print_tick;
pub use verify::{print_verify, verify_case};

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

/// Text from a log, without control characters.
fn shown(text: &str) -> String {
    protocol::text::printable(text.as_bytes())
}

/// `1 tick`, `2 ticks`.
fn counted(count: u64, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}
