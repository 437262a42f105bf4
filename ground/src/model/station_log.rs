//! The station's own log, as a check of its own: without it a launch has no record, no book and no place of the vehicle.

use std::time::Duration;

use super::Model;

/// With less free space nothing is armed: several minutes of the busiest link.
const SPACE_MIN_BYTES: u64 = 64 << 20;
/// With less time left at the present rate nothing is armed: a countdown with its holds, a flight, and the wait after it.
const TIME_MIN: Duration = Duration::from_mins(15);
/// From this many times either on the crew is warned.
const WARNED_TIMES: u32 = 4;
/// A log that has lost records counts as unfit for this long.
const LOSES_FOR: Duration = Duration::from_secs(30);

/// The state of the log writer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LogHealth {
    /// Records dropped because the queue was full.
    pub dropped: u64,
    pub failed: bool,
    /// `None` if it is not known.
    pub space: Option<LogSpace>,
}

/// The space for the log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LogSpace {
    pub free_bytes: u64,
    /// How fast the log grows at present, bytes per second.
    pub grows_bytes_s: u32,
}

impl LogSpace {
    /// Whether this many times the least space, or the least time, is not left.
    fn is_less_than(&self, times: u32) -> bool {
        let needs = u64::from(self.grows_bytes_s) * TIME_MIN.as_secs();
        self.free_bytes < needs.max(SPACE_MIN_BYTES).saturating_mul(times.into())
    }

    /// As in `512 MiB left (90 min)`: at the present rate.
    pub fn words(&self) -> String {
        let mib = self.free_bytes >> 20;
        match self.free_bytes.checked_div(self.grows_bytes_s.into()) {
            Some(left_s) => format!("{mib} MiB left ({} min)", left_s / 60),
            None => format!("{mib} MiB left"),
        }
    }
}

/// What is wrong with the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogFault {
    Failed,
    Loses,
    Full,
}

/// How the station's log stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogStanding {
    /// Nothing is recorded, as the crew has chosen (`--log none`), or there is nothing to record.
    None,
    Fine,
    /// It still records all.
    Warned(String),
    /// Nothing is armed or started from here, unless the crew goes on without a log.
    Unfit(LogFault, String),
}

impl Model {
    /// How the station's log stands. On an attached screen: that of its station.
    pub fn station_log(&self, now: Duration) -> LogStanding {
        if self.settings.log_path.is_none() || self.playing.is_some() {
            return LogStanding::None;
        }
        let LogHealth { dropped, failed, space } = self.log;
        let loses = self.log_loses_at.is_some_and(|at| now.saturating_sub(at) < LOSES_FOR);
        match space {
            _ if failed => LogStanding::Unfit(LogFault::Failed, "FAILED: nothing is recorded".to_owned()),
            _ if loses => LogStanding::Unfit(LogFault::Loses, format!("loses records, {dropped} so far")),
            Some(space) if space.is_less_than(1) => LogStanding::Unfit(LogFault::Full, space.words()),
            Some(space) if space.is_less_than(WARNED_TIMES) => LogStanding::Warned(space.words()),
            _ if dropped > 0 => LogStanding::Warned(format!("has lost {dropped} records")),
            _ => LogStanding::Fine,
        }
    }

    /// Why nothing is armed or started from here; `None` if the log is fit, or if the crew goes on without it.
    pub fn why_no_log(&self, now: Duration) -> Option<String> {
        match self.station_log(now) {
            LogStanding::Unfit(fault, words) if self.without_log != Some(fault) => {
                Some(format!("station log {words}"))
            }
            _ => None,
        }
    }
}
