//! Flies one flight of a campaign, by its number, and writes its log.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use onboard_sim::row::{COLUMNS, Row};
use onboard_sim::tally::Tally;
use protocol::log::record::Record;
use protocol::program::Exit;
use serde_json::Value;
use sim::recipe::Recipe;
use sim::wire::record::{self, LastFrame};

use super::logging;

/// Flies it and prints its row, one column on each line.
///
/// Exit code 0 if the vehicle stands undamaged; otherwise 3.
pub(super) fn fly(recipe: &Recipe, number: u64, log: Option<&Path>) -> anyhow::Result<Exit> {
    let mut tally = Tally::new(recipe, number)?;
    let log = log.map(|path| fly_logged(recipe, number, &mut tally, path)).transpose()?;
    if log.is_none() {
        while tally.step() {}
    }
    let row = tally.row();
    let mut stdout = std::io::stdout().lock();
    print_row(&row, &mut stdout)?;
    if let Some(path) = log {
        writeln!(stdout, "log {}", path.display())?;
    }
    Ok(Exit::of(row.stands && !row.ignition_outside_gate))
}

fn print_row(row: &Row, out: &mut impl std::io::Write) -> std::io::Result<()> {
    COLUMNS.iter().try_for_each(|column| {
        let name = column.name;
        match (column.value)(row) {
            Value::Null => writeln!(out, "{name:<32}-"),
            Value::String(word) => writeln!(out, "{name:<32}{word}"),
            Value::Number(real) if real.is_f64() => {
                writeln!(out, "{name:<32}{:.4}", real.as_f64().unwrap_or(f64::NAN))
            }
            other => writeln!(out, "{name:<32}{other}"),
        }
    })
}

fn fly_logged(recipe: &Recipe, number: u64, tally: &mut Tally, path: &Path) -> anyhow::Result<PathBuf> {
    let recorder = logging(path, &record::campaign_header(recipe, number))?;
    recorder.record(Record::ComputerStart(Box::new(record::start(tally.flight().computer()))), 0);
    let mut last = LastFrame::default();
    let mut phase = tally.flight().computer().mode().phase;
    let mut goes_on = true;
    while goes_on {
        goes_on = tally.step_watched(&mut last);
        let flight = tally.flight();
        let time_ns = record::time_ns(flight);
        for record in record::frame_and_phase(flight, &mut last, phase) {
            recorder.record(record, time_ns);
        }
        phase = flight.computer().mode().phase;
    }
    let flight = tally.flight();
    if let Some(verdict) = record::verdict(flight) {
        recorder.record(Record::LandingVerdict(Box::new(verdict)), record::time_ns(flight));
    }
    recorder.finish().context("the flight is over, but its log is incomplete")
}
