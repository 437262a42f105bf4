//! Writes a flight as one HTML page with its pictures inside, without scripts and without network access.
//!
//! The verdict comes first, each value against its limit; then what led to it: phases, path, states, input, tracking,
//! saturation, solver, predictions, thrust, estimator, link, and how complete the log is. If the log lacks something,
//! the section says so. A flight is shown in the plane of its landing.

mod axis;
mod chart;
mod html;
mod page;
mod section;
mod track;

use std::path::Path;

use crate::info::{Completeness, Info, info};
use crate::log::{Recording, RecordingError};
use track::Flight;

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
/// The file is not a flight log, cannot be read or is longer than any flight. Damage is part of the page.
pub fn report(path: &Path) -> Result<Report, RecordingError> {
    let (flight, info) = told(path)?;
    let html = page::page(&flight, &info, &section::all(&flight, &info));
    Ok(Report { name: info.file, html, completeness: info.completeness })
}

/// Builds the page of a log file, with the flight of another log in the same pictures behind its verdict.
///
/// # Errors
/// As [`report`], for either file.
pub fn report_with(path: &Path, with: &Path) -> Result<Report, RecordingError> {
    let ((flight, info), (other, others)) = (told(path)?, told(with)?);
    let mut sections = section::all(&flight, &info);
    let both = section::overlay::html([(&flight, &info), (&other, &others)]);
    sections.insert(1, section::Section { title: "Two flights", html: both });
    let html = page::page(&flight, &info, &sections);
    Ok(Report { name: info.file, html, completeness: info.completeness })
}

/// A flight and the description of its log.
fn told(path: &Path) -> Result<(Flight, Info), RecordingError> {
    let recording = Recording::open(path)?;
    let info: Info = info(path)?;
    let flight = Flight::of(recording);
    Ok((flight, info))
}
