//! Detects a frame that arrives over several links, so that it is handled once.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use core::time::Duration;

use crate::frame::Frame;
use crate::identity::Address;

/// A frame may arrive this much later over one link than over another. A SiK radio lags by about
/// 0.3 s; an overloaded link, or all of them after the computer slept, by seconds. If a copy were
/// not detected, its command would be executed again.
const MAX_DELAY: Duration = Duration::from_secs(10);
/// So many frames with the same number are remembered: 4,096 of a source, more than it sends in
/// that time.
const MAX_OF_A_NUMBER: usize = 16;
/// At most this many sources are remembered, so that a flood of forged ids cannot fill the memory.
const MAX_SOURCES: usize = 16;

/// A frame at its first arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FirstArrival {
    at: Duration,
    /// The links over which it has arrived, a bit each.
    links: u64,
    operator: u8,
    message_id: u32,
    crc: u16,
}

/// Distinguishes copies from new frames.
///
/// A component numbers its frames once for all links, so a copy has the sequence number and the
/// checksum of a frame that arrived over other links shortly before, and not over this one. A frame
/// that arrives twice over the same link is no copy: its sender sent it twice, has used all its
/// numbers since, or does not number its frames.
#[derive(Debug, Default)]
pub struct Duplicates {
    /// Of each source the frames that may still have copies, by sequence number, oldest first.
    sources: BTreeMap<Address, Vec<Vec<FirstArrival>>>,
}

impl Duplicates {
    pub fn new() -> Self {
        Self::default()
    }

    /// Notes a frame that this operator has signed (0: the shared key, or none) and returns whether
    /// it is a copy. A frame cannot be marked as a copy by another key. Over a link from the 65th on
    /// nothing is a copy.
    pub fn is_copy(&mut self, frame: &Frame, operator: u8, link: usize, now: Duration) -> bool {
        let source = frame.source();
        if !self.sources.contains_key(&source) && self.sources.len() >= MAX_SOURCES {
            return false;
        }
        let of = self.sources.entry(source).or_insert_with(|| vec![Vec::new(); 256]);
        let arrivals = &mut of[usize::from(frame.sequence())];
        arrivals.retain(|earlier| now.saturating_sub(earlier.at) <= MAX_DELAY);
        let over = u32::try_from(link).ok().and_then(|link| 1_u64.checked_shl(link)).unwrap_or(0);
        let content = (operator, frame.message_id(), frame.crc());
        let first = arrivals.iter_mut().find(|earlier| {
            earlier.links & over == 0 && (earlier.operator, earlier.message_id, earlier.crc) == content
        });
        match first {
            Some(first) if over != 0 => {
                first.links |= over;
                true
            }
            _ => {
                if arrivals.len() >= MAX_OF_A_NUMBER {
                    arrivals.remove(0);
                }
                let (operator, message_id, crc) = content;
                arrivals.push(FirstArrival { at: now, links: over, operator, message_id, crc });
                false
            }
        }
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

    /// A computer that slept reads some seconds of each link at once: more frames than there are
    /// numbers.
    #[test]
    fn a_link_that_is_read_long_after_another_one_has_copies_alone() {
        let mut encoder = Encoder::new(VEHICLE);
        let frames: Vec<_> = (0..1_000)
            .map(|mode| {
                let beat = HEARTBEAT_DATA { custom_mode: mode / 600, ..HEARTBEAT_DATA::default() };
                encoder.encode(&MavMessage::HEARTBEAT(beat))
            })
            .collect();
        let mut duplicates = Duplicates::new();
        for link in 0..3 {
            for (nth, frame) in frames.iter().enumerate() {
                let now = Duration::from_secs(link as u64);
                assert_eq!(duplicates.is_copy(frame, 0, link, now), link > 0, "frame {nth} over link {link}");
            }
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
