//! Measures one link: the rates, the loss and the age of what arrived over the last ten seconds, in total and for
//! each component.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;
use core::time::Duration;

use crate::frame::Frame;
use crate::identity::Address;

/// Rates and loss are taken over this time.
pub const WINDOW: Duration = Duration::from_secs(10);
/// A frame counts as late, not as lost, if at most this many later frames arrived before it.
const REORDER_WINDOW: u8 = 32;
/// At most this many sources are remembered, so that a flood of forged ids cannot fill the memory.
const MAX_SOURCES: usize = 64;
/// At most this many messages have their age remembered.
const MAX_MESSAGES: usize = 256;

#[derive(Debug, Clone, Copy, Default)]
struct Bucket {
    second: u64,
    rx_bytes: u64,
    tx_bytes: u64,
    received: u64,
    lost: u64,
}

/// The last [`WINDOW`], second by second.
#[derive(Debug, Clone, Default)]
struct Buckets(VecDeque<Bucket>);

impl Buckets {
    fn at(&mut self, now: Duration) -> &mut Bucket {
        let second = now.as_secs();
        if self.0.back().is_none_or(|bucket| bucket.second < second) {
            self.0.push_back(Bucket { second, ..Bucket::default() });
        }
        while self.0.len() > WINDOW.as_secs() as usize {
            self.0.pop_front();
        }
        let last = self.0.len() - 1;
        &mut self.0[last]
    }

    fn sum(&self, now: Duration) -> Bucket {
        let oldest = oldest_second(now);
        let mut sum = Bucket::default();
        for bucket in self.0.iter().filter(|bucket| bucket.second >= oldest) {
            sum.rx_bytes += bucket.rx_bytes;
            sum.tx_bytes += bucket.tx_bytes;
            sum.received += bucket.received;
            sum.lost += bucket.lost;
        }
        sum
    }

    fn on_frame(&mut self, lost: u64, late: bool, now: Duration) {
        let bucket = self.at(now);
        bucket.received += 1;
        bucket.lost += lost;
        if late {
            bucket.lost = bucket.lost.saturating_sub(1);
        }
    }
}

fn oldest_second(now: Duration) -> u64 {
    now.as_secs().saturating_sub(WINDOW.as_secs() - 1)
}

impl Bucket {
    fn loss(&self) -> f64 {
        let expected = self.received + self.lost;
        if expected == 0 { 0.0 } else { self.lost as f64 / expected as f64 }
    }
}

#[derive(Debug, Clone)]
struct SourceStats {
    last_sequence: u8,
    first_seen: Duration,
    last_seen: Duration,
    buckets: Buckets,
    counts: FrameCounts,
}

/// How many frames of a component arrived, and how many were lost, since it was first heard.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameCounts {
    pub arrived: u64,
    pub lost: u64,
}

/// The statistics of a link, as one end sees it.
#[derive(Debug, Default)]
pub struct LinkStats {
    sources: BTreeMap<Address, SourceStats>,
    messages: BTreeMap<(Address, u32), Duration>,
    buckets: Buckets,
    first_activity: Option<Duration>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinkFigures {
    pub rx_bytes_s: f64,
    pub tx_bytes_s: f64,
    pub rx_frames_s: f64,
    /// Share of frames that were lost, 0 to 1, from the gaps in the sequence numbers.
    pub loss: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceFigures {
    pub source: Address,
    /// Time since its last frame.
    pub age: Duration,
    pub rx_frames_s: f64,
    /// Share of its frames that were lost, 0 to 1.
    pub loss: f64,
}

impl LinkStats {
    pub fn new() -> Self {
        Self::default()
    }

    /// Counts bytes that arrived, whether or not they belong to a frame.
    pub fn on_rx_bytes(&mut self, count: usize, now: Duration) {
        self.bucket(now).rx_bytes += count as u64;
    }

    /// Counts bytes that were sent.
    pub fn on_tx_bytes(&mut self, count: usize, now: Duration) {
        self.bucket(now).tx_bytes += count as u64;
    }

    /// Counts a frame that arrived. A late frame was counted as lost before, so the loss is corrected. A sequence
    /// number that jumps back by more than a few dozen means that the sender has restarted.
    pub fn on_frame(&mut self, frame: &Frame, now: Duration) {
        let (address, sequence) = (frame.source(), frame.sequence());
        let known = self.sources.get(&address).map(|known| known.last_sequence);
        let ahead = known.map_or(1, |last| sequence.wrapping_sub(last));
        let late = ahead == 0 || ahead > u8::MAX - REORDER_WINDOW;
        let (lost, last_sequence) = match known {
            Some(last) if late => (0, last),
            _ if ahead < 128 => (u64::from(ahead) - 1, sequence),
            _ => (0, sequence),
        };
        if known.is_some() || self.sources.len() < MAX_SOURCES {
            let source = self.sources.entry(address).or_insert_with(|| SourceStats {
                last_sequence,
                first_seen: now,
                last_seen: now,
                buckets: Buckets::default(),
                counts: FrameCounts::default(),
            });
            (source.last_sequence, source.last_seen) = (last_sequence, now);
            source.buckets.on_frame(lost, late, now);
            source.counts.arrived += 1;
            source.counts.lost = (source.counts.lost + lost).saturating_sub(u64::from(late));
        }
        let message = (address, frame.message_id());
        if self.messages.len() < MAX_MESSAGES || self.messages.contains_key(&message) {
            self.messages.insert(message, now);
        }
        self.first_activity.get_or_insert(now);
        self.buckets.on_frame(lost, late, now);
    }

    /// Returns how many frames of this component arrived and were lost since it was first heard.
    pub fn counts(&self, source: Address) -> FrameCounts {
        self.sources.get(&source).map_or_else(FrameCounts::default, |source| source.counts)
    }

    /// Returns the time since the last frame of this component; `None` if it was never heard.
    pub fn age(&self, source: Address, now: Duration) -> Option<Duration> {
        self.sources.get(&source).map(|source| now.saturating_sub(source.last_seen))
    }

    /// Returns the time since the last frame of this message from this component; `None` if it was never heard.
    pub fn message_age(&self, source: Address, message_id: u32, now: Duration) -> Option<Duration> {
        self.messages.get(&(source, message_id)).map(|at| now.saturating_sub(*at))
    }

    /// Returns the source, the message id and the time since the last frame of every message that was heard.
    pub fn messages(&self, now: Duration) -> impl Iterator<Item = (Address, u32, Duration)> {
        self.messages.iter().map(move |((source, id), at)| (*source, *id, now.saturating_sub(*at)))
    }

    /// Returns the rate and the loss of every component that was heard.
    pub fn sources(&self, now: Duration) -> Vec<SourceFigures> {
        let figures = |(address, source): (&Address, &SourceStats)| {
            let sum = source.buckets.sum(now);
            SourceFigures {
                source: *address,
                age: now.saturating_sub(source.last_seen),
                rx_frames_s: sum.received as f64 / span_s(source.first_seen, now),
                loss: sum.loss(),
            }
        };
        self.sources.iter().map(figures).collect()
    }

    /// Returns the figures over the last [`WINDOW`], or since the first activity of a younger link.
    pub fn figures(&self, now: Duration) -> LinkFigures {
        let sum = self.buckets.sum(now);
        let span_s = span_s(self.first_activity.unwrap_or(now), now);
        LinkFigures {
            rx_bytes_s: sum.rx_bytes as f64 / span_s,
            tx_bytes_s: sum.tx_bytes as f64 / span_s,
            rx_frames_s: sum.received as f64 / span_s,
            loss: sum.loss(),
        }
    }

    fn bucket(&mut self, now: Duration) -> &mut Bucket {
        self.first_activity.get_or_insert(now);
        self.buckets.at(now)
    }
}

/// The part of the window in which the link could carry something, s.
fn span_s(since: Duration, now: Duration) -> f64 {
    let window_start = Duration::from_secs(oldest_second(now)).max(since);
    now.saturating_sub(window_start).as_secs_f64().max(1.0)
}
