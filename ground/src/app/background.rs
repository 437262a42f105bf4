//! Writes files outside the run loop: a disk that stalls must delay no abort.
//!
//! Jobs report their outcome to the run loop, which reads it on its next tick.

use std::collections::BTreeMap;
use std::io;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use protocol::log::recorder::Recorder;

use super::files::LogFiles;

/// Maximum number of jobs that wait for the disk. Only signatures and the positions of several
/// vehicles accumulate; a crew signs some ten steps a minute.
const WAITING_MAX: usize = 64;

/// A file that a job writes, in order of urgency. A newer job replaces a waiting job of the same
/// file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Target {
    /// The unconfirmed abort and the waiting time, for the next run.
    Unfinished,
    /// A numbered entry of the checklist's signatures.
    Signature(u64),
    /// The last position of the vehicle with this boot number.
    Position(u32),
    NextLog,
    /// Size and presence of the log's files.
    LogFiles,
}

/// Outcome of a job.
pub(super) enum Outcome {
    Written,
    NotWritten(Target, anyhow::Error),
    LogFiles(LogFiles),
    /// The next log; `None` if no log is wanted.
    NextLog(anyhow::Result<Option<Recorder>>),
}

type Job = Box<dyn FnOnce() -> Outcome + Send>;

/// The jobs that wait, and a thread that runs them one after the other.
pub(super) struct Background {
    shared: Arc<Shared>,
    outcomes: Receiver<Outcome>,
    thread: JoinHandle<()>,
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

#[derive(Default)]
struct Queue {
    jobs: BTreeMap<Target, Job>,
    ends: bool,
}

impl Shared {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the most urgent job; `None` at the end.
    fn next(&self) -> Option<Job> {
        let queue = self.queue();
        let idle = |queue: &mut Queue| queue.jobs.is_empty() && !queue.ends;
        let mut queue = self.changed.wait_while(queue, idle).unwrap_or_else(PoisonError::into_inner);
        queue.jobs.pop_first().map(|(_, job)| job)
    }
}

impl Background {
    /// Starts the thread.
    ///
    /// # Errors
    /// No thread can be started.
    pub(super) fn start() -> io::Result<Self> {
        let shared = Arc::<Shared>::default();
        let (report, outcomes) = sync_channel(WAITING_MAX);
        let jobs = Arc::clone(&shared);
        let run = move || {
            while let Some(job) = jobs.next() {
                // The run loop may have ended.
                let _ = report.send(job());
            }
        };
        let thread = std::thread::Builder::new().name("files".to_owned()).spawn(run)?;
        Ok(Self { shared, outcomes, thread })
    }

    /// Queues a job. Returns whether there was room.
    pub(super) fn queue(&self, target: Target, job: impl FnOnce() -> Outcome + Send + 'static) -> bool {
        let mut queue = self.shared.queue();
        let has_room = queue.jobs.len() < WAITING_MAX || queue.jobs.contains_key(&target);
        if has_room {
            queue.jobs.insert(target, Box::new(job));
            self.shared.changed.notify_one();
        }
        has_room
    }

    /// The next outcome, if one has arrived.
    pub(super) fn outcome(&self) -> Option<Outcome> {
        self.outcomes.try_recv().ok()
    }

    /// Waits until every queued job has run. Returns the outcomes that are still unread.
    pub(super) fn finish(self) -> Vec<Outcome> {
        self.shared.queue().ends = true;
        self.shared.changed.notify_one();
        let outcomes: Vec<_> = self.outcomes.iter().collect();
        // A job that panicked has printed why.
        let _ = self.thread.join();
        outcomes
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::SyncSender;

    use super::*;

    /// A disk that stalls until the returned end is dropped.
    fn stall(background: &Background) -> SyncSender<()> {
        let (stalled, stalls) = sync_channel::<()>(0);
        let (begun, begins) = sync_channel(1);
        background.queue(Target::LogFiles, move || {
            begun.send(()).unwrap();
            let _ = stalls.recv();
            Outcome::Written
        });
        begins.recv().unwrap();
        stalled
    }

    #[test]
    fn a_newer_job_of_a_file_replaces_the_waiting_one_and_urgent_jobs_run_first() {
        let background = Background::start().unwrap();
        let stalled = stall(&background);
        let (ran, runs) = sync_channel(5);
        let order = [
            (Target::Position(1), "position 1"),
            (Target::Unfinished, "stale wait"),
            (Target::Position(2), "position 2"),
            (Target::Signature(0), "signature"),
            (Target::Unfinished, "wait"),
        ];
        for (target, name) in order {
            let ran = ran.clone();
            assert!(background.queue(target, move || {
                ran.send(name).unwrap();
                Outcome::Written
            }));
        }
        assert!(background.outcome().is_none());
        drop(stalled);
        assert_eq!(background.finish().len(), 5);
        assert_eq!(runs.try_iter().collect::<Vec<_>>(), ["wait", "signature", "position 1", "position 2"]);
    }

    #[test]
    fn the_queue_is_bounded_while_the_disk_stalls() {
        let background = Background::start().unwrap();
        let stalled = stall(&background);
        let accepted = (0..1_000).filter(|n| background.queue(Target::Signature(*n), || Outcome::Written));
        assert_eq!(accepted.count(), WAITING_MAX);
        drop(stalled);
    }
}
