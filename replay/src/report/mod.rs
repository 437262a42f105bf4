//! A flight as one page: HTML with its pictures inside, no script and nothing from the network.
//!
//! The verdict stands first, each value against its limit; then what led to it: phases, path, states, input, tracking,
//! saturation, solver, predictions, thrust, estimator, link, and how complete the log is. A log that lacks something
//! has the section say so. A flight from apogee is seen in the plane of its landing.

mod apogee;
mod axis;
mod chart;
mod page;
mod section;
mod track;

use std::path::Path;

use crate::info::{Completeness, Info, info};
use crate::log::{Recording, RecordingError};
use track::{Flight, plans_of};

/// A flight's page.
#[derive(Debug, Clone)]
pub struct Report {
    /// The log.
    pub name: String,
    /// The page.
    pub html: String,
    /// Whether anything of the log is missing; the page says so too.
    pub completeness: Completeness,
}

/// Builds the page of a log file.
///
/// # Errors
/// The file is not a flight log, cannot be read or is longer than any flight. Damage is part of the page.
pub fn report(path: &Path) -> Result<Report, RecordingError> {
    let recording = Recording::open(path)?;
    let info: Info = info(path)?;
    let flight = if recording.is_from_apogee() {
        apogee::flight(recording)
    } else {
        Flight::new(recording, plans_of(path)?)
    };
    let html = page::page(&flight, &info, &section::all(&flight, &info));
    Ok(Report { name: info.file, html, completeness: info.completeness })
}
