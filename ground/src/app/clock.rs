//! The clock, the only place that reads the time; and the signals that end the program.

use std::future::poll_fn;
use std::task::Poll;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::Context as _;
use protocol::background::survive_file_size_limit;
use rustix::time::{ClockId, clock_gettime};
use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::demo::LogClock;

/// Time since the start of the run.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Duration,
    start_unix_ns: u64,
}

impl Clock {
    /// A clock that starts now.
    #[expect(clippy::disallowed_methods, reason = "the run loop's clock; everything else receives the time")]
    pub fn start() -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { start: since_boot(), start_unix_ns: nanoseconds(since_epoch) }
    }

    /// Time since the start.
    pub fn now(&self) -> Duration {
        since_boot().saturating_sub(self.start)
    }

    /// When it started, nanoseconds since the Unix epoch.
    pub fn start_unix_ns(&self) -> u64 {
        self.start_unix_ns
    }

    /// The present time of day, nanoseconds since the Unix epoch; it never goes back during a run.
    pub fn unix_ns(&self) -> u64 {
        self.start_unix_ns.saturating_add(nanoseconds(self.now()))
    }

    /// Waits until a time; forever without one.
    pub async fn sleep_until(&self, at: Option<Duration>) {
        match at {
            Some(at) => tokio::time::sleep(at.saturating_sub(self.now())).await,
            None => std::future::pending().await,
        }
    }
}

/// A clock that runs on while the computer sleeps, like the vehicle's.
pub(super) fn since_boot() -> Duration {
    #[cfg(target_os = "linux")]
    const CLOCK: ClockId = ClockId::Boottime;
    #[cfg(not(target_os = "linux"))]
    const CLOCK: ClockId = ClockId::Monotonic;
    Duration::try_from(clock_gettime(CLOCK)).unwrap_or_default()
}

/// The clock for the time stamps of records; every record of one log uses the same.
#[derive(Debug, Clone)]
pub enum LogTime {
    /// Time since the start of the run.
    Run(Clock),
    /// The clock of the simulated vehicle, which writes into the same log and may run faster or
    /// slower.
    Vehicle(LogClock),
}

impl LogTime {
    /// Nanoseconds since the start of the log.
    pub fn now_ns(&self) -> u64 {
        match self {
            Self::Run(clock) => nanoseconds(clock.now()),
            Self::Vehicle(clock) => clock.now_ns(),
        }
    }
}

/// A duration in nanoseconds.
fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// POSIX.1-2017, `kill`: its number is the same everywhere.
const SIGABRT: i32 = 6;

// Waits for the signals that end the program. None of them affects the vehicle.

/// The signals that end the program, with their names: every one that would otherwise leave the
/// terminal as the screen has it.
pub struct Signals([(Signal, &'static str); 7]);

impl Signals {
    /// Begins to listen.
    ///
    /// # Errors
    /// The system refuses.
    pub fn listen() -> anyhow::Result<Self> {
        let listen = |kind, name| anyhow::Ok((signal(kind).context("listening for signals")?, name));
        // The write fails instead: LOG FAILED, and the station continues.
        survive_file_size_limit().context("handling the limit of the file size")?;
        Ok(Self([
            listen(SignalKind::interrupt(), "SIGINT")?,
            listen(SignalKind::terminate(), "SIGTERM")?,
            listen(SignalKind::hangup(), "SIGHUP")?,
            listen(SignalKind::quit(), "SIGQUIT")?,
            listen(SignalKind::user_defined1(), "SIGUSR1")?,
            listen(SignalKind::user_defined2(), "SIGUSR2")?,
            listen(SignalKind::from_raw(SIGABRT), "SIGABRT")?,
        ]))
    }

    /// The next one's name.
    pub async fn next(&mut self) -> &'static str {
        poll_fn(|context| {
            let mut signals = self.0.iter_mut();
            let come = signals.find_map(|(one, name)| one.poll_recv(context).is_ready().then_some(*name));
            come.map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}
