//! The numbers of a log as signals over vehicle time.

use std::collections::BTreeMap;
use std::path::Path;

use flight::rules::phase::Phase;
use serde::Serialize;

use crate::log::{Cut, FlightLog, RecordingError, Verdict};
use crate::table::{Cell, Column, FLIGHT_TIME_S, Kind, TableReader, TableShape};

/// Limit on the numbers held for one log; a flight of some minutes has a few hundred thousand.
const VALUES_MAX: usize = 20_000_000;

/// Begins the names of the tables of MAVLink messages.
const MESSAGES: &str = "mavlink_";
/// The vehicle's time in them, ms since power-up.
const TIME_BOOT_MS: &str = "time_boot_ms";

/// Columns that are not signals: times, record numbers, and durations measured on the wall clock.
const NO_SIGNALS: [&str; 11] = [
    FLIGHT_TIME_S,
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

/// Beginnings of columns that are not signals: the crew and the log, which are others in every flight.
const NO_SIGNALS_OF: [&str; 6] =
    ["input.log_", "input.uplink", "input.commander", "input.people", "input.rehearsed", "output.answers"];

/// Tables of words.
const WORDS: [&str; 4] = ["events", "verdict_limits", "operator", "book"];

/// A table without signals.
const NO_SIGNAL_TABLE: &str = "computer_start";

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
    /// The rows of tables of words, without times and numbers, with how often each is there.
    pub(super) words: BTreeMap<String, BTreeMap<String, usize>>,
    /// The log has what the vehicle decided, not only what was heard of it.
    pub has_frames: bool,
    /// Ignition of the landing motor, vehicle time, s.
    pub ignition_s: Option<f64>,
    /// The landing verdict.
    pub verdict: Option<Verdict>,
    /// Why the log could not be read to its end, if so.
    pub damage: Option<String>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Number of values left out because their times are earlier than the time before them.
    pub out_of_order: usize,
}

impl Flown {
    /// Whether only one of two logs has what the vehicle decided: then they are compared by what went over the air.
    pub(super) fn only_one_has_frames(&self, other: &Self) -> bool {
        self.has_frames != other.has_frames
    }

    /// Reads a log file.
    ///
    /// # Errors
    /// The file is not a flight log, cannot be read, holds several flights or is longer than any flight.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut log = FlightLog::open(path)?;
        let name = log.name().to_owned();
        let mut first_ns = None;
        // By table and column; `None` of a column that is no signal.
        let mut read: Vec<Vec<Option<Series>>> = Vec::new();
        let (mut held, mut out_of_order) = (0_usize, 0_usize);
        let mut words: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        let mut reader = TableReader::new();
        reader.read::<_, RecordingError>(&mut log, |shape, row| {
            let log_ns = row.cells.first().and_then(Cell::number).unwrap_or(0.0);
            let since_s = (log_ns - *first_ns.get_or_insert(log_ns)) / 1e9;
            if shape.name == NO_SIGNAL_TABLE {
                return Ok(());
            }
            if WORDS.contains(&shape.name.as_str()) {
                *words
                    .entry(shape.name.clone())
                    .or_default()
                    .entry(words_of(shape, &row.cells))
                    .or_default() += 1;
                return Ok(());
            }
            let time_s = if shape.name.starts_with(MESSAGES) {
                boot_time_of(shape, &row.cells)
            } else if let Some(place) = shape.place_of(FLIGHT_TIME_S) {
                // Outside the flight a frame has no time in it.
                row.cells.get(place).and_then(Cell::number)
            } else {
                time_of(shape, &row.cells).or(Some(since_s))
            };
            let Some(time_s) = time_s else { return Ok(()) };
            read.resize_with(read.len().max(row.table + 1), Vec::new);
            let columns = &mut read[row.table];
            if columns.is_empty() {
                let series =
                    |column: &Column| Series { whole: column.kind == Kind::Integer, ..Series::default() };
                columns.extend(
                    shape.columns.iter().map(|column| is_signal(&column.name).then(|| series(column))),
                );
            }
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
        log.flights().refuse_several(&name)?;
        let [mut signals, mut over_the_air] = [(); 2].map(|()| BTreeMap::<String, Series>::new());
        // The limits and times of a verdict stand beside the signals.
        for (shape, columns) in reader.shapes().iter().zip(read).filter(|(shape, _)| shape.name != "verdict")
        {
            let signals = if shape.name.starts_with(MESSAGES) { &mut over_the_air } else { &mut signals };
            for (column, series) in shape.columns.iter().zip(columns) {
                let series = series.filter(|series| !series.values.is_empty());
                signals.extend(series.map(|series| (format!("{}.{}", shape.name, column.name), series)));
            }
        }
        let lit = |signal: &str| {
            let lit = |phase: f64| Phase::from_index(phase as u8).is_some_and(Phase::in_landing_burn);
            let series = signals.get(signal)?;
            series.times_s.iter().zip(&series.values).find(|(_, phase)| lit(**phase)).map(|(at_s, _)| *at_s)
        };
        let ignition_s = lit("computer_frame.output.phase").or_else(|| lit("telemetry.phase"));
        Ok(Self {
            name,
            signals,
            over_the_air,
            words,
            has_frames: !log.flights().found().is_empty(),
            ignition_s,
            verdict: log.verdict().as_ref().map(Verdict::found),
            damage: log.damage().map(ToString::to_string),
            cut: log.flights().cut(),
            out_of_order,
        })
    }
}

/// The words of a row.
fn words_of(shape: &TableShape, cells: &[Cell]) -> String {
    let texts = shape.columns.iter().zip(cells).filter_map(|(_, cell)| match cell {
        Cell::Text(text) => Some(text.as_str()),
        _ => None,
    });
    texts.collect::<Vec<_>>().join(": ")
}

fn is_signal(column: &str) -> bool {
    !NO_SIGNALS.contains(&column) && !NO_SIGNALS_OF.iter().any(|beginning| column.starts_with(beginning))
}

/// The vehicle's time in a message, s since power-up.
fn boot_time_of(shape: &TableShape, cells: &[Cell]) -> Option<f64> {
    let place = shape.place_of(TIME_BOOT_MS)?;
    cells.get(place)?.number().map(|time_ms| time_ms / 1e3)
}

/// The vehicle time in the record, s.
fn time_of(shape: &TableShape, cells: &[Cell]) -> Option<f64> {
    let place = shape.place_of("time_s")?;
    cells.get(place)?.number().filter(|time_s| time_s.is_finite())
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
    /// On ignition if both flights have one, else on time; and what to add to the other flight's times, s. What went over the
    /// air has the vehicle's own time.
    pub(super) fn of(baseline: &Flown, other: &Flown) -> (Self, f64) {
        match (baseline.ignition_s, other.ignition_s) {
            (Some(ours_s), Some(theirs_s)) if !baseline.only_one_has_frames(other) => {
                (Self::Ignition, ours_s - theirs_s)
            }
            _ => (Self::Time, 0.0),
        }
    }
}

/// Signals of one log, by name.
type Signals = BTreeMap<String, Series>;

/// The time between the first and the last sample of a log, s.
fn recorded_s(signals: &Signals) -> Option<[f64; 2]> {
    let first = signals.values().filter_map(|series| series.times_s.first().copied()).reduce(f64::min)?;
    let last = signals.values().filter_map(|series| series.times_s.last().copied()).reduce(f64::max)?;
    Some([first, last])
}

/// The time that two logs have in common, in the first's time, s; the second's times are shifted. `None` if there is none.
pub(super) fn common_s(a: &Signals, b: &Signals, shift_s: f64) -> Option<[f64; 2]> {
    let ([from_a, to_a], [from_b, to_b]) = (recorded_s(a)?, recorded_s(b)?);
    let common = [from_a.max(from_b + shift_s), to_a.min(to_b + shift_s)];
    (common[0] < common[1]).then_some(common)
}

/// The signals with what lies within a time. Of the instants at both ends a log may have a part of the messages, so they
/// are left out.
pub(super) fn within(signals: &Signals, [from_s, to_s]: [f64; 2]) -> Signals {
    let part = |(name, series): (&String, &Series)| {
        let kept = series.times_s.partition_point(|time_s| *time_s <= from_s)
            ..series.times_s.partition_point(|time_s| *time_s < to_s);
        let (times_s, values) = (series.times_s.get(kept.clone())?, series.values.get(kept)?);
        let some = Series { times_s: times_s.to_vec(), values: values.to_vec(), whole: series.whole };
        (!times_s.is_empty()).then(|| (name.clone(), some))
    };
    signals.iter().filter_map(part).collect()
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

    fn log(times: &[(&str, &[f64])]) -> Signals {
        let series = |times_s: &[f64]| Series {
            times_s: times_s.to_vec(),
            values: times_s.iter().map(|time_s| 10.0 * time_s).collect(),
            whole: false,
        };
        times.iter().map(|(name, times_s)| ((*name).to_owned(), series(times_s))).collect()
    }

    #[test]
    fn only_the_time_that_both_recorded_is_kept() {
        let vehicle = log(&[("x", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]), ("start", &[0.0]), ("end", &[5.0])]);
        let station = log(&[("x", &[-8.0, -7.0, -6.0]), ("start", &[]), ("end", &[])]);
        let common = common_s(&vehicle, &station, 9.0);
        assert_eq!(common, Some([1.0, 3.0]));
        assert_eq!(within(&vehicle, [1.0, 3.0]), log(&[("x", &[2.0])]));
        assert_eq!(common_s(&vehicle, &station, 0.0), None);
        assert_eq!(common_s(&vehicle, &Signals::new(), 0.0), None);
        // A time that ends before it begins holds nothing.
        assert_eq!(within(&vehicle, [3.0, 1.0]), Signals::new());
    }
}
