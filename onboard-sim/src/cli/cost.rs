//! Measures how fast a campaign is flown. No other part of a campaign reads a clock.

use core::fmt;
use std::io::{IsTerminal as _, Write as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use campaign::run::Progress;
use serde_json::json;

/// Time between two lines of progress: on a terminal, and in a file.
const SHOW_EVERY: [Duration; 2] = [Duration::from_millis(500), Duration::from_secs(10)];

/// Measures a run and shows how far it is.
pub(super) struct Stopwatch {
    started: Instant,
    shown: Mutex<Option<Instant>>,
    on_terminal: bool,
}

/// Cost of a run.
pub(super) struct Cost {
    flights: u64,
    wall_s: f64,
    flights_per_s: f64,
    times_real_time_per_job: f64,
    jobs: usize,
}

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self { started: now(), shown: Mutex::new(None), on_terminal: std::io::stderr().is_terminal() }
    }

    /// Prints the progress, unless it was printed just before.
    pub(super) fn show(&self, progress: &Progress) {
        let mut shown = self.shown.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let now = now();
        let due = shown.is_none_or(|last| now - last >= SHOW_EVERY[usize::from(!self.on_terminal)]);
        if !due && progress.flown < progress.of {
            return;
        }
        *shown = Some(now);
        let rate = progress.flown as f64 / (now - self.started).as_secs_f64().max(1e-3);
        let left_s = (progress.of - progress.flown) as f64 / rate;
        let (before, after) = if self.on_terminal { ("\r\x1b[K", "") } else { ("", "\n") };
        let after = if progress.flown == progress.of { "\n" } else { after };
        // Messages go to standard error, which may be closed.
        let _ = write!(
            std::io::stderr(),
            "{before}{} of {} flights, {rate:.1} a second, landed: legs {}, strict {}; {left_s:.0} s to go{after}",
            progress.flown,
            progress.of,
            progress.legs,
            progress.strict
        );
    }

    /// `None` if nothing was flown.
    pub(super) fn cost(&self, flown: &Progress, jobs: usize) -> Option<Cost> {
        let wall_s = (now() - self.started).as_secs_f64();
        let flight_s = flown.flight_time_ms as f64 * 1e-3;
        (flown.flown > 0).then(|| Cost {
            flights: flown.flown,
            wall_s,
            flights_per_s: flown.flown as f64 / wall_s,
            times_real_time_per_job: flight_s / wall_s / jobs.max(1) as f64,
            jobs,
        })
    }
}

impl Cost {
    pub(super) fn to_json(&self) -> String {
        format!(
            "{:#}\n",
            json!({
                "flights": self.flights,
                "jobs": self.jobs,
                "wall_s": self.wall_s,
                "flights_per_s": self.flights_per_s,
                "times_real_time_per_job": self.times_real_time_per_job,
            })
        )
    }
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} flights in {:.1} s on {} jobs: {:.1} a second, each job {:.0} times real time",
            self.flights, self.wall_s, self.jobs, self.flights_per_s, self.times_real_time_per_job
        )
    }
}

#[expect(clippy::disallowed_methods, reason = "the duration of a campaign is only reported")]
fn now() -> Instant {
    Instant::now()
}
