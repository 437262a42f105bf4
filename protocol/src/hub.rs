//! Several links to one and the same peer, without I/O: bytes of each in, news out; one frame in, bytes for each out.
//!
//! Copies that come over more than one link are passed on once; what is not signed as it should be is not passed on
//! at all. Every link keeps its own framing and its own statistics.

mod received;

use std::collections::BTreeMap;
use std::time::Duration;

use crate::duplicate::Duplicates;
use crate::frame::{Frame, Framer, FramerCounters};
use crate::link::LinkStats;
use crate::signing::{Rejection, Signing, SigningCounters};

pub use received::{Origin, Peer, Received};

/// Streams of one link that may be open at the same time.
const MAX_STREAMS: usize = 8;

/// Something that a link brought.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// A frame that was not heard before, and is to be believed.
    Frame(Frame),
    /// A frame that was heard over another link already.
    Copy(Frame),
    /// A frame that is not to be acted on: signatures are wanted, and this one is missing or wrong.
    Rejected(Frame, Rejection),
    /// A frame of this sender was believed; comes before that frame. Its link is to be told
    /// (`transport::TransportSender::believe`).
    Believed(Origin),
    /// Others have sent to the link that are not answered; how many, in words.
    Strangers(String),
    /// The link works; with whom.
    Up(String),
    /// The link does not work; why.
    Down(String),
}

/// One link's state.
#[derive(Debug, Default)]
pub struct HubLink {
    datagrams: Framer,
    streams: BTreeMap<Peer, Framer>,
    /// Of streams that have ended.
    ended: FramerCounters,
    stats: LinkStats,
    trouble: Option<String>,
    copies: u64,
}

impl HubLink {
    /// Rates, loss and ages.
    pub fn stats(&self) -> &LinkStats {
        &self.stats
    }

    /// What framing threw away.
    pub fn framing(&self) -> FramerCounters {
        let mut sum = self.ended;
        for framer in self.streams.values().chain([&self.datagrams]) {
            sum += framer.counters();
        }
        sum
    }

    /// Why it does not work, if it does not.
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Frames that had come over another link already.
    pub fn copies(&self) -> u64 {
        self.copies
    }

    fn take(&mut self, received: Received, now: Duration) -> Taken {
        let (framer, bytes, origin) = match received {
            Received::Datagram { from, bytes } => {
                self.datagrams.push_datagram(&bytes);
                (&mut self.datagrams, bytes.len(), Origin::Datagram(from))
            }
            Received::Stream(peer, bytes) => {
                if self.streams.len() >= MAX_STREAMS && !self.streams.contains_key(&peer) {
                    // The driver opens no more; whoever does not keep to that is not framed.
                    return Taken::Nothing;
                }
                let framer = self.streams.entry(peer).or_default();
                framer.push(&bytes);
                (framer, bytes.len(), Origin::Stream(peer))
            }
            Received::Silence(peer) => match self.streams.get_mut(&peer) {
                Some(framer) => {
                    framer.on_silence();
                    (framer, 0, Origin::Stream(peer))
                }
                None => return Taken::Nothing,
            },
            Received::Gone(peer) => {
                if let Some(framer) = self.streams.remove(&peer) {
                    self.ended += framer.counters();
                }
                return Taken::Nothing;
            }
            Received::Strangers(words) => return Taken::News(News::Strangers(words)),
            Received::Up(peer) => {
                self.trouble = None;
                return Taken::News(News::Up(peer));
            }
            Received::Down(why) => {
                self.trouble = Some(why.clone());
                return Taken::News(News::Down(why));
            }
        };
        let frames: Vec<Frame> = std::iter::from_fn(|| framer.next_frame()).collect();
        if bytes > 0 {
            self.stats.on_rx_bytes(bytes, now);
        }
        Taken::Frames(frames, origin)
    }
}

enum Taken {
    Nothing,
    News(News),
    Frames(Vec<Frame>, Origin),
}

/// Several links to one peer.
#[derive(Debug)]
pub struct Hub {
    links: Vec<HubLink>,
    duplicates: Duplicates,
    signing: Option<Signing>,
}

impl Hub {
    /// As many links, none of which has carried anything yet; with a key, frames are signed and judged.
    pub fn new(links: usize, signing: Option<Signing>) -> Self {
        Self {
            links: (0..links).map(|_| HubLink::default()).collect(),
            duplicates: Duplicates::new(),
            signing,
        }
    }

    /// The links, in the order of their numbers.
    pub fn links(&self) -> &[HubLink] {
        &self.links
    }

    /// Takes what a link brought. `clock` is the wall clock's stamp ([`crate::signing::stamp_of`]), which only
    /// signatures need. A link that does not exist brings nothing.
    pub fn take(&mut self, link: usize, received: Received, now: Duration, clock: u64) -> Vec<News> {
        let Some(of) = self.links.get_mut(link) else { return Vec::new() };
        let (frames, origin) = match of.take(received, now) {
            Taken::Nothing => return Vec::new(),
            Taken::News(news) => return vec![news],
            Taken::Frames(frames, origin) => (frames, origin),
        };
        let mut news: Vec<News> =
            frames.into_iter().map(|frame| self.judge(link, frame, now, clock)).collect();
        if news.iter().any(|news| self.proves_its_sender(news)) {
            news.insert(0, News::Believed(origin));
        }
        news
    }

    /// With a key the frame must be signed with it: a radio's report passes unsigned, and anybody can write one.
    fn proves_its_sender(&self, news: &News) -> bool {
        match news {
            News::Frame(frame) | News::Copy(frame) => self.signing.is_none() || frame.is_signed(),
            _ => false,
        }
    }

    fn judge(&mut self, link: usize, frame: Frame, now: Duration, clock: u64) -> News {
        if let Some(signing) = &mut self.signing
            && let Err(rejection) = signing.check(&frame, clock)
        {
            return News::Rejected(frame, rejection);
        }
        // What is not believed is no sign of life either.
        self.links[link].stats.on_frame(&frame, now);
        // Judged first: a forged frame must not make the true one a copy.
        if self.duplicates.is_copy(&frame, link, now) {
            self.links[link].copies += 1;
            return News::Copy(frame);
        }
        News::Frame(frame)
    }

    /// The bytes of a frame for a link: signed for this link alone, if a key is set.
    pub fn bytes_for(&mut self, link: usize, frame: &Frame, clock: u64) -> Vec<u8> {
        match &mut self.signing {
            // Links beyond the 256th share an id, which costs nothing but statistics.
            Some(signing) => signing.sign(frame, link as u8, clock).as_bytes().to_vec(),
            None => frame.as_bytes().to_vec(),
        }
    }

    /// Takes note of bytes that a link took.
    pub fn on_sent(&mut self, link: usize, bytes: usize, now: Duration) {
        if let Some(of) = self.links.get_mut(link) {
            of.stats.on_tx_bytes(bytes, now);
        }
    }

    /// What was believed and what was not; `None` without a key.
    pub fn signing(&self) -> Option<SigningCounters> {
        self.signing.as_ref().map(Signing::counters)
    }

    /// What must outlive a restart; `None` without a key.
    pub fn signing_memory(&self) -> Option<crate::signing::Memory> {
        self.signing.as_ref().map(Signing::memory)
    }
}

#[cfg(test)]
mod tests;
