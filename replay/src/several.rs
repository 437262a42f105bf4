//! Work on many items, several at a time.

use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

/// Results of `work` for each item, `jobs` at a time, in the order of the items.
pub(crate) fn several<'a, T: Sync, R: Send>(
    items: &'a [T],
    jobs: NonZeroUsize,
    work: impl Fn(&'a T) -> R + Sync,
) -> Vec<R> {
    // Each item is long enough to be stolen alone.
    let all = || items.par_iter().with_max_len(1).map(&work).collect();
    match ThreadPoolBuilder::new().num_threads(jobs.get()).build() {
        Ok(pool) => pool.install(all),
        // Without threads of its own the work is the same, only slower.
        Err(_) => items.iter().map(&work).collect(),
    }
}

/// Is told how many items are finished, of how many.
pub(crate) type Progress<'a> = &'a mut (dyn FnMut(usize, usize) + Send);

/// Counts finished items for someone who watches.
pub(crate) struct Finished<'a> {
    state: Mutex<(usize, Progress<'a>)>,
    all: usize,
}

impl<'a> Finished<'a> {
    pub(crate) fn new(done: usize, all: usize, progress: Progress<'a>) -> Self {
        progress(done, all);
        Self { state: Mutex::new((done, progress)), all }
    }

    pub(crate) fn one_more(&self) {
        // Only `progress` can panic with the lock held, and then the count is still valid.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.0 += 1;
        let done = state.0;
        (state.1)(done, self.all);
    }
}
