//! The same work on many things, on several threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Results of `work` for each item, in the order of the items whatever the number of threads. `done` is told how many
/// items are finished, after each.
///
/// # Errors
/// A thread could not be started.
pub fn in_parallel<T: Sync, R: Send>(
    items: &[T],
    jobs: usize,
    work: impl Fn(&T) -> R + Sync,
    done: &(dyn Fn(usize) + Sync),
) -> std::io::Result<Vec<R>> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::with_capacity(items.len()));
    let one_after_another = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return };
            let result = work(item);
            let mut results = results.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            results.push((index, result));
            done(results.len());
        }
    };
    thread::scope(|scope| {
        for job in 1..jobs.clamp(1, items.len().max(1)) {
            thread::Builder::new().name(format!("job-{job}")).spawn_scoped(scope, one_after_another)?;
        }
        one_after_another();
        Ok::<(), std::io::Error>(())
    })?;
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.sort_by_key(|(index, _)| *index);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_for_any_number_of_threads() {
        let items: Vec<u64> = (0..50).collect();
        for jobs in [0, 1, 3, 80] {
            let finished = AtomicUsize::new(0);
            let squares = in_parallel(&items, jobs, |item| item * item, &|count| {
                finished.fetch_max(count, Ordering::Relaxed);
            });
            assert_eq!(squares.unwrap(), items.iter().map(|item| item * item).collect::<Vec<_>>());
            assert_eq!(finished.into_inner(), 50);
        }
    }
}
