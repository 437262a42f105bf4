//! One flight of a campaign, by its number.

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use campaign::fault::Expected;
use campaign::order::Order;
use campaign::row::{COLUMNS, Value};
use campaign::sortie::Sortie;

/// Flies it and prints its row, a column a line.
///
/// Exit code 0 if it did what the scenario expects, or without one if it landed within what the legs take; else 3.
pub(super) fn fly(
    order: &Order,
    number: u64,
    expected: Option<Expected>,
    log: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    anyhow::ensure!(log.is_none(), "no log yet");
    let mut sortie = Sortie::new(order, number)?;
    while sortie.step() {}
    let row = sortie.row();
    let mut stdout = std::io::stdout().lock();
    for column in COLUMNS {
        match (column.value)(&row) {
            Value::Maybe(None) => writeln!(stdout, "{:<32}", column.name)?,
            Value::Count(count) => writeln!(stdout, "{:<32}{count}", column.name)?,
            Value::Real(real) | Value::Maybe(Some(real)) => writeln!(stdout, "{:<32}{real:.4}", column.name)?,
            Value::Flag(flag) => writeln!(stdout, "{:<32}{flag}", column.name)?,
            Value::Word(word) => writeln!(stdout, "{:<32}{word}", column.name)?,
        }
    }
    let met = expected.unwrap_or(Expected::Land).met(&row);
    if let Some(expected) = expected {
        writeln!(stdout, "expected to {}: {}", expected.name(), if met { "it did" } else { "IT DID NOT" })?;
    }
    Ok(ExitCode::from(if met { 0 } else { 3 }))
}
