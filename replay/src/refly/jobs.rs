//! Runs the jobs of a sweep in parallel.

use campaign::run::in_parallel;

use super::vary::{Choice, FlightOutcome, PointOutcome, SweepError, SweepReport};
use crate::log::Recording;
use crate::refly::{Prepared, ReflyError, ReflyOptions};

/// Flies every flight at every point. `options` apply in addition to the settings of the points.
///
/// # Errors
/// Some flight cannot be flown again; of several errors the first flight's at the first point, for any timing.
pub fn sweep(
    flights: &[Recording],
    points: &[Choice],
    options: &ReflyOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<SweepReport, SweepError> {
    let all: Vec<(usize, usize)> =
        (0..points.len()).flat_map(|point| (0..flights.len()).map(move |flight| (point, flight))).collect();
    let failed = |settings, source| SweepError { settings, source: Box::new(source) };
    // Flying to the start may take as long as the rest of the flight.
    let prepared = in_parallel(
        flights,
        |recording| {
            let flight = Prepared::new(recording, options)?;
            Ok((flight.is_reproduced(options)?, flight))
        },
        &|_| {},
    );
    let prepared = prepared
        .into_iter()
        .collect::<Result<Vec<_>, ReflyError>>()
        .map_err(|source| failed("as recorded".to_owned(), source))?;
    let fly = |(point, flight): &(usize, usize)| {
        fly(&prepared[*flight].1, &points[*point], options)
            .map_err(|source| failed(points[*point].words().join(" "), source))
    };
    let outcomes = in_parallel(&all, fly, &|done| progress(done, all.len()));
    let outcomes = outcomes.into_iter().collect::<Result<Vec<_>, _>>()?;
    let ranked = points.iter().zip(outcomes.chunks(flights.len().max(1))).enumerate();
    let ranked = ranked.map(|(point, (choice, outcomes))| point_outcome(point, choice, flights, outcomes));
    let otherwise = prepared.iter().filter(|(is_reproduced, _)| !is_reproduced);
    let not_reproduced = otherwise.map(|(_, flight)| flight.recording().name.clone()).collect();
    let names = flights.iter().map(|flight| flight.name.clone()).collect();
    Ok(SweepReport::ranked(names, not_reproduced, ranked.collect()))
}

fn fly(flight: &Prepared, choice: &Choice, options: &ReflyOptions) -> Result<FlightOutcome, ReflyError> {
    let mut options = options.clone();
    options.settings.extend(choice.settings.iter().cloned());
    options.plant_settings.extend(choice.plant_settings.iter().cloned());
    let report = flight.fly(&options)?;
    Ok(FlightOutcome { landed: report.reflown.is_some_and(|verdict| verdict.landed), margin: report.margin })
}

fn point_outcome(
    point: usize,
    choice: &Choice,
    flights: &[Recording],
    outcomes: &[FlightOutcome],
) -> PointOutcome {
    let margin = |outcome: &FlightOutcome| outcome.margin.unwrap_or(f64::NEG_INFINITY);
    let worst = outcomes.iter().zip(flights).min_by(|a, b| margin(a.0).total_cmp(&margin(b.0)));
    PointOutcome {
        point,
        settings: choice.words(),
        landed: outcomes.iter().filter(|outcome| outcome.landed).count(),
        worst_margin: worst.and_then(|(outcome, _)| outcome.margin),
        worst_flight: worst.map(|(_, flight)| flight.name.clone()).unwrap_or_default(),
        flights: outcomes.to_vec(),
    }
}
