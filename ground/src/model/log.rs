//! The recording: the station's log as an arming check, the events, and the end of the book.
//!
//! Without a log a launch has no record, no book and no place of the vehicle.

use std::collections::VecDeque;
use std::time::Duration;

use protocol::book::{SignedHead, shown};
use protocol::log::record::EventLevel;
use serde::{Deserialize, Serialize};
use strum::Display;

use super::{LinkState, Model, Settings, Vehicle, is_on_pad};

/// With less free space nothing is armed: several minutes of the busiest link.
const SPACE_MIN_BYTES: u64 = 64 << 20;
/// With less time left at the present rate nothing is armed: a countdown with its holds, a flight,
/// and the wait after it.
const TIME_MIN: Duration = Duration::from_mins(15);
/// From this many times either on the crew is warned.
const WARNED_TIMES: u32 = 4;
/// Silence after which a vehicle counts as switched off.
const SILENT_FOR: Duration = Duration::from_mins(10);
/// A log that has lost records counts as unfit for this long.
const LOSES_FOR: Duration = Duration::from_secs(30);

/// The state of the log writer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogHealth {
    /// Records dropped because the queue was full.
    pub dropped: u64,
    pub failed: bool,
    /// Its files have been removed.
    pub removed: bool,
    /// `None` if it is not known.
    pub space: Option<LogSpace>,
}

/// The space for the log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
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

/// The state of the station's log.
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
    /// The state of the station's log. On an attached screen: that of its station.
    pub fn station_log(&self, now: Duration) -> LogStanding {
        if self.settings.log_path.is_none() || self.playing.is_some() {
            return LogStanding::None;
        }
        let LogHealth { dropped, failed, removed, space } = self.log;
        let loses = self.log_loses_at.is_some_and(|at| now.saturating_sub(at) < LOSES_FOR);
        match space {
            _ if failed => LogStanding::Unfit(LogFault::Failed, "FAILED: nothing is recorded".to_owned()),
            _ if loses => LogStanding::Unfit(LogFault::Loses, format!("loses records, {dropped} so far")),
            _ if removed => LogStanding::Warned("was REMOVED: it goes on in new files".to_owned()),
            Some(space) if space.is_less_than(1) => LogStanding::Unfit(LogFault::Full, space.words()),
            Some(space) if space.is_less_than(WARNED_TIMES) => LogStanding::Warned(space.words()),
            _ if dropped > 0 => LogStanding::Warned(format!("has lost {dropped} records")),
            _ => LogStanding::Fine,
        }
    }

    /// Whether the station may end its log and begin another: the vehicle is disarmed on the pad,
    /// or silent, and no received vehicle flies or is about to.
    pub fn may_change_log(&self, now: Duration) -> bool {
        let rests = |of: &Vehicle| !of.is_armed() && !of.in_flight() && !of.counts_down();
        let is_silent = match self.link.state(now) {
            LinkState::NeverReceived => true,
            LinkState::Lost(silence) => silence >= SILENT_FOR,
            LinkState::Alive(_) | LinkState::Doubtful(_) => false,
        };
        let stands = self.vehicle.armed().is_some() && self.vehicle.phase_now().is_some_and(is_on_pad);
        let Settings { interactive, demonstration, auto, .. } = self.settings;
        // The others end with their flight, and the log of a demonstration begins with the flight
        // computer's start.
        let is_a_station = interactive && !demonstration && !auto;
        let all_rest = std::iter::once(&self.vehicle).chain(self.others.values()).all(rests);
        is_a_station && all_rest && !self.commands.is_aborting() && (is_silent || stands)
    }

    /// Why the station refuses to arm and start; `None` if the log is fit, or if the crew continues
    /// without it.
    pub fn why_no_log(&self, now: Duration) -> Option<String> {
        self.unfit_log(now).map(|(_, words)| format!("station log {words}"))
    }

    /// What is wrong with the log; `None` if it is fit, or if the crew goes on without it.
    pub(crate) fn unfit_log(&self, now: Duration) -> Option<(LogFault, String)> {
        match self.station_log(now) {
            LogStanding::Unfit(fault, words) if self.without_log != Some(fault) => Some((fault, words)),
            _ => None,
        }
    }
}

// The list of events for the crew; only the newest are stored.

/// Number of stored events; older ones are in the log.
const EVENTS_MAX: usize = 500;
/// The longest text, in characters; the raw frames in the log hold all of it.
const TEXT_LEN_MAX: usize = 400;

/// The source of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[strum(serialize_all = "lowercase")]
pub enum Speaker {
    /// The ground station.
    Ground,
    /// The vehicle, by its STATUSTEXT messages.
    Vehicle,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// Since the start of the run.
    pub at: Duration,
    /// The source of an event.
    pub speaker: Speaker,
    pub level: EventLevel,
    /// Safe to print on a terminal.
    pub text: String,
}

impl Event {
    /// A mark that shows the level without colour.
    pub fn mark(&self) -> &'static str {
        match self.level {
            EventLevel::Info => "  ",
            EventLevel::Warning => "! ",
            EventLevel::Error | EventLevel::Fatal => "!!",
        }
    }
}

/// The latest events.
#[derive(Debug, Clone, Default)]
pub struct Events {
    list: VecDeque<Event>,
    total: u64,
}

impl Events {
    /// Adds an event and drops the oldest if there are too many.
    pub fn push(&mut self, at: Duration, speaker: Speaker, level: EventLevel, mut text: String) {
        if let Some((cut, _)) = text.char_indices().nth(TEXT_LEN_MAX) {
            text.truncate(cut);
        }
        if self.list.len() == EVENTS_MAX {
            self.list.pop_front();
        }
        self.list.push_back(Event { at, speaker, level, text });
        self.total += 1;
    }

    /// How many events there were since the start, including dropped ones.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// The newest `count` events, oldest first.
    pub fn newest(&self, count: usize) -> impl DoubleEndedIterator<Item = &Event> {
        self.list.iter().skip(self.list.len().saturating_sub(count))
    }

    /// The events after the first `seen`, as far as they are still stored.
    pub fn since(&self, seen: u64) -> impl Iterator<Item = &Event> {
        let new = usize::try_from(self.total.saturating_sub(seen)).unwrap_or(usize::MAX);
        self.newest(new)
    }
}

// The end of the station's book, and how much of it the vehicle has stored.

/// The end of the book, as the station last signed it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BookState {
    /// `None` before the first signature, and without a book.
    pub head: Option<SignedHead>,
    /// Whether the station has a key to sign with.
    pub is_signed: bool,
    /// Number of entries whose end the vehicle has confirmed.
    pub confirmed: u32,
    /// When the end was last sent to the vehicle.
    pub(crate) sent_at: Option<Duration>,
}

impl BookState {
    /// The number of entries and the beginning of the hash, as `replay verify --book` prints them.
    pub fn short(&self) -> Option<String> {
        let head = self.head?.head;
        Some(format!("{}:{}", head.entries, shown(&head.hash)))
    }
}
