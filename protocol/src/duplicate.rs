//! Detects a frame that arrives over several links, so that it is handled once.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use core::time::Duration;

use crate::frame::Frame;
use crate::identity::Address;

/// A frame may arrive this much later over one link than over another. A SiK radio lags by about 0.3 s; an overloaded
/// link lags by seconds. If a copy were not detected, its command would be executed again.
const MAX_DELAY: Duration = Duration::from_secs(10);
/// Sequence numbers repeat after 256 frames. After this many frames, a frame with the same number and content is a
/// new one.
const MAX_FRAMES_APART: u64 = 200;
/// At most this many sources are remembered, so that a flood of forged ids cannot fill the memory.
const MAX_SOURCES: usize = 16;

/// A frame at its first arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct LastCopy {
    at: Duration,
    /// How many frames of its source arrived before it.
    nth: u64,
    link: usize,
    operator: u8,
    message_id: u32,
    crc: u16,
}

/// Tells copies apart from new frames.
///
/// A component numbers its frames once for all links, so a copy has the sequence number and the checksum of a frame
/// that arrived over another link shortly before. A frame that arrives twice over the same link is no copy: its
/// sender sent it twice, or does not number its frames.
#[derive(Debug, Default)]
pub struct Duplicates {
    sources: BTreeMap<Address, SourceHistory>,
}

/// The last frame of each sequence number of a source, and how many frames arrived from it.
#[derive(Debug)]
struct SourceHistory {
    ring: Vec<Option<LastCopy>>,
    heard: u64,
}

impl Duplicates {
    pub fn new() -> Self {
        Self::default()
    }

    /// Notes a frame that this operator has signed (0: the shared key, or none) and returns whether it is a copy. Nobody
    /// can turn another one's frame into a copy.
    pub fn is_copy(&mut self, frame: &Frame, operator: u8, link: usize, now: Duration) -> bool {
        let source = frame.source();
        if !self.sources.contains_key(&source) && self.sources.len() >= MAX_SOURCES {
            return false;
        }
        let of =
            self.sources.entry(source).or_insert_with(|| SourceHistory { ring: vec![None; 256], heard: 0 });
        let place = &mut of.ring[usize::from(frame.sequence())];
        let heard = LastCopy {
            at: now,
            nth: of.heard,
            link,
            operator,
            message_id: frame.message_id(),
            crc: frame.crc(),
        };
        let is_copy = place.is_some_and(|seen| {
            seen.link != link
                && now.saturating_sub(seen.at) <= MAX_DELAY
                && heard.nth - seen.nth < MAX_FRAMES_APART
                && (seen.operator, seen.message_id, seen.crc) == (heard.operator, heard.message_id, heard.crc)
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
    fn a_copy_arrives_soon_and_over_another_link() {
        let mut encoder = Encoder::new(VEHICLE);
        let mut beat = || encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let (first, second) = (beat(), beat());
        let mut duplicates = Duplicates::new();
        let at = |ms| Duration::from_millis(ms);
        assert!(!duplicates.is_copy(&first, 0, 0, at(0)));
        assert!(!duplicates.is_copy(&second, 0, 1, at(10)), "it is another frame");
        assert!(duplicates.is_copy(&first, 0, 1, at(300)));
        assert!(duplicates.is_copy(&first, 0, 2, at(400)), "it arrives over a third link");
        assert!(!duplicates.is_copy(&first, 0, 0, at(500)), "it arrives again over its own link");
        assert!(duplicates.is_copy(&first, 0, 1, at(9_000)), "it arrives over a link that lags far behind");
        assert!(
            !duplicates.is_copy(&first, 0, 1, at(11_000)),
            "the sequence number may have been used again"
        );
    }

    #[test]
    fn a_repeated_sequence_number_is_no_copy() {
        let mut encoder = Encoder::new(VEHICLE);
        let mut duplicates = Duplicates::new();
        for frame in 0..1_000 {
            let beat = encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            assert!(!duplicates.is_copy(&beat, 0, frame % 2, Duration::from_millis(frame as u64)), "{frame}");
        }
    }

    #[test]
    fn a_flood_of_forged_ids_does_not_fill_the_memory() {
        let mut duplicates = Duplicates::new();
        for system_id in 1..=255 {
            let source = Address { system_id, component_id: 1 };
            let frame = Encoder::new(source).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            duplicates.is_copy(&frame, 0, 0, Duration::ZERO);
        }
        assert_eq!(duplicates.sources.len(), MAX_SOURCES);
    }
}
