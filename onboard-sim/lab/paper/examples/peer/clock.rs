//! The thread's own processor time, without the time of other threads.

use rustix::time::{ClockId, clock_gettime};

/// Processor time of this thread, ns.
pub(crate) fn thread_ns() -> i64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

/// Time of one run, ns: the mean over some runs, and the smallest of these means over some repeats.
pub(crate) fn best_of(repeats: u32, runs: u32, mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..repeats {
        let before = thread_ns();
        for _ in 0..runs {
            work();
        }
        best = best.min((thread_ns() - before) as f64 / f64::from(runs));
    }
    best
}
