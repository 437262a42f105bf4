//! The same frame over several links: heard once.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::frame::Frame;
use crate::identity::Address;

/// A frame may come later over one link than over another by this much; a SiK radio lags by some 0.3 s, one that is
/// given more than it carries by seconds. A copy that is not known for one would be obeyed again.
const WITHIN: Duration = Duration::from_secs(10);
/// Numbers come round after 256 frames; a frame that says the same as the one before it with its number is no copy then.
const WITHIN_FRAMES: u64 = 200;
/// Sources remembered at most; a forged flood of ids cannot grow memory.
const MAX_SOURCES: usize = 16;

/// One frame, as it was first heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Seen {
    at: Duration,
    /// How many frames of its source were heard before it.
    nth: u64,
    link: usize,
    message_id: u32,
    crc: u16,
}

/// Tells copies apart from news.
///
/// Every component numbers its frames over all its links together, so a copy has the number and the checksum of a
/// frame that came over another link just now. What comes twice over the same link is no copy: its sender meant it,
/// or numbers nothing.
#[derive(Debug, Default)]
pub struct Duplicates {
    sources: BTreeMap<Address, Source>,
}

/// What was heard of a source: its last frame of each number, and how many frames in all.
#[derive(Debug)]
struct Source {
    ring: Vec<Option<Seen>>,
    heard: u64,
}

impl Duplicates {
    /// Nothing heard yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes note of a frame; says whether it is a copy.
    pub fn is_copy(&mut self, frame: &Frame, link: usize, now: Duration) -> bool {
        let source = frame.source();
        if !self.sources.contains_key(&source) && self.sources.len() >= MAX_SOURCES {
            return false;
        }
        let of = self.sources.entry(source).or_insert_with(|| Source { ring: vec![None; 256], heard: 0 });
        let place = &mut of.ring[usize::from(frame.sequence())];
        let heard = Seen { at: now, nth: of.heard, link, message_id: frame.message_id(), crc: frame.crc() };
        let is_copy = place.is_some_and(|seen| {
            seen.link != link
                && now.saturating_sub(seen.at) <= WITHIN
                && heard.nth - seen.nth < WITHIN_FRAMES
                && (seen.message_id, seen.crc) == (heard.message_id, heard.crc)
        });
        if !is_copy {
            *place = Some(heard);
            of.heard += 1;
        }
        is_copy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::{HEARTBEAT_DATA, MavMessage};
    use crate::frame::Encoder;
    use crate::identity::VEHICLE;

    #[test]
    fn a_copy_comes_over_another_link_and_soon() {
        let mut encoder = Encoder::new(VEHICLE);
        let mut beat = || encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let (first, second) = (beat(), beat());
        let mut duplicates = Duplicates::new();
        let at = |ms| Duration::from_millis(ms);
        assert!(!duplicates.is_copy(&first, 0, at(0)));
        assert!(!duplicates.is_copy(&second, 1, at(10)), "another frame");
        assert!(duplicates.is_copy(&first, 1, at(300)));
        assert!(duplicates.is_copy(&first, 2, at(400)), "a third link");
        assert!(!duplicates.is_copy(&first, 0, at(500)), "again over its own link");
        assert!(duplicates.is_copy(&first, 1, at(9_000)), "over a link that lags far behind");
        assert!(!duplicates.is_copy(&first, 1, at(11_000)), "the number has come round again");
    }

    #[test]
    fn a_number_that_has_come_round_is_no_copy_however_soon() {
        let mut encoder = Encoder::new(VEHICLE);
        let mut duplicates = Duplicates::new();
        for frame in 0..1_000 {
            let beat = encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            assert!(!duplicates.is_copy(&beat, frame % 2, Duration::from_millis(frame as u64)), "{frame}");
        }
    }

    #[test]
    fn a_forged_flood_of_ids_is_bounded() {
        let mut duplicates = Duplicates::new();
        for system_id in 1..=255 {
            let source = Address { system_id, component_id: 1 };
            let frame = Encoder::new(source).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            duplicates.is_copy(&frame, 0, Duration::ZERO);
        }
        assert_eq!(duplicates.sources.len(), MAX_SOURCES);
    }
}
