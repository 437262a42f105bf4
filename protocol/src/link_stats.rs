//! Measures one link: the rates, the loss and the age of what arrived over the last ten seconds, in
//! total and for each component.

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
/// At most this many messages have their age and rate remembered.
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

/// One message of one component.
#[derive(Debug, Clone)]
struct MessageStats {
    first_seen: Duration,
    last_seen: Duration,
    buckets: Buckets,
}

/// Number of frames of a component received and lost since its first one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameCounts {
    pub arrived: u64,
    pub lost: u64,
}

/// The statistics of a link, as one end sees it.
#[derive(Debug, Default)]
pub struct LinkStats {
    sources: BTreeMap<Address, SourceStats>,
    messages: BTreeMap<(Address, u32), MessageStats>,
    buckets: Buckets,
    first_activity: Option<Duration>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkFigures {
    pub rx_bytes_s: f64,
    pub tx_bytes_s: f64,
    pub rx_frames_s: f64,
    /// Share of frames that were lost, 0 to 1, from the gaps in the sequence numbers.
    pub loss: f64,
}

/// Time of the last message of a component, and its rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MessageFigures {
    pub source: Address,
    pub message_id: u32,
    /// Time since the last one.
    pub age: Duration,
    pub rx_frames_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct SourceFigures {
    pub source: Address,
    /// Time since its last frame.
    pub age: Duration,
    pub rx_frames_s: f64,
    /// Share of its frames that were lost, 0 to 1.
    pub loss: f64,
}

impl LinkStats {
    /// Counts bytes that arrived, whether or not they belong to a frame.
    pub fn on_rx_bytes(&mut self, count: usize, now: Duration) {
        self.bucket(now).rx_bytes += count as u64;
    }

    /// Counts bytes that were sent.
    pub fn on_tx_bytes(&mut self, count: usize, now: Duration) {
        self.bucket(now).tx_bytes += count as u64;
    }

    /// Counts a frame that arrived. A late frame was counted as lost before, so the loss is
    /// corrected. A sequence number that jumps back by more than a few dozen means that the sender
    /// has restarted.
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
            let new = MessageStats { first_seen: now, last_seen: now, buckets: Buckets::default() };
            let message = self.messages.entry(message).or_insert(new);
            message.last_seen = now;
            message.buckets.on_frame(0, false, now);
        }
        self.first_activity.get_or_insert(now);
        self.buckets.on_frame(lost, late, now);
    }

    /// Returns how many frames of this component were received and lost since its first one.
    pub fn counts(&self, source: Address) -> FrameCounts {
        self.sources.get(&source).map_or_else(FrameCounts::default, |source| source.counts)
    }

    /// Returns the time since the last frame of this component; `None` if none was received.
    pub fn age(&self, source: Address, now: Duration) -> Option<Duration> {
        self.sources.get(&source).map(|source| now.saturating_sub(source.last_seen))
    }

    /// Returns the age and the rate of every received message.
    pub fn messages(&self, now: Duration) -> impl Iterator<Item = MessageFigures> {
        self.messages.iter().map(move |((source, message_id), message)| MessageFigures {
            source: *source,
            message_id: *message_id,
            age: now.saturating_sub(message.last_seen),
            rx_frames_s: message.buckets.sum(now).received as f64 / span_s(message.first_seen, now),
        })
    }

    /// Returns the rate and the loss of every received component.
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

/// How old the newest content of a vehicle is, with the time that it has spent in queues.
///
/// The vehicle's messages carry its clock. When one arrives, the clocks differ by at most
/// `arrival - clock`, because nothing arrives before it was sent. The answer to a TIMESYNC was
/// given after the query left, so they differ by at least `query - clock`. The latter is used if
/// available: the age is then overestimated at most by the travel time of the query.
#[derive(Debug, Clone, Default)]
pub struct ContentAge {
    /// The newest time on the vehicle's clock, us, and the first one received.
    received_us: Option<(i64, i64)>,
    /// The least upper bound of the difference in each of the last minutes, us, with the minute.
    upper: VecDeque<(u64, i64)>,
    /// The greatest lower bound in the same way.
    lower: VecDeque<(u64, i64)>,
}

/// So many minutes are remembered. In ten minutes two quartz clocks drift apart by some 60 ms.
const CLOCK_MINUTES: usize = 10;
/// Backward step of a vehicle's clock that means a restart, us. Messages may overtake each other.
const ANEW_US: i64 = 1_000_000;

fn us(time: Duration) -> i64 {
    i64::try_from(time.as_micros()).unwrap_or(i64::MAX)
}

fn tighten(bounds: &mut VecDeque<(u64, i64)>, bound_us: i64, better: fn(i64, i64) -> i64, now: Duration) {
    let minute = now.as_secs() / 60;
    match bounds.back_mut() {
        Some((of, bound)) if *of == minute => *bound = better(*bound, bound_us),
        _ => bounds.push_back((minute, bound_us)),
    }
    while bounds.len() > CLOCK_MINUTES {
        bounds.pop_front();
    }
}

impl ContentAge {
    /// Takes the time on the vehicle's clock that a message carries.
    pub fn received(&mut self, clock: Duration, now: Duration) {
        let (clock_us, offset_us) = (us(clock), us(now) - us(clock));
        if self.received_us.is_some_and(|(newest_us, _)| clock_us + ANEW_US < newest_us) {
            *self = Self::default();
        }
        let (newest_us, first_us) = self.received_us.unwrap_or((clock_us, clock_us));
        self.received_us = Some((newest_us.max(clock_us), first_us));
        // It arrived before it could have been sent: the vehicle's clock runs faster than
        // estimated.
        if self.at_least_us().is_some_and(|least_us| offset_us < least_us) {
            self.lower.clear();
        }
        tighten(&mut self.upper, offset_us, i64::min, now);
    }

    /// Takes the answer to a TIMESYNC: the time on the vehicle's clock, and when the question left.
    pub fn answered(&mut self, clock: Duration, queried_at: Duration, now: Duration) {
        let least_us = us(queried_at) - us(clock);
        // The vehicle's clock has lost time.
        if self.at_most_us().is_some_and(|most_us| most_us < least_us) {
            self.upper.clear();
        }
        tighten(&mut self.lower, least_us, i64::max, now);
    }

    fn at_most_us(&self) -> Option<i64> {
        self.upper.iter().map(|(_, bound_us)| *bound_us).min()
    }

    fn at_least_us(&self) -> Option<i64> {
        self.lower.iter().map(|(_, bound_us)| *bound_us).max()
    }

    /// Returns the age of the newest content; `None` while no clock of the vehicle is seen to run.
    pub fn age(&self, now: Duration) -> Option<Duration> {
        let (newest_us, _) = self.received_us.filter(|(newest_us, first_us)| newest_us > first_us)?;
        let offset_us = self.at_least_us().or(self.at_most_us())?;
        Some(Duration::from_micros(u64::try_from(us(now) - newest_us - offset_us).unwrap_or(0)))
    }
}

/// The part of the window in which the link could carry something, s.
fn span_s(since: Duration, now: Duration) -> f64 {
    let window_start = Duration::from_secs(oldest_second(now)).max(since);
    now.saturating_sub(window_start).as_secs_f64().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    /// Messages every 100 ms that take `delay` of their time of sending to arrive; a question every
    /// 5 s, which takes 30 ms, and its answer as long as everything else. Returns the worst error
    /// of the age, ms, from a time on.
    fn worst_error_ms(delay: impl Fn(u64) -> u64, queries: bool, from_ms: u64) -> u64 {
        // The vehicle has run for 1,000 s when the station starts.
        let clock = |now: u64| ms(1_000_000 + now);
        let mut content = ContentAge::default();
        let mut arrivals: Vec<(u64, u64, Option<u64>)> = Vec::new();
        for sent in (0..60_000).step_by(100) {
            arrivals.push((sent + delay(sent), sent, None));
            if queries && sent % 5_000 == 0 {
                arrivals.push((sent + 30 + delay(sent + 30), sent + 30, Some(sent)));
            }
        }
        arrivals.sort_unstable();
        let (mut worst, mut newest) = (0, 0);
        for (at, sent, queried) in arrivals.into_iter().filter(|(at, ..)| *at < 60_000) {
            if let Some(queried) = queried {
                content.answered(clock(sent), ms(queried), ms(at));
            } else {
                newest = sent;
                content.received(clock(sent), ms(at));
            }
            if at >= from_ms {
                let age_ms = content.age(ms(at)).unwrap().as_millis() as u64;
                worst = worst.max(age_ms.abs_diff(at - newest));
            }
        }
        worst
    }

    #[test]
    fn the_age_is_that_of_the_content_also_when_a_queue_grows() {
        // 1,191 bytes a second into a line of 960.
        let grows = |sent: u64| 40 + sent * 231 / 960;
        assert!(worst_error_ms(grows, false, 1_000) <= 50);
        assert!(worst_error_ms(grows, true, 1_000) <= 50);
        assert!(worst_error_ms(|_| 40, true, 1_000) <= 50);
    }

    #[test]
    fn a_station_that_joins_an_overloaded_line_learns_the_age_from_the_first_answer() {
        let stands = |_| 7_000;
        assert!(worst_error_ms(stands, true, 8_000) <= 50);
        assert!(worst_error_ms(stands, false, 8_000) >= 6_000, "without an answer it is undetected");
    }

    #[test]
    fn a_clock_that_begins_anew_stands_still_or_loses_time_is_not_old_for_long() {
        let mut content = ContentAge::default();
        content.received(ms(0), ms(5_000));
        content.received(ms(0), ms(9_000));
        assert_eq!(content.age(ms(9_000)), None, "it does not run");
        content.received(ms(50_000), ms(10_000));
        content.received(ms(50_100), ms(10_100));
        assert_eq!(content.age(ms(10_350)), Some(ms(250)));
        // A reboot.
        content.received(ms(10), ms(20_000));
        content.received(ms(110), ms(20_100));
        assert_eq!(content.age(ms(20_100)), Some(ms(0)));
        // A simulation that stood still for 4 s.
        content.received(ms(210), ms(24_200));
        assert_eq!(content.age(ms(24_200)), Some(ms(4_000)));
        content.answered(ms(300), ms(24_290), ms(24_300));
        content.received(ms(310), ms(24_310));
        assert_eq!(content.age(ms(24_310)), Some(ms(10)));
    }
}
