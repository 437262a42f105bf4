//! Writes a flight as one HTML page with its pictures inside, without network access, whole without
//! its script.
//!
//! The first screen summarises the flight: verdict, findings, limits, moments, height and place.
//! Then come burn, fall, sensors and estimator, solver, battery, link, mission, events, and how
//! complete the log is. What the log lacks is named at the end. The script has one time for all
//! pictures, and the vehicle at that time.

mod chart;
mod html;
mod section;
mod track;

use std::path::{Path, PathBuf};

use anyhow::Result;
use protocol::program::Exit;
use track::Flight;

use crate::cli::answer;
use crate::info::{Completeness, described};
use crate::log::{Recording, RecordingError};
use crate::output::NewFile;

/// A flight's page.
#[derive(Debug, Clone)]
pub struct Report {
    /// The log.
    pub name: String,
    /// The page.
    pub html: String,
    /// Whether the log is incomplete; the page says so, too.
    pub completeness: Completeness,
}

/// Builds the page of a log file.
///
/// # Errors
/// The file is not a flight log, cannot be read or is longer than any flight. Damage is part of the
/// page.
pub fn report(path: &Path) -> Result<Report, RecordingError> {
    let recording = Recording::open_from_power_up(path)?;
    let mut info = described(path)?;
    // The date says it.
    info.run.remove("start_unix_ns");
    // The map shows it.
    info.run.remove(sim::wire::field::RUN_FACT);
    let flight = Flight::of(recording, &mut info);
    let html = html::page(&flight, &info, &section::all(&flight, &info));
    Ok(Report { name: info.file, html, completeness: info.completeness })
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The page to write, or - for standard output; the log's name with .html if left out.
    #[arg(long, short, alias = "output", value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        use std::io::Write as _;
        let page = report(&self.file)?;
        let path = self.out.unwrap_or_else(|| self.file.with_extension("html"));
        let html = page.html.as_bytes();
        if path.as_os_str() == "-" {
            answer(|output| output.write_all(html))?;
        } else {
            let path = NewFile::create(&path)?.fill(|file| file.write_all(html))?;
            answer(|output| writeln!(output, "{}", path.display()))?;
        }
        page.completeness.warn(&page.name);
        Ok(Exit::Yes)
    }
}
