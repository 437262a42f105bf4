//! Shows on standard error how far something long is, and how long the rest will take: a bar on a
//! terminal, elsewhere a line every ten seconds and one at the end.

use std::fmt::Display;
use std::io::Write as _;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use protocol::program::is_quiet;

/// Time between two lines where no terminal is.
const LINE_EVERY: Duration = Duration::from_secs(10);
const BAR: &str = "{wide_bar} {pos} of {len} {msg}; {eta} to go";

/// How far something is, from any thread.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// Start time, and time of the last output.
    times: Mutex<(Instant, Instant)>,
}

impl Progress {
    pub fn start() -> Self {
        let style = ProgressStyle::with_template(BAR).unwrap_or_else(|_wrong| ProgressStyle::default_bar());
        Self { bar: ProgressBar::no_length().with_style(style), times: Mutex::new((now(), now())) }
    }

    pub fn elapsed_s(&self) -> f64 {
        (now() - self.times.lock().unwrap_or_else(PoisonError::into_inner).0).as_secs_f64()
    }

    /// Shows the number of completed items. With none done it restarts.
    pub fn show(&self, done: usize, of: usize, what: impl Display) {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        if done == 0 {
            *times = (now(), now());
            self.bar.reset();
        }
        if is_quiet() {
            return;
        }
        if !self.bar.is_hidden() {
            self.bar.set_length(of as u64);
            self.bar.set_message(what.to_string());
            self.bar.set_position(done as u64);
            if done >= of {
                self.bar.finish_and_clear();
            }
            return;
        }
        let (started, shown) = *times;
        // Standard error may be closed.
        if done >= of {
            let _ = writeln!(std::io::stderr(), "{done} of {of} {what}");
        } else if now() - shown >= LINE_EVERY {
            times.1 = now();
            let left_s = (now() - started).as_secs_f64() * (of - done) as f64 / done.max(1) as f64;
            let _ = writeln!(std::io::stderr(), "{done} of {of} {what}; {left_s:.0} s to go");
        }
    }
}

#[expect(clippy::disallowed_methods, reason = "the time is only shown")]
fn now() -> Instant {
    Instant::now()
}
