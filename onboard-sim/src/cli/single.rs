//! One flight of a campaign, by its number, and its log.

use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Context as _;
use campaign::fault::Expected;
use campaign::order::Order;
use campaign::row::{COLUMNS, Row, Value};
use campaign::sortie::Sortie;
use onboard_sim::{from_apogee, pilot_log};
use protocol::log::record::Record;
use protocol::log::recorder::Recorder;

/// Flies it and prints its row, a column a line.
///
/// Exit code 0 if it did what the scenario expects, or without one if it landed within what the legs take; else 3.
pub(super) fn fly(
    order: &Order,
    number: u64,
    expected: Option<Expected>,
    log: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    let mut sortie = Sortie::new(order, number)?;
    match log {
        None => while sortie.step() {},
        Some(path) => fly_logged(order, number, &mut sortie, path)?,
    }
    let row = sortie.row();
    let mut stdout = std::io::stdout().lock();
    print_row(&row, &mut stdout)?;
    let met = expected.unwrap_or(Expected::Land).met(&row);
    if let Some(expected) = expected {
        writeln!(stdout, "expected to {}: {}", expected.name(), if met { "it did" } else { "IT DID NOT" })?;
    }
    if let Some(path) = log {
        writeln!(stdout, "log {}", path.display())?;
    }
    Ok(ExitCode::from(if met { 0 } else { 3 }))
}

fn print_row(row: &Row, out: &mut impl std::io::Write) -> std::io::Result<()> {
    for column in COLUMNS {
        let name = column.name;
        match (column.value)(row) {
            Value::Maybe(None) => writeln!(out, "{name:<32}-")?,
            Value::Count(count) => writeln!(out, "{name:<32}{count}")?,
            Value::Real(real) | Value::Maybe(Some(real)) => writeln!(out, "{name:<32}{real:.4}")?,
            Value::Flag(flag) => writeln!(out, "{name:<32}{flag}")?,
            Value::Word(word) => writeln!(out, "{name:<32}{word}")?,
        }
    }
    Ok(())
}

fn fly_logged(order: &Order, number: u64, sortie: &mut Sortie, path: &Path) -> anyhow::Result<()> {
    let recorder = Recorder::create(path, &from_apogee::header(order, number))?;
    recorder.record(pilot_log::start(sortie.flight()), 0);
    let mut phase = sortie.flight().pilot().mode().phase;
    loop {
        let goes_on = sortie.step();
        let flight = sortie.flight();
        let time_ns = from_apogee::time_ns(flight);
        for record in from_apogee::frame(flight, phase) {
            recorder.record(record, time_ns);
        }
        phase = flight.pilot().mode().phase;
        if !goes_on {
            break;
        }
    }
    let flight = sortie.flight();
    if let Some(verdict) = from_apogee::verdict(flight) {
        recorder.record(Record::LandingVerdict(Box::new(verdict)), from_apogee::time_ns(flight));
    }
    recorder.finish().context("the flight is over, but its log is not whole")?;
    Ok(())
}
