//! Combines several links to the same peer, without I/O: it takes the bytes of each link and
//! returns frames and link events; it takes a frame and returns the bytes for each link.
//!
//! A frame that arrives over more than one link is passed on once. With a key, a frame without a
//! valid signature is not passed on. Every link has its own framing and its own statistics.

pub mod line;

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::net::SocketAddr;
use core::time::Duration;

use self::line::Line;
use crate::duplicate::{Arrival, Duplicates};
use crate::frame::{Frame, Framer, FramerCounters, SIGNATURE_LEN};
use crate::identity::RADIO;
use crate::link_stats::LinkStats;
use crate::signing::{Rejection, Signing, SigningCounters};

const RADIO_STATUS_ID: u32 = 109;
/// Of RADIO_STATUS: where the free share of the radio's buffer is.
const TXBUF_AT: usize = 6;

/// This many streams of one link may be open at the same time.
const MAX_STREAMS: usize = 8;

/// Something that happened on a link.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkEvent {
    /// A valid frame, received for the first time.
    Frame(Frame),
    /// A frame that had already arrived over another link.
    Copy(Frame),
    /// A frame whose signature is missing or wrong although a key is set; it must not be acted on.
    Rejected(Frame, Rejection),
    /// A frame of this sender was accepted; that frame follows. The caller must pass this on to the
    /// link (`transport::TransportSender::accept`).
    Accepted(Origin),
    /// Some senders are not answered by the link; the text gives their number.
    UnknownSenders(String),
    /// The link works; the text names the peer.
    Up(String),
    /// The link does not work; the text gives the reason.
    Down(String),
}

#[derive(Debug, Default)]
pub struct HubLink {
    datagrams: Framer,
    streams: BTreeMap<StreamId, Framer>,
    /// Counters of the streams that have ended.
    ended_streams: FramerCounters,
    stats: LinkStats,
    trouble: Option<String>,
    copies: u64,
    /// Queue of a link of a known speed.
    line: Option<Line>,
}

impl HubLink {
    /// Returns how many frames were dropped because the line is too slow for them.
    pub fn dropped(&self) -> u64 {
        self.line.as_ref().map_or(0, Line::dropped)
    }

    pub fn stats(&self) -> &LinkStats {
        &self.stats
    }

    /// Returns the framing counters of all streams of this link.
    pub fn framing(&self) -> FramerCounters {
        let mut sum = self.ended_streams;
        for framer in self.streams.values().chain([&self.datagrams]) {
            sum += framer.counters();
        }
        sum
    }

    /// Returns why the link does not work, if it does not.
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Returns how many frames had already arrived over another link.
    pub fn copies(&self) -> u64 {
        self.copies
    }

    fn take(&mut self, received: Received, now: Duration) -> Taken {
        let (framer, bytes, origin) = match received {
            Received::Datagram { from, bytes } => {
                self.datagrams.push_datagram(&bytes);
                (&mut self.datagrams, bytes.len(), Origin::Datagram(from))
            }
            Received::Stream(id, bytes) => {
                if self.streams.len() >= MAX_STREAMS && !self.streams.contains_key(&id) {
                    // The transport opens no more streams than this; the bytes of a further one are
                    // dropped.
                    return Taken::Nothing;
                }
                let framer = self.streams.entry(id).or_default();
                framer.push(&bytes);
                (framer, bytes.len(), Origin::Stream(id))
            }
            Received::Silence(id) => match self.streams.get_mut(&id) {
                Some(framer) => {
                    framer.on_silence();
                    (framer, 0, Origin::Stream(id))
                }
                None => return Taken::Nothing,
            },
            Received::Gone(id) => {
                if let Some(framer) = self.streams.remove(&id) {
                    self.ended_streams += framer.counters();
                }
                return Taken::Nothing;
            }
            Received::UnknownSenders(words) => return Taken::LinkEvent(LinkEvent::UnknownSenders(words)),
            Received::Up(peer) => {
                self.trouble = None;
                return Taken::LinkEvent(LinkEvent::Up(peer));
            }
            Received::Down(why) => {
                self.trouble = Some(why.clone());
                return Taken::LinkEvent(LinkEvent::Down(why));
            }
        };
        let frames: Vec<Frame> = core::iter::from_fn(|| framer.next_frame()).collect();
        if bytes > 0 {
            self.stats.on_rx_bytes(bytes, now);
        }
        Taken::Frames(frames, origin)
    }
}

enum Taken {
    Nothing,
    LinkEvent(LinkEvent),
    Frames(Vec<Frame>, Origin),
}

#[derive(Debug)]
pub struct Hub {
    links: Vec<HubLink>,
    duplicates: Duplicates,
    signing: Option<Signing>,
}

impl Hub {
    /// Creates this many links. With `signing`, frames that are sent are signed and frames that
    /// arrive are checked.
    pub fn new(links: usize, signing: Option<Signing>) -> Self {
        Self {
            links: (0..links).map(|_| HubLink::default()).collect(),
            duplicates: Duplicates::default(),
            signing,
        }
    }

    /// Sets the capacity of each link, bytes per second, where available. Frames wait for such a
    /// link in the hub.
    #[must_use]
    pub fn over(mut self, carried_bytes_s: &[Option<u32>]) -> Self {
        let added = if self.signing.is_some() { SIGNATURE_LEN } else { 0 };
        for (link, carried) in self.links.iter_mut().zip(carried_bytes_s) {
            link.line = carried.map(|bytes_s| Line::new(bytes_s, added));
        }
        self
    }

    /// The links, ordered by their numbers.
    pub fn links(&self) -> &[HubLink] {
        &self.links
    }

    /// Takes received data of a link. `clock` is the wall clock as a timestamp
    /// ([`crate::signing::stamp_of`]), which only signatures need. An unknown link number is
    /// ignored.
    pub fn take(&mut self, link: usize, received: Received, now: Duration, clock: u64) -> Vec<LinkEvent> {
        let Some(of) = self.links.get_mut(link) else { return Vec::new() };
        let (frames, origin) = match of.take(received, now) {
            Taken::Nothing => return Vec::new(),
            Taken::LinkEvent(news) => return vec![news],
            Taken::Frames(frames, origin) => (frames, origin),
        };
        let mut news: Vec<LinkEvent> =
            frames.into_iter().map(|frame| self.judge(link, frame, now, clock)).collect();
        if news.iter().any(|news| self.proves_its_sender(news)) {
            news.insert(0, LinkEvent::Accepted(origin));
        }
        news
    }

    /// With a key the frame must be signed: a radio's report is accepted unsigned, and anybody can
    /// forge one.
    fn proves_its_sender(&self, news: &LinkEvent) -> bool {
        match news {
            LinkEvent::Frame(frame) | LinkEvent::Copy(frame) => self.signing.is_none() || frame.is_signed(),
            _ => false,
        }
    }

    fn judge(&mut self, link: usize, frame: Frame, now: Duration, clock: u64) -> LinkEvent {
        // A radio has no key: the report about itself is the only message that is accepted
        // unsigned, and only on a serial line, where the radio is. Over a network anyone could
        // claim that a radio is full.
        let is_the_radio_s = frame.message_id() == RADIO_STATUS_ID && self.links[link].line.is_some();
        if let Some(signing) = &mut self.signing
            && (frame.is_signed() || !is_the_radio_s)
            && let Err(rejection) = signing.check(&frame, clock)
        {
            return LinkEvent::Rejected(frame, rejection);
        }
        if frame.message_id() == RADIO_STATUS_ID
            && frame.source() == RADIO
            && let Some(line) = &mut self.links[link].line
        {
            line.radio.on_report(frame.padded_payload()[TXBUF_AT], now);
        }
        // The signature is checked first: a forged frame must not turn the true one into a copy.
        let operator = self.signing.as_ref().map_or(0, |signing| signing.operator_of(&frame));
        let arrival = self.duplicates.arrival(&frame, operator, link, now);
        // A rejected frame is no sign of life either, so it does not count in the statistics. One
        // that arrives again would count as 255 lost ones.
        if arrival != Arrival::Again {
            self.links[link].stats.on_frame(&frame, now);
        }
        if arrival != Arrival::New {
            self.links[link].copies += 1;
            return LinkEvent::Copy(frame);
        }
        LinkEvent::Frame(frame)
    }

    /// Returns the bytes of a frame for one link; with a key they are signed for this link alone.
    pub fn bytes_for(&mut self, link: usize, frame: &Frame, clock: u64) -> Vec<u8> {
        match &mut self.signing {
            Some(signing) => signing.sign(frame, signing.link_id(link), clock).as_bytes().to_vec(),
            None => frame.as_bytes().to_vec(),
        }
    }

    /// Takes a frame for a link. Without a known speed it leaves at once, otherwise when the line
    /// is free for it: [`Hub::leaving`].
    pub fn send(&mut self, link: usize, frame: &Frame, clock: u64) -> Option<Vec<u8>> {
        match &mut self.links.get_mut(link)?.line {
            Some(line) => {
                line.push(frame.clone());
                None
            }
            None => Some(self.bytes_for(link, frame, clock)),
        }
    }

    /// Returns the frame that leaves over a link of a known speed now, and its bytes. Call it until
    /// it returns `None`, after [`Hub::send`] and at [`Hub::due_at`].
    pub fn leaving(&mut self, link: usize, now: Duration, clock: u64) -> Option<(Frame, Vec<u8>)> {
        let frame = self.links.get_mut(link)?.line.as_mut()?.pop(now)?;
        let bytes = self.bytes_for(link, &frame, clock);
        Some((frame, bytes))
    }

    /// Returns when a waiting frame may leave; `None` if none waits.
    pub fn due_at(&self) -> Option<Duration> {
        self.links.iter().filter_map(|link| link.line.as_ref()?.due_at()).min()
    }

    /// Counts bytes that a link has sent.
    pub fn on_sent(&mut self, link: usize, bytes: usize, now: Duration) {
        if let Some(of) = self.links.get_mut(link) {
            of.stats.on_tx_bytes(bytes, now);
        }
    }

    /// Returns how many frames were accepted and rejected; `None` without a key.
    pub fn signing(&self) -> Option<SigningCounters> {
        self.signing.as_ref().map(Signing::counters)
    }

    /// Returns the timestamps that must survive a restart; `None` without a key.
    pub fn signing_memory(&self) -> Option<crate::signing::Memory> {
        self.signing.as_ref().map(Signing::memory)
    }
}

// Interface from a transport to the hub.

/// The number of one stream of a link. A TCP server has a stream for each client. Numbers are not
/// used twice.
pub type StreamId = u64;

/// The sender of some bytes, as distinguished by its link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Datagram(SocketAddr),
    Stream(StreamId),
}

/// Data received by a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// One datagram. A frame never continues in the next datagram.
    Datagram {
        /// The address that the datagram names as its sender, which may be forged.
        from: SocketAddr,
        bytes: Vec<u8>,
    },
    /// A piece of a byte stream.
    Stream(StreamId, Vec<u8>),
    /// The stream has paused for longer than a frame may; an incomplete frame will stay incomplete.
    Silence(StreamId),
    Gone(StreamId),
    /// Some senders are not answered by the link; the text gives their number. Sent at most once in
    /// ten seconds.
    UnknownSenders(String),
    /// The link works; the text names the peer.
    Up(String),
    /// The link does not work; the text gives the reason. The transport retries.
    Down(String),
}

impl Received {
    /// The sender of received bytes; `None` for news of the link itself.
    pub fn origin(&self) -> Option<Origin> {
        match self {
            Self::Datagram { from, .. } => Some(Origin::Datagram(*from)),
            Self::Stream(id, _) | Self::Silence(id) => Some(Origin::Stream(*id)),
            Self::Gone(_) | Self::UnknownSenders(_) | Self::Up(_) | Self::Down(_) => None,
        }
    }
}

#[cfg(test)]
mod tests;
