//! Runs the jobs of a sweep, several at a time.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use super::vary::{Choice, FlightOutcome, PointOutcome, SweepError, SweepReport};
use crate::log::Recording;
use crate::refly::{Prepared, ReflyError, ReflyOptions};
use crate::several::several;

/// Flies every flight at every point, `jobs` at a time. `options` apply in addition to the settings of the points.
///
/// # Errors
/// Some flight cannot be flown again, or the state cannot be written.
pub fn sweep(
    flights: &[Recording],
    points: &[Choice],
    options: &ReflyOptions,
    jobs: NonZeroUsize,
    state: &mut State,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<SweepReport, SweepError> {
    let all = points.len() * flights.len();
    let missing: Vec<usize> = (0..all).filter(|job| state.outcome(*job).is_none()).collect();
    let mut done = all - missing.len();
    progress(done, all);
    let prepared = prepare(flights, &missing, options, jobs)?;
    let stop = AtomicBool::new(false);
    let mut failed: Option<(usize, SweepError)> = None;
    let work = |job: &usize| {
        let Ready { flight, .. } = prepared.get(&(job % flights.len()))?;
        Some(fly(flight, points, options, job / flights.len()))
    };
    several(&missing, jobs, &stop, work, |place, outcome| {
        // Every flight with a missing job was prepared.
        let Some(outcome) = outcome else { return };
        let job = missing[place];
        let noted = match outcome {
            Ok(outcome) => state.note(job, outcome).map_err(SweepError::from),
            Err(source) => Err(SweepError::Refly {
                settings: words(points, job / flights.len()),
                source: Box::new(source),
            }),
        };
        match noted {
            Ok(()) => {
                done += 1;
                progress(done, all);
            }
            Err(error) => {
                stop.store(true, Ordering::Relaxed);
                // Of several errors, the error of the lowest-numbered job is reported, whatever the timing.
                if failed.as_ref().is_none_or(|(earlier, _)| job < *earlier) {
                    failed = Some((job, error));
                }
            }
        }
    });
    if let Some((_, error)) = failed {
        return Err(error);
    }
    let outcomes = (0..points.len()).map(|point| point_outcome(flights, points, state, point));
    let otherwise = prepared.values().filter(|ready| !ready.is_reproduced);
    let not_reproduced = otherwise.map(|ready| ready.flight.recording().name.clone()).collect();
    let names = flights.iter().map(|flight| flight.name.clone()).collect();
    Ok(SweepReport::ranked(names, not_reproduced, outcomes.collect()))
}

/// A prepared flight.
struct Ready<'a> {
    flight: Prepared<'a>,
    is_reproduced: bool,
}

impl<'a> Ready<'a> {
    fn new(recording: &'a Recording, options: &ReflyOptions) -> Result<Self, ReflyError> {
        let flight = Prepared::new(recording, options)?;
        Ok(Self { is_reproduced: flight.is_reproduced(options)?, flight })
    }
}

/// Prepares every flight that a missing job needs, `jobs` at a time. Flying to the start may take as long as the rest
/// of the flight.
fn prepare<'a>(
    flights: &'a [Recording],
    missing: &[usize],
    options: &ReflyOptions,
    jobs: NonZeroUsize,
) -> Result<BTreeMap<usize, Ready<'a>>, SweepError> {
    let needed: BTreeSet<usize> = missing.iter().map(|job| job % flights.len()).collect();
    let needed: Vec<usize> = needed.into_iter().collect();
    let mut prepared: BTreeMap<usize, Result<Ready, ReflyError>> = BTreeMap::new();
    let prepare = |place: &usize| Ready::new(&flights[*place], options);
    several(&needed, jobs, &AtomicBool::new(false), prepare, |place, ready| {
        prepared.insert(needed[place], ready);
    });
    // Of several errors, the error of the first flight is reported, whatever the timing.
    let prepared = prepared.into_iter().map(|(place, flight)| Ok((place, flight?)));
    prepared
        .collect::<Result<_, ReflyError>>()
        .map_err(|source| SweepError::Refly { settings: "as recorded".to_owned(), source: Box::new(source) })
}

fn fly(
    flight: &Prepared,
    points: &[Choice],
    options: &ReflyOptions,
    point: usize,
) -> Result<FlightOutcome, ReflyError> {
    let mut options = options.clone();
    if let Some(choice) = points.get(point) {
        options.settings.extend(choice.settings.iter().cloned());
        options.plant_settings.extend(choice.plant_settings.iter().cloned());
    }
    let report = flight.fly(&options)?;
    Ok(FlightOutcome { landed: report.reflown.is_some_and(|verdict| verdict.landed), margin: report.margin })
}

fn words(points: &[Choice], point: usize) -> String {
    let settings = points.get(point).map(|choice| choice.settings.iter().chain(&choice.plant_settings));
    settings.map(|all| all.map(ToString::to_string).collect::<Vec<_>>().join(" ")).unwrap_or_default()
}

fn point_outcome(flights: &[Recording], points: &[Choice], state: &State, point: usize) -> PointOutcome {
    let outcomes: Vec<FlightOutcome> = (0..flights.len())
        .map(|flight| {
            let outcome = state.outcome(point * flights.len() + flight);
            outcome.unwrap_or(FlightOutcome { landed: false, margin: None })
        })
        .collect();
    let margin = |outcome: &FlightOutcome| outcome.margin.unwrap_or(f64::NEG_INFINITY);
    let worst = outcomes.iter().zip(flights).min_by(|a, b| margin(a.0).total_cmp(&margin(b.0)));
    PointOutcome {
        point,
        settings: points
            .get(point)
            .map(|choice| {
                choice.settings.iter().chain(&choice.plant_settings).map(ToString::to_string).collect()
            })
            .unwrap_or_default(),
        landed: outcomes.iter().filter(|outcome| outcome.landed).count(),
        worst_margin: worst.and_then(|(outcome, _)| outcome.margin),
        worst_flight: worst.map(|(_, flight)| flight.name.clone()).unwrap_or_default(),
        flights: outcomes,
    }
}

/// Why a state file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// It cannot be read or written.
    #[error("{}: cannot be used", path.display())]
    File {
        path: PathBuf,
        /// Error from the operating system.
        source: std::io::Error,
    },
    /// It belongs to another sweep.
    #[error("{}: belongs to another sweep: other flights, settings, points or another build; give another file", path.display())]
    Other { path: PathBuf },
}

/// The outcomes of a sweep's jobs, perhaps backed by a file.
#[derive(Debug, Default)]
pub struct State {
    outcomes: Vec<Option<FlightOutcome>>,
    file: Option<(PathBuf, File)>,
}

/// A line of the file. The margin is text, because every reader reads text back as the same number.
#[derive(Serialize, Deserialize)]
struct Line {
    job: usize,
    landed: bool,
    margin: Option<String>,
}

impl State {
    /// A state in memory only.
    pub fn in_memory(jobs: usize) -> Self {
        Self { outcomes: vec![None; jobs], file: None }
    }

    /// A state in a file, continued if the file exists. `identity` is one line that identifies the sweep.
    ///
    /// # Errors
    /// The file cannot be read or written, or belongs to another sweep.
    pub fn open(path: &Path, identity: &str, jobs: usize) -> Result<Self, StateError> {
        let failed = |source| StateError::File { path: path.to_owned(), source };
        let mut outcomes = vec![None; jobs];
        let mut file = File::options().read(true).append(true).create(true).open(path).map_err(failed)?;
        let mut lines = BufReader::new(file.try_clone().map_err(failed)?).lines();
        match lines.next().transpose().map_err(failed)? {
            None => writeln!(file, "{identity}").map_err(failed)?,
            Some(found) if found == identity => {
                // The last line of a killed run may be incomplete; its job is then run again.
                for line in lines {
                    let line = line.map_err(failed)?;
                    if let Ok(Line { job, landed, margin }) = serde_json::from_str(&line)
                        && let Some(place) = outcomes.get_mut(job)
                    {
                        let margin = margin.and_then(|text| text.parse().ok());
                        *place = Some(FlightOutcome { landed, margin });
                    }
                }
                // An incomplete line must not be joined with the next one.
                writeln!(file).map_err(failed)?;
            }
            Some(_) => return Err(StateError::Other { path: path.to_owned() }),
        }
        Ok(Self { outcomes, file: Some((path.to_owned(), file)) })
    }

    /// The outcome of a job, if it is known.
    pub fn outcome(&self, job: usize) -> Option<FlightOutcome> {
        self.outcomes.get(job).copied().flatten()
    }

    /// How many outcomes are known.
    pub fn known(&self) -> usize {
        self.outcomes.iter().flatten().count()
    }

    /// Notes an outcome.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn note(&mut self, job: usize, outcome: FlightOutcome) -> Result<(), StateError> {
        if let Some(place) = self.outcomes.get_mut(job) {
            *place = Some(outcome);
        }
        if let Some((path, file)) = &mut self.file {
            let margin = outcome.margin.map(|margin| format!("{margin:?}"));
            let line = Line { job, landed: outcome.landed, margin };
            let text = serde_json::to_string(&line).unwrap_or_default();
            writeln!(file, "{text}").map_err(|source| StateError::File { path: path.clone(), source })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_continued_bit_for_bit_and_the_state_of_another_sweep_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("sweep.jsonl");
        let outcome = FlightOutcome { landed: true, margin: Some(0.1 + 0.2) };
        let mut state = State::open(&path, "sweep A", 3).unwrap();
        state.note(1, outcome).unwrap();
        state.note(2, FlightOutcome { landed: false, margin: Some(f64::NEG_INFINITY) }).unwrap();
        drop(state);
        // Killed in the middle of a line.
        let mut bytes = std::fs::read(&path).unwrap();
        bytes.truncate(bytes.len() - 5);
        std::fs::write(&path, bytes).unwrap();
        let mut state = State::open(&path, "sweep A", 3).unwrap();
        assert_eq!((state.outcome(0), state.outcome(1), state.known()), (None, Some(outcome), 1));
        state.note(2, outcome).unwrap();
        assert_eq!(State::open(&path, "sweep A", 3).unwrap().known(), 2);
        assert!(matches!(State::open(&path, "sweep B", 3), Err(StateError::Other { .. })));
    }
}
