//! Prints what a shadow has flagged, and which of its checks ran.

use std::io::{self, Write};

use serde::Serialize;

use crate::shadow::{Coverage, Flag, NOT_CARRIED};

/// What a shadow has found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShadowReport {
    /// The link or log.
    pub source: String,
    /// Frames of the vehicle that were heard.
    pub frames: u64,
    pub flags: Vec<Flag>,
    pub coverage: Vec<Coverage>,
    /// What no telemetry carries.
    pub not_carried: Vec<&'static str>,
    /// The log that was written, if one was.
    pub log: Option<String>,
}

impl ShadowReport {
    /// A report that lists what telemetry cannot carry.
    pub fn new(source: String, frames: u64, flags: Vec<Flag>, coverage: Vec<Coverage>) -> Self {
        Self { source, frames, flags, coverage, not_carried: NOT_CARRIED.to_vec(), log: None }
    }
}

/// Prints one flag, with the vehicle's time.
///
/// # Errors
/// The output failed.
pub fn print_flag(flag: &Flag, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "boot {:9.3} s  {flag}", flag.boot_s)
}

/// Prints the end of a report: how many flags, which checks ran, and what cannot be checked. The flags have been printed
/// already.
///
/// # Errors
/// The output failed.
pub fn print_shadow(report: &ShadowReport, output: &mut impl Write) -> io::Result<()> {
    let ShadowReport { source, frames, flags, coverage, not_carried, log } = report;
    let flagged = if flags.is_empty() {
        "nothing flagged".to_owned()
    } else {
        super::counted(flags.len() as u64, "flag")
    };
    writeln!(output, "{source}: {flagged} in {}", super::counted(*frames, "frame"))?;
    for Coverage { check, runs, words } in coverage {
        let ran = if *runs { "ran    " } else { "NOT RUN" };
        writeln!(output, "  {ran}  {:<15}  {words}", check.name())?;
    }
    writeln!(output, "not in telemetry:")?;
    for words in not_carried {
        writeln!(output, "  {words}")?;
    }
    match log {
        Some(log) => writeln!(output, "log: {log}"),
        None => Ok(()),
    }
}
