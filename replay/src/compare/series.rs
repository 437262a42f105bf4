//! The numbers of a log as signals over vehicle time.

use std::collections::BTreeMap;
use std::path::Path;

use super::Anchors;
use crate::info::VerdictFacts;
use crate::log::{Cut, Entry, FlightLog, Flights, LogError, RecordingError, Verdicts, heard_message};
use crate::table::{Cell, Kind, TableReader, TableShape};

/// Limit on the numbers held for one log; a flight of some minutes has a few hundred thousand.
const VALUES_MAX: usize = 20_000_000;

/// Begins the names of the tables of MAVLink messages.
const MESSAGES: &str = "mavlink_";
/// The vehicle's time in them, ms since power-up.
const TIME_BOOT_MS: &str = "time_boot_ms";

/// Columns that are not signals: times, record numbers, and durations measured on the wall clock.
const NO_SIGNALS: [&str; 10] = [
    TIME_BOOT_MS,
    "frame_sequence",
    "log_time_ns",
    "time_s",
    "input.time_s",
    "frame",
    "input.frame",
    "solve_time_s",
    "deadline_s",
    "state_digest",
];

/// Tables without signals. The ticks hold the same decisions, and logs of earlier releases, of campaigns and of
/// re-flown flights have only the ticks.
const NO_SIGNAL_TABLES: [&str; 2] = ["computer_start", "computer_frame"];

/// One signal.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Vehicle times in ascending order, s.
    pub times_s: Vec<f64>,
    pub values: Vec<f64>,
    /// Whether the values are whole numbers, which are held between samples.
    pub whole: bool,
}

impl Series {
    /// The value at a time; `None` more than half a microsecond outside the series.
    pub fn at(&self, time_s: f64) -> Option<f64> {
        const SAME_S: f64 = 5e-7;
        let behind = self.times_s.partition_point(|t| *t <= time_s + SAME_S);
        let before = behind.checked_sub(1)?;
        let (t0, v0) = (*self.times_s.get(before)?, *self.values.get(before)?);
        if self.whole || (time_s - t0).abs() <= SAME_S {
            let ended = behind == self.times_s.len() && time_s > t0 + SAME_S;
            return (!ended).then_some(v0);
        }
        let (t1, v1) = (*self.times_s.get(behind)?, *self.values.get(behind)?);
        let share = (time_s - t0) / (t1 - t0);
        Some(v0 + share * (v1 - v0))
    }
}

/// A flight as signals.
#[derive(Debug, Clone, Default)]
pub struct Flown {
    /// The log.
    pub name: String,
    /// The signals, by name.
    pub signals: BTreeMap<String, Series>,
    /// The numbers in MAVLink messages that carry the vehicle's time, over that time (since power-up).
    pub over_the_air: BTreeMap<String, Series>,
    /// The log has what the vehicle decided, not only what was heard of it.
    pub has_ticks: bool,
    /// Events to align on.
    pub anchors: Anchors,
    /// The landing verdict.
    pub verdict: Option<VerdictFacts>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Number of values left out because their times are earlier than the time before them.
    pub out_of_order: usize,
}

impl Flown {
    /// Whether only one of two logs has what the vehicle decided: then they are compared by what went over the air.
    pub(super) fn only_one_has_ticks(&self, other: &Self) -> bool {
        self.has_ticks != other.has_ticks
    }

    /// Reads a log file.
    ///
    /// # Errors
    /// The file is not a flight log, cannot be read, holds several flights or is longer than any flight.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut anchors = Anchors::default();
        let mut verdicts = Verdicts::default();
        let mut has_ticks = false;
        let mut log = FlightLog::open(path)?;
        let mut flights = Flights::default();
        while let Some(stamped) = log.next_entry()? {
            flights.note(&stamped.entry);
            let message = heard_message(log.channel(stamped.channel_id), &stamped);
            verdicts.note(&stamped, message.as_ref());
            anchors.note(&stamped.entry);
            has_ticks |= matches!(stamped.entry, Entry::PilotTick(_));
        }
        let verdict = verdicts.found().as_ref().map(VerdictFacts::found);
        let name = log.name().to_owned();
        if flights.flown() > 1 {
            return Err(RecordingError::SeveralFlights { name, flights: flights.flown() });
        }
        let damage = log.damage().map(ToString::to_string);
        anchors.touchdown_s = verdict.as_ref().map(|verdict: &VerdictFacts| verdict.time_s);

        let mut signals: BTreeMap<String, Series> = BTreeMap::new();
        let mut over_the_air: BTreeMap<String, Series> = BTreeMap::new();
        let (mut held, mut out_of_order) = (0_usize, 0_usize);
        let mut first_ns = None;
        let mut reader = TableReader::new();
        reader
            .read::<_, Stopped>(&mut FlightLog::open(path)?, |shape, row| {
                if NO_SIGNAL_TABLES.contains(&shape.name.as_str()) {
                    return Ok(());
                }
                let log_ns = row.cells.first().and_then(Cell::number).unwrap_or(0.0);
                let since_s = (log_ns - *first_ns.get_or_insert(log_ns)) / 1e9;
                let (signals, time_s) = if shape.name.starts_with(MESSAGES) {
                    let Some(boot_s) = boot_time_of(shape, &row.cells) else { return Ok(()) };
                    (&mut over_the_air, boot_s)
                } else {
                    (&mut signals, time_of(shape, &row.cells).unwrap_or(since_s))
                };
                for (column, cell) in shape.columns.iter().zip(&row.cells) {
                    let Some(value) = cell.number().filter(|_| !NO_SIGNALS.contains(&column.name.as_str()))
                    else {
                        continue;
                    };
                    let series = signals.entry(format!("{}.{}", shape.name, column.name)).or_default();
                    // A signal needs ascending times, so records out of order are left out and counted.
                    if series.times_s.last().is_none_or(|last_s| *last_s <= time_s) {
                        series.whole = column.kind == Kind::Integer;
                        series.times_s.push(time_s);
                        series.values.push(value);
                        held += 1;
                    } else {
                        out_of_order += 1;
                    }
                }
                if held > VALUES_MAX { Err(Stopped::TooLong) } else { Ok(()) }
            })
            .map_err(|stopped| match stopped {
                Stopped::Log(error) => RecordingError::Log(error),
                Stopped::TooLong => RecordingError::TooLong { name: name.clone(), kind: "numbers" },
            })?;
        // Tables that mix kinds of rows, and texts, are not signals over time.
        signals.retain(|name, _| !name.starts_with("verdict") && !name.starts_with("events."));
        Ok(Self {
            name,
            signals,
            over_the_air,
            has_ticks,
            anchors,
            verdict,
            damage,
            cut: flights.cut(),
            out_of_order,
        })
    }
}

enum Stopped {
    Log(LogError),
    TooLong,
}

impl From<LogError> for Stopped {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

/// The vehicle's time in a message, s since power-up.
fn boot_time_of(shape: &TableShape, cells: &[Cell]) -> Option<f64> {
    let place = shape.columns.iter().position(|column| column.name == TIME_BOOT_MS)?;
    cells.get(place)?.number().map(|time_ms| time_ms / 1e3)
}

/// The vehicle time in the record, s.
fn time_of(shape: &TableShape, cells: &[Cell]) -> Option<f64> {
    let place =
        shape.columns.iter().position(|column| column.name == "time_s" || column.name == "input.time_s")?;
    cells.get(place)?.number().filter(|time_s| time_s.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_between_samples_and_whole_numbers_are_held() {
        let mut series = Series { times_s: vec![0.0, 1.0, 2.0], values: vec![0.0, 10.0, 0.0], whole: false };
        assert_eq!(series.at(0.5), Some(5.0));
        assert_eq!(series.at(2.0), Some(0.0));
        assert_eq!(series.at(2.1), None);
        assert_eq!(series.at(-0.1), None);
        series.whole = true;
        assert_eq!(series.at(1.9), Some(10.0));
        assert_eq!(series.at(2.1), None);
    }
}
