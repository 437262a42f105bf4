//! Flies the flights, several at a time.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;

use super::state::key;
use super::{Checked, Found, GateState, Outcome, fly};

/// Capacity of the queue of results.
const QUEUE: usize = 64;

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GateProgress {
    /// Flights finished, including those of an earlier run.
    pub done: usize,
    pub flights: usize,
}

/// The outcome of every flight, `jobs` at a time; stops early if `stop` is set, with the outcomes until then.
///
/// # Errors
/// The state cannot be written.
pub fn fly_all(
    flights: &[Found],
    jobs: NonZeroUsize,
    state: &mut GateState,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(GateProgress),
) -> io::Result<BTreeMap<String, Outcome>> {
    let mut outcomes = BTreeMap::new();
    let mut missing = Vec::new();
    for found in flights {
        let key = key(found).ok();
        match key.as_ref().and_then(|key| state.outcome(key)) {
            Some(known) => {
                outcomes.insert(found.name.clone(), known.clone());
            }
            None => missing.push((found, key)),
        }
    }
    progress(GateProgress { done: outcomes.len(), flights: flights.len() });
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        let (results, inbox) = sync_channel::<(usize, Outcome)>(QUEUE);
        for _ in 0..jobs.get().min(missing.len()) {
            let (results, missing, next) = (results.clone(), &missing, &next);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some((found, _)) = missing.get(place) else { return };
                    if results.send((place, fly::fly(found))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(results);
        while let Ok((place, outcome)) = inbox.recv() {
            let Some((found, key)) = missing.get(place) else { continue };
            // A file that cannot be read now may be readable the next time.
            if let Some(key) = key.clone().filter(|_| outcome.checked != Checked::Unverified) {
                state.note(key, outcome.clone())?;
            }
            outcomes.insert(found.name.clone(), outcome);
            progress(GateProgress { done: outcomes.len(), flights: flights.len() });
        }
        Ok(outcomes)
    })
}
