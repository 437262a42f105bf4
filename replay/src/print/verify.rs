//! A verification, for people.

use std::io::{self, Write};

use super::{counted, shown};
use crate::verify::{Divergence, FieldDifference, Outcome, VerifyReport};

/// Fields of the first diverged tick that are shown.
const FIELDS_SHOWN: usize = 5;

/// Writes a verification as text.
///
/// # Errors
/// The output failed.
pub fn print_verify(report: &VerifyReport, output: &mut impl Write) -> io::Result<()> {
    let file = shown(&report.file);
    let VerifyReport { ticks_identical, ticks_compared, ticks_recorded, .. } = report;
    match report.outcome {
        Outcome::Identical => {
            writeln!(output, "{file}: {ticks_identical} of {ticks_compared} ticks identical")?;
        }
        Outcome::IdenticalReadablePart => {
            writeln!(
                output,
                "{file}: {ticks_identical} of {ticks_compared} ticks identical of the readable part"
            )?;
        }
        Outcome::Diverged => {
            let VerifyReport { ticks_different, fields_different, .. } = report;
            let fields = counted(*fields_different, "field");
            writeln!(
                output,
                "{file}: DIVERGED: {ticks_different} of {ticks_compared} ticks differ, in {fields}"
            )?;
        }
        Outcome::NotReplayable if *ticks_compared == 0 => writeln!(output, "{file}: not replayable")?,
        Outcome::NotReplayable => writeln!(
            output,
            "{file}: not replayable as a whole: the first {ticks_identical} of {ticks_recorded} ticks are identical"
        )?,
    }
    if let Some(first) = &report.first_divergence {
        print_divergence(first, output)?;
    }
    if let Some(obstacle) = &report.obstacle {
        writeln!(output, "not every tick was compared: {}", shown(&obstacle.to_string()))?;
    }
    Ok(())
}

fn print_divergence(first: &Divergence, output: &mut impl Write) -> io::Result<()> {
    writeln!(
        output,
        "first at tick {} (t = {:.3} s, {}), {}:",
        first.tick,
        first.time_s,
        first.phase,
        counted(first.fields_different as u64, "field")
    )?;
    for field in first.fields.iter().take(FIELDS_SHOWN) {
        print_field(field, output)?;
    }
    if first.fields_different > FIELDS_SHOWN {
        writeln!(output, "  and {} more", counted((first.fields_different - FIELDS_SHOWN) as u64, "field"))?;
    }
    Ok(())
}

fn print_field(field: &FieldDifference, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "  {}", field.path)?;
    for (name, value) in [("recorded", &field.recorded), ("recomputed", &field.recomputed)] {
        let bits = value.bits().map(|bits| format!("0x{bits:016x}")).unwrap_or_default();
        writeln!(output, "    {}", format!("{name:<10}  {:<24}  {bits}", value.to_string()).trim_end())?;
    }
    if let Some(ulps) = field.ulps {
        writeln!(output, "    apart       {ulps} ULP")?;
    }
    Ok(())
}
