//! Runs the jobs of a sweep, several at a time.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;

use super::{Choice, FlightOutcome, PointOutcome, State, SweepError, SweepReport};
use crate::log::Recording;
use crate::refly::{Prepared, ReflyError, ReflyOptions};

/// Capacity of the queue of results.
const QUEUE: usize = 256;

/// Progress of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Jobs finished, including those of an earlier run.
    pub done: usize,
    pub jobs: usize,
}

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
    progress: &mut dyn FnMut(Progress),
) -> Result<SweepReport, SweepError> {
    let all = points.len() * flights.len();
    let missing: Vec<usize> = (0..all).filter(|job| state.outcome(*job).is_none()).collect();
    let mut done = all - missing.len();
    progress(Progress { done, jobs: all });
    let prepared = prepare(flights, &missing, options, jobs)?;
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let mut failed: Option<(usize, SweepError)> = None;
    std::thread::scope(|scope| {
        let (results, inbox) = sync_channel::<(usize, Result<FlightOutcome, ReflyError>)>(QUEUE);
        for _ in 0..jobs.get().min(missing.len()) {
            let (results, missing, next, stop) = (results.clone(), &missing, &next, &stop);
            let prepared = &prepared;
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed)
                    && let Some(job) = missing.get(next.fetch_add(1, Ordering::Relaxed)).copied()
                {
                    // Every flight with a missing job was prepared.
                    let Some(Ready { flight, .. }) = prepared.get(&(job % flights.len())) else { return };
                    let outcome = fly(flight, points, options, job / flights.len());
                    if results.send((job, outcome)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(results);
        while let Ok((job, outcome)) = inbox.recv() {
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
                    progress(Progress { done, jobs: all });
                }
                Err(error) => {
                    stop.store(true, Ordering::Relaxed);
                    // Of several errors, the error of the lowest-numbered job is reported, whatever the timing.
                    if failed.as_ref().is_none_or(|(earlier, _)| job < *earlier) {
                        failed = Some((job, error));
                    }
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
    let next = AtomicUsize::new(0);
    let work = || {
        let mut prepared = Vec::new();
        while let Some(place) = needed.get(next.fetch_add(1, Ordering::Relaxed)) {
            prepared.push((*place, Ready::new(&flights[*place], options)));
        }
        prepared
    };
    let prepared: BTreeMap<usize, Result<Ready, ReflyError>> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs.get().min(needed.len())).map(|_| scope.spawn(work)).collect();
        let joined =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic)));
        joined.flatten().collect()
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
