//! The list of events for the crew; only the newest are kept.

use std::collections::VecDeque;
use std::time::Duration;

use protocol::log::record::EventLevel;

/// How many events are kept; older ones are in the log.
const KEPT: usize = 500;
/// The longest text, in characters; the raw frames in the log hold all of it.
const TEXT_LEN_MAX: usize = 400;

/// Who reports an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Speaker {
    /// The ground station.
    Ground,
    /// The vehicle, by its STATUSTEXT messages.
    Vehicle,
}

impl Speaker {
    /// The name in lists and in the log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ground => "ground",
            Self::Vehicle => "vehicle",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// Since the start of the run.
    pub at: Duration,
    /// Who reports an event.
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
    kept: VecDeque<Event>,
    total: u64,
}

impl Events {
    /// Adds an event and drops the oldest if there are too many.
    pub fn push(&mut self, at: Duration, speaker: Speaker, level: EventLevel, mut text: String) {
        if let Some((cut, _)) = text.char_indices().nth(TEXT_LEN_MAX) {
            text.truncate(cut);
        }
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(Event { at, speaker, level, text });
        self.total += 1;
    }

    /// The events up to a time.
    pub(crate) fn until(&self, at: Duration) -> Self {
        let kept = self.kept.iter().filter(|event| event.at <= at).cloned().collect();
        Self { kept, total: self.total }
    }

    /// How many events there were since the start, including dropped ones.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// The newest `count` events, oldest first.
    pub fn newest(&self, count: usize) -> impl Iterator<Item = &Event> {
        self.kept.iter().skip(self.kept.len().saturating_sub(count))
    }

    /// The events after the first `seen`, as far as they are still kept.
    pub fn since(&self, seen: u64) -> impl Iterator<Item = &Event> {
        let new = usize::try_from(self.total.saturating_sub(seen)).unwrap_or(usize::MAX);
        self.newest(new)
    }
}
