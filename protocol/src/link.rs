//! Statistics of one link: rates, loss and age, over the last ten seconds.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use crate::frame::Frame;
use crate::identity::Address;

/// The span that rates and loss are taken over.
pub const WINDOW: Duration = Duration::from_secs(10);
/// A frame may be overtaken by this many others.
const REORDER: u8 = 32;
/// Sources remembered at most; a forged flood of ids cannot grow memory.
const MAX_SOURCES: usize = 64;

#[derive(Debug, Clone, Copy, Default)]
struct Bucket {
    second: u64,
    rx_bytes: u64,
    tx_bytes: u64,
    received: u64,
    lost: u64,
}

#[derive(Debug, Clone, Copy)]
struct Source {
    last_sequence: u8,
    last_seen: Duration,
}

/// What a link carries, seen from one end.
#[derive(Debug, Default)]
pub struct LinkStats {
    sources: BTreeMap<Address, Source>,
    buckets: VecDeque<Bucket>,
    first_activity: Option<Duration>,
}

/// A link's figures at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinkFigures {
    /// Bytes per second received.
    pub rx_bytes_s: f64,
    /// Bytes per second sent.
    pub tx_bytes_s: f64,
    /// Frames per second received.
    pub rx_frames_s: f64,
    /// Share of frames lost, 0 to 1, by gaps in the sequence numbers.
    pub loss: f64,
}

impl LinkStats {
    /// A link that nothing has crossed yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Bytes that arrived, frames or not.
    pub fn on_rx_bytes(&mut self, count: usize, now: Duration) {
        self.bucket(now).rx_bytes += count as u64;
    }

    /// Bytes that were sent.
    pub fn on_tx_bytes(&mut self, count: usize, now: Duration) {
        self.bucket(now).tx_bytes += count as u64;
    }

    /// A frame that arrived. One that comes late is taken off the loss that its absence was; a jump backwards by
    /// more than a few dozen is a restarted sender.
    pub fn on_frame(&mut self, frame: &Frame, now: Duration) {
        let (source, sequence) = (frame.source(), frame.sequence());
        let known = self.sources.get(&source).copied();
        let ahead = known.map_or(1, |known| sequence.wrapping_sub(known.last_sequence));
        let late = ahead == 0 || ahead > u8::MAX - REORDER;
        let (lost, last_sequence) = match known {
            Some(known) if late => (0, known.last_sequence),
            _ if ahead < 128 => (u64::from(ahead) - 1, sequence),
            _ => (0, sequence),
        };
        if known.is_some() || self.sources.len() < MAX_SOURCES {
            self.sources.insert(source, Source { last_sequence, last_seen: now });
        }
        let bucket = self.bucket(now);
        bucket.received += 1;
        bucket.lost += lost;
        if late {
            bucket.lost = bucket.lost.saturating_sub(1);
        }
    }

    /// Time since the last frame of this component; `None` if it was never heard.
    pub fn age(&self, source: Address, now: Duration) -> Option<Duration> {
        self.sources.get(&source).map(|source| now.saturating_sub(source.last_seen))
    }

    /// The figures over the last [`WINDOW`], or over the link's life while it is younger.
    pub fn figures(&self, now: Duration) -> LinkFigures {
        let oldest = now.as_secs().saturating_sub(WINDOW.as_secs() - 1);
        let mut sum = Bucket::default();
        for bucket in self.buckets.iter().filter(|bucket| bucket.second >= oldest) {
            sum.rx_bytes += bucket.rx_bytes;
            sum.tx_bytes += bucket.tx_bytes;
            sum.received += bucket.received;
            sum.lost += bucket.lost;
        }
        let window_start = Duration::from_secs(oldest).max(self.first_activity.unwrap_or(now));
        let span_s = now.saturating_sub(window_start).as_secs_f64().max(1.0);
        let expected = sum.received + sum.lost;
        LinkFigures {
            rx_bytes_s: sum.rx_bytes as f64 / span_s,
            tx_bytes_s: sum.tx_bytes as f64 / span_s,
            rx_frames_s: sum.received as f64 / span_s,
            loss: if expected == 0 { 0.0 } else { sum.lost as f64 / expected as f64 },
        }
    }

    fn bucket(&mut self, now: Duration) -> &mut Bucket {
        self.first_activity.get_or_insert(now);
        let second = now.as_secs();
        if self.buckets.back().is_none_or(|bucket| bucket.second < second) {
            self.buckets.push_back(Bucket { second, ..Bucket::default() });
        }
        while self.buckets.len() > WINDOW.as_secs() as usize {
            self.buckets.pop_front();
        }
        let last = self.buckets.len() - 1;
        &mut self.buckets[last]
    }
}
