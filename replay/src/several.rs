//! Work on many items, several at a time.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;

/// Capacity of the queue of results.
const QUEUE: usize = 256;

/// Works on every item, `jobs` at a time, until `stop` is set. Results are taken as they come, with their item's place.
pub(crate) fn several<T: Sync, R: Send>(
    items: &[T],
    jobs: NonZeroUsize,
    stop: &AtomicBool,
    work: impl Fn(&T) -> R + Sync,
    mut take: impl FnMut(usize, R),
) {
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        let (results, inbox) = sync_channel(QUEUE);
        for _ in 0..jobs.get().min(items.len()) {
            let (results, next, work) = (results.clone(), &next, &work);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(place) else { return };
                    if results.send((place, work(item))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(results);
        while let Ok((place, result)) = inbox.recv() {
            take(place, result);
        }
    });
}
