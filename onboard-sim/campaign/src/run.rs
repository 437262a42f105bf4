//! Flies the missing flights of a campaign on several threads.
//!
//! Each thread takes the next chunk of flights. A flight depends only on the order and its number, so the results do
//! not depend on the thread that flew it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::order::Order;
use crate::row::Row;
use crate::store::{Store, StoreError};
use crate::tally;
use sim::sortie::SetUpError;

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Flights flown in this run.
    pub flown: u64,
    /// Flights that this run has to fly.
    pub of: u64,
    /// Flights of this run that landed within the limits of the legs.
    pub legs: u64,
    /// Flights of this run that landed inside Table 2.
    pub strict: u64,
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
    /// A thread could not be started.
    #[error("a thread could not be started")]
    Thread(#[source] std::io::Error),
}

/// Flies the chunks that are not in the store yet, on `jobs` threads. `progress` is called after every flight.
///
/// # Errors
/// The first error; the chunks that were finished before it stay in the store.
pub fn run(
    order: &Order,
    store: &Store,
    jobs: usize,
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Progress, RunError> {
    let missing: Vec<u64> = store.chunks().filter(|chunk| !store.has(*chunk)).collect();
    let of = missing.iter().map(|chunk| store.flights_of(*chunk).count() as u64).sum();
    let state = Mutex::new((Progress { of, ..Progress::default() }, None::<RunError>));
    let next = AtomicUsize::new(0);
    // Only `progress` can panic with the lock held, and then the counts are still valid.
    let locked = || state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let fly_chunk = |chunk: u64| -> Result<(), RunError> {
        let mut rows = Vec::new();
        for number in store.flights_of(chunk) {
            if locked().1.is_some() {
                return Ok(());
            }
            let row = fly_caught(order, number)?;
            let mut state = locked();
            state.0.flown += 1;
            state.0.legs += u64::from(row.legs);
            state.0.strict += u64::from(row.strict);
            state.0.flight_time_ms += (row.flight_time_s * 1e3) as u64;
            progress(&state.0);
            drop(state);
            rows.push(row);
        }
        Ok(store.write(chunk, &rows)?)
    };
    let work = || {
        while let Some(chunk) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(error) = fly_chunk(*chunk) {
                locked().1.get_or_insert(error);
            }
            if locked().1.is_some() {
                return;
            }
        }
    };
    thread::scope(|scope| {
        for job in 1..jobs.max(1) {
            let started = thread::Builder::new().name(format!("flights-{job}")).spawn_scoped(scope, work);
            if let Err(error) = started {
                locked().1.get_or_insert(RunError::Thread(error));
            }
        }
        work();
    });
    let (progress, error) = state.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    error.map_or(Ok(progress), Err)
}

fn fly_caught(order: &Order, number: u64) -> Result<Row, RunError> {
    match catch_unwind(AssertUnwindSafe(|| tally::fly(&order.recipe, number))) {
        Ok(row) => row.map_err(|source| RunError::Fly { number, source }),
        Err(panic) => Err(RunError::Panic { number, message: words(panic.as_ref()) }),
    }
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "without words".to_owned())
}
