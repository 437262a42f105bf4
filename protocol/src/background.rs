//! Writes files outside a run loop: a disk that stalls must delay no abort.
//!
//! A thread runs the jobs one after the other, the most urgent first. A newer job replaces a
//! waiting job of the same target. The run loop reads the outcomes when it comes round.

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Signal whose default action ends a program that writes beyond a limit of the file size
/// (`ulimit -f`). The same number on every Linux, except on MIPS.
const SIGXFSZ: i32 = 25;

/// Lets a write beyond a limit of the file size fail instead of ending the program. Called in a
/// Tokio runtime.
///
/// # Errors
/// The system refuses.
pub fn survive_file_size_limit() -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    signal(SignalKind::from_raw(SIGXFSZ)).map(drop)
}

/// Maximum number of jobs that wait, and of outcomes that are unread.
const WAITING_MAX: usize = 64;
/// How long the last jobs may take at the end of the program.
const ENDS_WITHIN: Duration = Duration::from_secs(10);

type Job<O> = Box<dyn FnOnce() -> O + Send>;

/// Jobs by their targets, in the order of urgency, and the thread that runs them.
pub struct Background<T, O> {
    shared: Arc<Shared<T, O>>,
    outcomes: Receiver<O>,
    thread: Option<JoinHandle<()>>,
}

struct Shared<T, O> {
    queue: Mutex<Queue<T, O>>,
    changed: Condvar,
}

struct Queue<T, O> {
    jobs: BTreeMap<T, Job<O>>,
    runs: bool,
    ends: bool,
}

impl<T, O> Shared<T, O> {
    fn queue(&self) -> MutexGuard<'_, Queue<T, O>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Ord, O> Shared<T, O> {
    /// Waits for the most urgent job; `None` at the end.
    fn next(&self) -> Option<Job<O>> {
        let mut queue = self.queue();
        queue.runs = false;
        self.changed.notify_all();
        let idle = |queue: &mut Queue<T, O>| queue.jobs.is_empty() && !queue.ends;
        let mut queue = self.changed.wait_while(queue, idle).unwrap_or_else(PoisonError::into_inner);
        queue.runs = !queue.jobs.is_empty();
        queue.jobs.pop_first().map(|(_, job)| job)
    }
}

impl<T: Ord + Send + 'static, O: Send + 'static> Background<T, O> {
    /// Starts the thread.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn start(name: &str) -> io::Result<Self> {
        let queue = Mutex::new(Queue { jobs: BTreeMap::new(), runs: false, ends: false });
        let shared = Arc::new(Shared { queue, changed: Condvar::new() });
        let (report, outcomes) = sync_channel(WAITING_MAX);
        let jobs = Arc::clone(&shared);
        let run = move || {
            while let Some(job) = jobs.next() {
                // The run loop may have ended.
                let _ = report.send(job());
            }
        };
        let thread = Some(std::thread::Builder::new().name(name.to_owned()).spawn(run)?);
        Ok(Self { shared, outcomes, thread })
    }

    /// Queues a job. Returns whether there was room.
    pub fn queue(&self, target: T, job: impl FnOnce() -> O + Send + 'static) -> bool {
        let mut queue = self.shared.queue();
        let has_room = queue.jobs.len() < WAITING_MAX || queue.jobs.contains_key(&target);
        if has_room {
            queue.jobs.insert(target, Box::new(job));
            self.shared.changed.notify_all();
        }
        has_room
    }

    /// The next outcome, if one has arrived.
    pub fn outcome(&self) -> Option<O> {
        self.outcomes.try_recv().ok()
    }

    /// Waits until every queued job has run. Returns the outcomes that are still unread.
    pub fn finish(mut self) -> Vec<O> {
        self.end();
        let outcomes = self.outcomes.iter().collect();
        // A job that panicked has printed why.
        let _ = self.thread.take().map(JoinHandle::join);
        outcomes
    }
}

impl<T, O> Background<T, O> {
    /// Waits until no job waits or runs, at most so long. Returns whether that is so.
    pub fn wait(&self, longest: Duration) -> bool {
        let is_busy = |queue: &mut Queue<T, O>| !queue.jobs.is_empty() || queue.runs;
        let waited = self.shared.changed.wait_timeout_while(self.shared.queue(), longest, is_busy);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    fn end(&self) {
        self.shared.queue().ends = true;
        self.shared.changed.notify_all();
    }
}

impl<T, O> fmt::Debug for Background<T, O> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Background").finish_non_exhaustive()
    }
}

impl<T, O> Drop for Background<T, O> {
    /// Waits for the last jobs, as long as a disk may stall.
    fn drop(&mut self) {
        self.end();
        // Nobody reads an outcome any more: the thread must not wait for room for one.
        self.outcomes = sync_channel(0).1;
        if self.thread.is_some() {
            self.wait(ENDS_WITHIN);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::SyncSender;

    use super::*;

    /// A disk that stalls until the returned end is dropped.
    fn stall(background: &Background<u32, ()>) -> SyncSender<()> {
        let (stalled, stalls) = sync_channel::<()>(0);
        let (begun, begins) = sync_channel(1);
        background.queue(9, move || {
            begun.send(()).unwrap();
            let _ = stalls.recv();
        });
        begins.recv().unwrap();
        stalled
    }

    /// Otherwise a program would wait at its end for a thread that has nothing to do.
    #[test]
    fn a_thread_that_has_ended_is_not_busy() {
        let mut background = Background::<u8, ()>::start("test").unwrap();
        background.end();
        background.thread.take().unwrap().join().unwrap();
        assert!(background.wait(Duration::ZERO));
    }

    #[test]
    fn a_newer_job_of_a_target_replaces_the_waiting_one_and_urgent_jobs_run_first() {
        let background = Background::start("test").unwrap();
        let stalled = stall(&background);
        let (ran, runs) = sync_channel(5);
        for (target, name) in [(3, "position"), (1, "stale wait"), (2, "signature"), (1, "wait")] {
            let ran = ran.clone();
            assert!(background.queue(target, move || ran.send(name).unwrap()));
        }
        assert!(background.outcome().is_none() && !background.wait(Duration::from_millis(1)));
        drop(stalled);
        assert!(background.wait(ENDS_WITHIN));
        assert_eq!(background.finish().len(), 4);
        assert_eq!(runs.try_iter().collect::<Vec<_>>(), ["wait", "signature", "position"]);
    }

    #[test]
    fn the_queue_is_bounded_while_the_disk_stalls() {
        let background = Background::start("test").unwrap();
        let stalled = stall(&background);
        let accepted = (10..1_000).filter(|target| background.queue(*target, || ()));
        assert_eq!(accepted.count(), WAITING_MAX);
        drop(stalled);
    }
}
