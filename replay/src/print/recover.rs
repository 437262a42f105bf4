//! Prints a recovery for people.

use std::io::{self, Write};

use super::{counted, shown};
use crate::recover::Recovery;

/// Writes what was recovered and what is lost as text.
///
/// # Errors
/// The output failed.
pub fn print_recovery(recovery: &Recovery, output: &mut impl Write) -> io::Result<()> {
    let kept_s = recovery.kept_s.map(|kept_s| format!(" over {kept_s:.3} s")).unwrap_or_default();
    writeln!(
        output,
        "{}: kept {} in {}{kept_s}, {} about the log; written to {}",
        shown(&recovery.input),
        counted(recovery.messages, "message"),
        counted(recovery.chunks, "chunk"),
        counted(recovery.records_about, "record"),
        recovery.output.display()
    )?;
    for lost in &recovery.lost {
        let span = lost.span_s.map_or_else(
            || "of unknown time".to_owned(),
            |(from, until)| format!("{from:.3} to {until:.3} s after the first message"),
        );
        writeln!(
            output,
            "lost {} from byte {}, {span}: {}",
            counted(lost.bytes, "byte"),
            lost.from_byte,
            shown(&lost.reason)
        )?;
    }
    if recovery.was_whole() {
        return writeln!(output, "the log was whole: nothing is lost");
    }
    if let Some(fault) = recovery.fault() {
        writeln!(output, "the log was DAMAGED: {fault}; the recovered log says so, too")?;
    }
    Ok(())
}
