//! The numbers of a log as signals over vehicle time.

use std::collections::BTreeMap;
use std::path::Path;

use flight::rules::phase::Phase;
use serde::Serialize;

use crate::log::{Cut, FlightLog, RecordingError, Verdict};
use crate::table::{Cell, Column, DECODED, FLIGHT_TIME_S, Kind, TableReader, TableShape};

/// Limit on the numbers held for one log; a flight of some minutes has a few hundred thousand.
const VALUES_MAX: usize = 20_000_000;

/// Columns that are not signals: times, record numbers, and durations measured on the wall clock.
const NO_SIGNALS: [&str; 9] = [
    FLIGHT_TIME_S,
    "log_time_ns",
    "time_s",
    "input.time_s",
    "frame",
    "input.frame",
    "solve_time_s",
    "deadline_s",
    "state_digest",
];

/// Beginnings of columns that are not signals: the crew and the log, which are others in every
/// flight.
const NO_SIGNALS_OF: [&str; 6] =
    ["input.log", "input.uplink", "input.commander", "input.people", "input.rehearsed", "output.answers"];

/// Tables without signals.
const NO_SIGNAL_TABLES: [&str; 5] = ["computer_start", "events", "verdict_limits", "operator", "book"];

/// One signal.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Vehicle times in ascending order, s.
    pub times_s: Vec<f64>,
    pub values: Vec<f64>,
    /// Whether the values are whole numbers, which are held between samples.
    pub is_integer: bool,
}

impl Series {
    /// The value at a time; `None` more than half a microsecond outside the series.
    pub fn at(&self, time_s: f64) -> Option<f64> {
        const SAME_S: f64 = 5e-7;
        let behind = self.times_s.partition_point(|t| *t <= time_s + SAME_S);
        let before = behind.checked_sub(1)?;
        let (t0, v0) = (*self.times_s.get(before)?, *self.values.get(before)?);
        if self.is_integer || (time_s - t0).abs() <= SAME_S {
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
    /// Ignition of the landing motor, vehicle time, s.
    pub ignition_s: Option<f64>,
    /// The landing verdict.
    pub verdict: Option<Verdict>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Records that are missing, by their numbers.
    pub messages_lost: u64,
    /// Number of values left out because their times are earlier than the time before them.
    pub out_of_order: usize,
}

impl Flown {
    /// Reads a log file.
    ///
    /// # Errors
    /// The file is not a flight log, cannot be read, holds several flights or is longer than any
    /// flight.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut log = FlightLog::open(path)?.decoding(&DECODED);
        let name = log.name().to_owned();
        let mut first_ns = None;
        let mut read: Vec<Option<Signals>> = Vec::new();
        let (mut held, mut out_of_order) = (0_usize, 0_usize);
        let mut reader = TableReader::without_messages();
        reader.read::<_, RecordingError>(&mut log, |shape, row| {
            let log_ns = row.cells.first().and_then(Cell::number).unwrap_or(0.0);
            let since_s = (log_ns - *first_ns.get_or_insert(log_ns)) / 1e9;
            if NO_SIGNAL_TABLES.contains(&shape.name.as_str()) {
                return Ok(());
            }
            read.resize_with(read.len().max(row.table + 1), || None);
            let Signals { times, columns } = read[row.table].get_or_insert_with(|| Signals::of(shape));
            let number = |column: usize| row.cells.get(column)?.number();
            let time_s = match *times {
                // Outside the flight a frame has no time in it.
                [Some(flight_time), _] => number(flight_time),
                [None, time] => {
                    time.and_then(number).filter(|time_s: &f64| time_s.is_finite()).or(Some(since_s))
                }
            };
            let Some(time_s) = time_s else { return Ok(()) };
            for (series, cell) in columns.iter_mut().zip(&row.cells) {
                let (Some(series), Some(value)) = (series, cell.number()) else { continue };
                // A signal needs ascending times, so records out of order are left out and counted.
                if series.times_s.last().is_none_or(|last_s| *last_s <= time_s) {
                    series.times_s.push(time_s);
                    series.values.push(value);
                    held += 1;
                } else {
                    out_of_order += 1;
                }
            }
            let too_long = || RecordingError::TooLong { name: name.clone(), kind: "numbers" };
            if held > VALUES_MAX { Err(too_long()) } else { Ok(()) }
        })?;
        log.flights.refuse_several(&name)?;
        let mut signals = BTreeMap::<String, Series>::new();
        // The limits and times of a verdict stand beside the signals.
        for (shape, columns) in reader.shapes.iter().zip(read).filter(|(shape, _)| shape.name != "verdict") {
            for (column, series) in shape.columns.iter().zip(columns.into_iter().flat_map(|it| it.columns)) {
                let series = series.filter(|series| !series.values.is_empty());
                signals.extend(series.map(|series| (format!("{}.{}", shape.name, column.name), series)));
            }
        }
        let ignited = |signal: &str| {
            let ignited = |phase: &f64| Phase::from_index(*phase as u8).is_some_and(Phase::in_landing_burn);
            let Series { times_s, values, .. } = signals.get(signal)?;
            times_s.get(values.iter().position(ignited)?).copied()
        };
        let ignition_s = ignited("computer_frame.output.phase").or_else(|| ignited("telemetry.phase"));
        Ok(Self {
            name,
            signals,
            ignition_s,
            verdict: log.verdict(),
            damage: log.damage().map(ToString::to_string),
            cut: log.flights.cut(),
            messages_lost: log.messages_lost(),
            out_of_order,
        })
    }
}

/// The signals of a table while its rows are read.
struct Signals {
    /// The columns with the time of a frame since the release, and of another record.
    times: [Option<usize>; 2],
    /// `None` of a column that is no signal.
    columns: Vec<Option<Series>>,
}

impl Signals {
    fn of(shape: &TableShape) -> Self {
        let series = |Column { name, kind }: &Column| {
            let is_signal = !NO_SIGNALS.contains(&name.as_str())
                && !NO_SIGNALS_OF.iter().any(|beginning| name.starts_with(beginning));
            is_signal.then(|| Series { is_integer: *kind == Kind::Integer, ..Series::default() })
        };
        let times = [FLIGHT_TIME_S, "time_s"].map(|name| shape.place_of(name));
        Self { times, columns: shape.columns.iter().map(series).collect() }
    }
}

/// The event on which the flights are aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Align {
    /// Ignition of the landing motor.
    Ignition,
    /// Vehicle time itself.
    Time,
}

impl Align {
    /// On ignition if both flights have one, else on time; and what to add to the other flight's
    /// times, s.
    pub(super) fn of(baseline: &Flown, other: &Flown) -> (Self, f64) {
        match (baseline.ignition_s, other.ignition_s) {
            (Some(ours_s), Some(theirs_s)) => (Self::Ignition, ours_s - theirs_s),
            _ => (Self::Time, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_values_are_interpolated_and_integers_are_held() {
        let mut series =
            Series { times_s: vec![0.0, 1.0, 2.0], values: vec![0.0, 10.0, 0.0], is_integer: false };
        assert_eq!(series.at(0.5), Some(5.0));
        assert_eq!(series.at(2.0), Some(0.0));
        assert_eq!(series.at(2.1), None);
        assert_eq!(series.at(-0.1), None);
        series.is_integer = true;
        assert_eq!(series.at(1.9), Some(10.0));
        assert_eq!(series.at(2.1), None);
    }
}
