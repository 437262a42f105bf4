//! Reads the clocks for the tests.

use std::time::{Duration, Instant};

use protocol::signing::stamp_of;

/// The time, for deadlines and measurements.
#[expect(clippy::disallowed_methods, reason = "real processes are timed by a real clock")]
pub fn now() -> Instant {
    Instant::now()
}

/// Time left until a deadline.
pub(crate) fn left(deadline: Instant) -> Duration {
    deadline.saturating_duration_since(now())
}

/// The time of day as a timestamp for signatures.
#[expect(clippy::disallowed_methods, reason = "signatures need the time of day")]
pub fn signing_clock() -> u64 {
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    stamp_of(since_epoch.expect("a clock after 1970"))
}
