//! The same work on many things, on several threads: the missing flights of a campaign, and then its results.
//!
//! What a thread does depends only on its thing (of a flight on the order and its number), so no result depends on the
//! number of threads.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use sim::recipe::Recipe;
use sim::sortie::SetUpError;

use crate::figure::FigureError;
use crate::row::{Row, to_csv, to_parquet};
use crate::store::{Order, Store, StoreError};
use crate::summary::{PICTURES, Summary, pictures, to_markdown};
use crate::tally;

/// So many threads, or as many as there are processors, for all work inside their `install`.
///
/// # Errors
/// A thread could not be started.
pub fn threads(jobs: Option<usize>) -> Result<ThreadPool, ThreadPoolBuildError> {
    // 0 means as many as there are processors.
    ThreadPoolBuilder::new().num_threads(jobs.map_or(0, |jobs| jobs.max(1))).build()
}

/// Results of `work` for each item, in the order of the items. `done` gets how many items are finished, after each.
pub fn in_parallel<'a, T: Sync, R: Send>(
    items: &'a [T],
    work: impl Fn(&'a T) -> R + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> Vec<R> {
    let finished = AtomicUsize::new(0);
    let one = |item| {
        let result = work(item);
        done(finished.fetch_add(1, Ordering::Relaxed) + 1);
        result
    };
    // Each item is long enough to be stolen alone.
    items.par_iter().with_max_len(1).map(one).collect()
}

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Flights flown in this run.
    pub flown: u64,
    /// Flights that this run has to fly.
    pub of: u64,
    /// Flights of this run that stand undamaged.
    pub stands: u64,
    /// Flights of this run that touched down inside the design envelope of their legs.
    pub envelope: u64,
    /// Simulated time of this run's flights, whole milliseconds.
    pub flight_time_ms: u64,
}

/// Why a run stopped.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A flight cannot be set up.
    #[error("flight {number}")]
    Fly {
        number: u64,
        #[source]
        source: SetUpError,
    },
    /// A flight panicked, which is a bug in this program.
    #[error("flight {number} panicked: {message}")]
    Panic {
        number: u64,
        /// The panic's message.
        message: String,
    },
    /// The directory cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Flies the chunks that are not in the store yet. `progress` is called after every flight.
///
/// # Errors
/// The first error; the chunks that were finished before it stay in the store.
pub fn run(
    order: &Order,
    store: &Store,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Progress, RunError> {
    let missing: Vec<u64> = store.chunks().filter(|chunk| !store.has(*chunk)).collect();
    let of = missing.iter().map(|chunk| store.flights_of(*chunk).count() as u64).sum();
    let total = Mutex::new(Progress { of, ..Progress::default() });
    let fly_chunk = |chunk: &u64| -> Result<(), RunError> {
        let fly = |number| {
            let row = fly_caught(&order.recipe, number)?;
            // Only `progress` can panic with the lock held, and then the counts are still valid.
            let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
            total.flown += 1;
            total.stands += u64::from(row.stands);
            total.envelope += u64::from(row.envelope);
            total.flight_time_ms += (row.flight_time_s * 1e3) as u64;
            progress(&total);
            Ok::<_, RunError>(row)
        };
        let rows: Vec<Row> = store.flights_of(*chunk).map(fly).collect::<Result<_, _>>()?;
        Ok(store.write(*chunk, &rows)?)
    };
    missing.par_iter().with_max_len(1).try_for_each(fly_chunk)?;
    Ok(total.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Flies flights 0 to `flights` of a recipe, those of a campaign with it, and keeps their rows. `done` gets how many are flown.
///
/// # Errors
/// The first flight that cannot be set up or panics.
pub fn fly(recipe: &Recipe, flights: u64, done: &(dyn Fn(usize) + Sync)) -> Result<Vec<Row>, RunError> {
    let numbers: Vec<u64> = (0..flights).collect();
    in_parallel(&numbers, |number| fly_caught(recipe, *number), done).into_iter().collect()
}

fn fly_caught(recipe: &Recipe, number: u64) -> Result<Row, RunError> {
    match catch_unwind(AssertUnwindSafe(|| tally::fly(recipe, number))) {
        Ok(row) => row.map_err(|source| RunError::Fly { number, source }),
        Err(panic) => Err(RunError::Panic { number, message: words(panic.as_ref()) }),
    }
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "without words".to_owned())
}

/// Writes `flights.csv`, `flights.parquet`, `summary.json`, `summary.md` and the pictures from the store's chunks.
///
/// # Errors
/// A chunk is missing or damaged, or a file cannot be written.
pub fn publish(order: &Order, store: &Store) -> Result<Summary, StoreError> {
    let rows = store.rows()?;
    let summary = Summary::new(store.manifest(), &rows);
    let write = |name: &str, made: Result<Vec<u8>, String>| match made {
        Ok(bytes) => store.publish(name, &bytes),
        Err(message) => Err(StoreError::Content { path: store.path().join(name), message }),
    };
    write("flights.csv", to_csv(&rows).map_err(|error| error.to_string()))?;
    write("flights.parquet", to_parquet(&rows).map_err(|error| error.to_string()))?;
    write("summary.json", serde_json::to_vec_pretty(&summary).map_err(|error| error.to_string()))?;
    write("summary.md", Ok(to_markdown(&summary).into_bytes()))?;
    for ((name, _), picture) in PICTURES.iter().zip(pictures(&rows, &order.recipe.mission.leg_limits)) {
        write(name, picture.map(String::into_bytes).map_err(|error: FigureError| error.to_string()))?;
    }
    Ok(summary)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_for_any_number_of_threads() {
        let items: Vec<u64> = (0..50).collect();
        for jobs in [0, 1, 3, 80] {
            let finished = AtomicUsize::new(0);
            let count = |count| _ = finished.fetch_max(count, Ordering::Relaxed);
            let square = || in_parallel(&items, |item| item * item, &count);
            let squares = threads(Some(jobs)).unwrap().install(square);
            assert_eq!(squares, items.iter().map(|item| item * item).collect::<Vec<_>>());
            assert_eq!(finished.into_inner(), 50);
        }
    }
}
