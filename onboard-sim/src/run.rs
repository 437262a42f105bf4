//! The same work on many things, on several threads.
//!
//! The work of a thread depends only on its item (for a flight, on the recipe and its number), so
//! no result depends on the number of threads.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use sim::recipe::Recipe;
use sim::sortie::SetUpError;

use crate::row::Row;
use crate::store::{Store, StoreError};
use crate::tally;

/// So many threads, or as many as there are processors, for all work inside their `install`.
///
/// # Errors
/// A thread could not be started.
pub fn threads(jobs: Option<usize>) -> Result<ThreadPool, ThreadPoolBuildError> {
    // 0 means as many as there are processors.
    ThreadPoolBuilder::new().num_threads(jobs.map_or(0, |jobs| jobs.max(1))).build()
}

/// Results of `work` for each item, in the order of the items. `done` gets how many items are
/// finished, after each.
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

/// Counters of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub flown: u64,
    /// Number of flights of this run.
    pub of: u64,
    /// Flights that stand undamaged.
    pub stands: u64,
    /// Flights that touched down inside the design envelope of their legs.
    pub envelope: u64,
    /// Simulated time of the flights, full milliseconds.
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

/// Flies the flights that are not in the store yet. `progress` is called after every flight.
///
/// # Errors
/// The first error; the flights that ended before it stay in the store.
pub fn run(recipe: &Recipe, store: &Store, progress: &(dyn Fn(&Counts) + Sync)) -> Result<Counts, RunError> {
    let missing = store.missing();
    let total = Mutex::new(Counts { of: missing.len() as u64, ..Counts::default() });
    missing.par_iter().with_max_len(1).try_for_each(|number| {
        let row = fly_caught(recipe, *number)?;
        {
            // Only `progress` can panic with the lock held, and then the counts are still valid.
            let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
            total.flown += 1;
            total.stands += u64::from(row.stands);
            total.envelope += u64::from(row.envelope);
            total.flight_time_ms += (row.flight_time_s * 1e3) as u64;
            progress(&total);
        }
        Ok::<_, RunError>(store.add(row)?)
    })?;
    Ok(total.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Flies some flights of a recipe, those of a campaign with it, and returns their rows.
/// `done` gets the number of flights flown.
///
/// # Errors
/// The first flight that cannot be set up or panics.
pub fn fly(
    recipe: &Recipe,
    flights: core::ops::Range<u64>,
    done: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Row>, RunError> {
    let numbers: Vec<u64> = flights.collect();
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
