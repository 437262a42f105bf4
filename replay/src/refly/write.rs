//! Writes a re-flown flight as a log.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::writer::{LogHeader, LogWriteError};

use super::{Law, ReflownFlight, ReflyOptions, ReflyReport};
use crate::controller::{REFLOWN_AT, REFLOWN_BY};
use crate::log::{NewLog, NewLogError, Recording};
use crate::output::Destination;

/// Why a log could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReflyLogError {
    /// The file exists or cannot be created.
    #[error("{}: cannot be created", path.display())]
    Create {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// Writing failed.
    #[error("{}: cannot be written", path.display())]
    Write {
        path: PathBuf,
        /// Error from the writer.
        source: LogWriteError,
    },
}

/// Writes a re-flown flight as a log that every command accepts.
///
/// # Errors
/// The file exists and may not be replaced, or cannot be created or written.
pub fn write_log<'a>(
    destination: impl Into<Destination<'a>>,
    recording: &Recording,
    options: &ReflyOptions,
    report: &ReflyReport,
    flight: &ReflownFlight,
) -> Result<(), ReflyLogError> {
    let destination = destination.into();
    let path = destination.path;
    let failed = |error| match error {
        NewLogError::Create(source) => ReflyLogError::Create { path: path.to_owned(), source },
        NewLogError::Write(source) => ReflyLogError::Write { path: path.to_owned(), source },
    };
    let header = header(recording, options, report, flight);
    let mut log = NewLog::create(destination, Path::new(&recording.name), &header).map_err(failed)?;
    for (time_s, record) in records(report, flight) {
        log.write(&record, (time_s.max(0.0) * 1e9) as u64).map_err(failed)?;
    }
    log.finish().map_err(failed)
}

fn header(
    recording: &Recording,
    options: &ReflyOptions,
    report: &ReflyReport,
    flight: &ReflownFlight,
) -> LogHeader {
    let mut run: BTreeMap<String, String> = recording.head.run.clone();
    run.insert("reflown_from".to_owned(), report.file.clone());
    run.insert(REFLOWN_AT.to_owned(), report.start.tick.to_string());
    run.insert("reflown_with".to_owned(), report.settings.join(" "));
    if report.law != Law::AsRecorded {
        run.insert(REFLOWN_BY.to_owned(), report.law.name().to_owned());
    }
    run.extend(flight.run.clone());
    run.insert("plant_settings".to_owned(), report.plant_settings.join(" "));
    run.retain(|_, fact| !fact.is_empty());
    if let Some(seed) = options.seed {
        run.insert("seed".to_owned(), seed.to_string());
        let before = recording.head.run.get("seed").map_or("not recorded", String::as_str);
        run.insert("reflown_instead_of_seed".to_owned(), before.to_owned());
    }
    let start = recording.head.run.get("start_unix_ns").and_then(|text| text.parse().ok());
    LogHeader {
        writer: "replay".to_owned(),
        start_unix_ns: start.unwrap_or(0),
        run,
        // It keeps its mission; its settings change in flight.
        profile_toml: recording.profile_toml().ok().map(str::to_owned),
        scenario_toml: recording.head.scenario_toml.clone(),
    }
}

/// Every record with its vehicle time, s, in order.
fn records(report: &ReflyReport, flight: &ReflownFlight) -> Vec<(f64, Record)> {
    let mut records = flight.records.clone();
    let began = Event {
        level: EventLevel::Info,
        name: "replay".to_owned(),
        message: format!("flown again in simulation from tick {}", report.start.tick),
    };
    records.push((report.start.time_s, Record::Event(began)));
    let end_s = records.iter().map(|(time_s, _)| *time_s).fold(0.0, f64::max);
    records.extend(flight.verdict.clone().map(|verdict| (end_s, Record::LandingVerdict(Box::new(verdict)))));
    records.sort_by(|a, b| a.0.total_cmp(&b.0));
    records
}
