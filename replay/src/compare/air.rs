//! What the air lost of a flight: the frames that one end of the link recorded as sent, and the other as received.

use std::collections::{BTreeMap, VecDeque};

use protocol::frame::Frame;
use protocol::log::reader::LogChannel;
use protocol::log::record::TOPIC_RAW_RX;
use serde::Serialize;

use super::Flown;
use crate::log::{Entry, StampedEntry, frame_of};
use crate::table::message_name;

/// A copy of a frame over another link comes within this time. The same bytes come again after 256 messages at the earliest.
const COPY_WITHIN_NS: u64 = 1_000_000_000;
/// A station that recorded so long after the last message that it heard has lost what was sent then. In less a message is on
/// its way, or is not due.
const ON_ITS_WAY_NS: u64 = 1_000_000_000;

/// The frames at one end, by what recorded them.
#[derive(Debug, Clone, Default)]
pub(super) struct Frames {
    /// By the endpoint, whether it received them, and the link.
    by_link: BTreeMap<(String, bool, String), Vec<Recorded>>,
    /// The first and the last record of the log, ns.
    recorded_ns: Option<[u64; 2]>,
}

/// A frame, without what differs between links: signature and checksum.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Recorded {
    log_ns: u64,
    message_id: u32,
    /// Sequence number, sender, message and payload.
    content: Vec<u8>,
}

/// What one end sent over one of its links, and what of it the other end heard, over any link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverTheAir {
    /// `vehicle` or `ground`.
    pub sender: String,
    pub link: String,
    /// Messages sent while both recorded.
    pub sent: usize,
    pub lost: usize,
    /// The longest time between two messages heard of which one between was lost, s; 0 if none was.
    pub longest_gap_s: f64,
    /// When it began, s after the first record of the sender's log.
    pub longest_gap_at_s: Option<f64>,
    /// By message.
    pub streams: BTreeMap<String, Stream>,
}

/// One kind of message over the air.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Stream {
    pub sent: usize,
    pub lost: usize,
    /// As of all messages.
    pub longest_gap_s: f64,
}

impl OverTheAir {
    /// The share of the messages that was heard, percent.
    pub fn heard_percent(&self) -> f64 {
        100.0 * (self.sent - self.lost) as f64 / self.sent as f64
    }
}

impl Frames {
    /// Notes a record of the log; of a raw frame, with its channel.
    pub(super) fn note(&mut self, channel: Option<&LogChannel>, stamped: &StampedEntry) {
        let at_ns = stamped.log_time_ns;
        let [first_ns, last_ns] = self.recorded_ns.unwrap_or([at_ns; 2]);
        self.recorded_ns = Some([first_ns.min(at_ns), last_ns.max(at_ns)]);
        let Some((channel, frame)) =
            channel.zip((stamped.entry == Entry::RawFrame).then(|| frame_of(&stamped.data)).flatten())
        else {
            return;
        };
        let fact = |key: &str| channel.metadata.get(key).cloned().unwrap_or_default();
        let link = (fact("endpoint"), channel.topic == TOPIC_RAW_RX, fact("link"));
        self.by_link.entry(link).or_default().push(Recorded::of(at_ns, &frame, &stamped.data));
    }

    /// What an endpoint received, a copy over another link once.
    fn heard_by(&self, endpoint: &str) -> Vec<&Recorded> {
        let links = self.by_link.iter().filter(|((at, received, _), _)| at == endpoint && *received);
        let mut all: Vec<(&Recorded, usize)> = links
            .enumerate()
            .flat_map(|(link, (_, frames))| frames.iter().map(move |frame| (frame, link)))
            .collect();
        all.sort_by_key(|(frame, _)| frame.log_ns);
        let mut last: BTreeMap<&[u8], (u64, usize)> = BTreeMap::new();
        all.retain(|(frame, link)| {
            let before = last.insert(&frame.content, (frame.log_ns, *link));
            before.is_none_or(|(at_ns, over)| over == *link || frame.log_ns - at_ns > COPY_WITHIN_NS)
        });
        all.into_iter().map(|(frame, _)| frame).collect()
    }
}

impl Recorded {
    fn of(log_ns: u64, frame: &Frame, bytes: &[u8]) -> Self {
        // From the sequence number to the end of the payload.
        let end = bytes.get(1).map_or(0, |length| 10 + usize::from(*length));
        let content = bytes.get(4..end).unwrap_or_default().to_vec();
        Self { log_ns, message_id: frame.message_id(), content }
    }
}

/// What each end of a link sent and the other heard, over the sender's link of which most was heard; empty unless one log is of
/// the vehicle's end and the other of a station's.
pub(super) fn over_the_air(a: &Flown, b: &Flown) -> Vec<OverTheAir> {
    let ends = [
        (a, "vehicle", b, "ground"),
        (b, "vehicle", a, "ground"),
        (a, "ground", b, "vehicle"),
        (b, "ground", a, "vehicle"),
    ];
    let best = ends.into_iter().filter_map(|(from, sender, to, receiver)| {
        let heard = to.frames.heard_by(receiver);
        let sent = from.frames.by_link.iter().filter(|((at, received, _), _)| at == sender && !received);
        let links = sent.filter_map(|((_, _, link), sent)| {
            Some(OverTheAir {
                sender: sender.to_owned(),
                link: link.clone(),
                ..crossed(&from.frames, sent, &heard, &to.frames)?
            })
        });
        links.max_by(|one, other| one.heard_percent().total_cmp(&other.heard_percent()))
    });
    best.collect()
}

/// What was sent over one link, and what of it was heard. `None` if nothing was heard.
fn crossed(from: &Frames, sent: &[Recorded], heard: &[&Recorded], to: &Frames) -> Option<OverTheAir> {
    let mut waiting: BTreeMap<&[u8], VecDeque<u64>> = BTreeMap::new();
    for frame in heard {
        waiting.entry(&frame.content).or_default().push_back(frame.log_ns);
    }
    let crossed: Vec<(&Recorded, Option<u64>)> = sent
        .iter()
        .map(|frame| (frame, waiting.get_mut(frame.content.as_slice()).and_then(VecDeque::pop_front)))
        .collect();
    // The two logs have clocks of their own: the first and the last message that both have tell what the other's is here.
    let (both, recorded_ns) = (
        |frames: &(&Recorded, Option<u64>)| frames.1.map(|heard_ns| (frames.0.log_ns, heard_ns)),
        to.recorded_ns?,
    );
    let (first, last) = (crossed.iter().find_map(both)?, crossed.iter().rev().find_map(both)?);
    let here = |(sent_ns, heard_ns): (u64, u64), theirs_ns: u64| {
        i128::from(theirs_ns) - i128::from(heard_ns) + i128::from(sent_ns)
    };
    let (begins, ends) = (here(first, recorded_ns[0]), here(last, recorded_ns[1]));
    let on_its_way = i128::from(ON_ITS_WAY_NS);
    let begins = if i128::from(first.0) - begins > on_its_way { begins } else { i128::from(first.0) };
    let ends = if ends - i128::from(last.0) > on_its_way { ends } else { i128::from(last.0) };

    let started_ns = from.recorded_ns?[0];
    let mut all = Gaps::default();
    let mut streams: BTreeMap<String, Gaps> = BTreeMap::new();
    for (frame, heard) in
        crossed.iter().filter(|(frame, _)| (begins..=ends).contains(&i128::from(frame.log_ns)))
    {
        let since_s = (frame.log_ns - started_ns) as f64 / 1e9;
        let name = message_name(frame.message_id).unwrap_or("unknown").to_owned();
        for gaps in [&mut all, streams.entry(name).or_default()] {
            gaps.note(since_s, heard.is_some());
        }
    }
    Some(OverTheAir {
        sender: String::new(),
        link: String::new(),
        sent: all.sent,
        lost: all.lost,
        longest_gap_s: all.longest_s,
        longest_gap_at_s: all.longest_at_s,
        streams: streams
            .into_iter()
            .map(|(name, Gaps { sent, lost, longest_s, .. })| {
                (name, Stream { sent, lost, longest_gap_s: longest_s })
            })
            .collect(),
    })
}

#[derive(Debug, Default)]
struct Gaps {
    sent: usize,
    lost: usize,
    longest_s: f64,
    longest_at_s: Option<f64>,
    /// Since when nothing was heard, s.
    since_s: Option<f64>,
    lost_since: bool,
}

impl Gaps {
    fn note(&mut self, time_s: f64, heard: bool) {
        self.sent += 1;
        self.lost += usize::from(!heard);
        self.lost_since |= !heard;
        let since_s = *self.since_s.get_or_insert(time_s);
        // A gap that does not end counts too.
        if self.lost_since && time_s - since_s > self.longest_s {
            (self.longest_s, self.longest_at_s) = (time_s - since_s, Some(since_s));
        }
        if heard {
            self.since_s = Some(time_s);
            self.lost_since = false;
        }
    }
}
