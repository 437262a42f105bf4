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
