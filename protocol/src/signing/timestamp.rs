//! The timestamps of MAVLink signatures, which count 10 us units since 2015-01-01 UTC.

use core::time::Duration;

/// 2015-01-01 00:00 UTC after the Unix epoch: 16,436 days.
const EPOCH: Duration = Duration::from_hours(24 * 16_436);
pub(super) const STAMPS_PER_S: u64 = 100_000;
/// The largest timestamp: timestamps have 48 bits.
pub(super) const MAX_STAMP: u64 = (1 << 48) - 1;

/// Converts a time since the Unix epoch into a timestamp.
pub fn stamp_of(since_unix_epoch: Duration) -> u64 {
    let since = since_unix_epoch.saturating_sub(EPOCH);
    u64::try_from(since.as_micros() / 10).unwrap_or(MAX_STAMP).min(MAX_STAMP)
}

/// The time of day at one instant, from which on only elapsed time counts. So the stamps of a run do not follow a clock
/// that is set while it runs, forward or back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Anchor(Duration);

impl Anchor {
    /// Starts at this time since the Unix epoch.
    pub fn at(since_unix_epoch: Duration) -> Self {
        Self(since_unix_epoch)
    }

    /// Returns the timestamp this long after the start.
    pub fn stamp(self, since_start: Duration) -> u64 {
        stamp_of(self.0 + since_start)
    }
}
