//! Detects a frame that arrives more than once, so that it is handled once.

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
/// A source that has sent fewer frames since cannot have used all its sequence numbers again,
/// unless half of its frames are lost.
const HALF_OF_THE_NUMBERS: u64 = 128;
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
    /// Number of new frames of its source until then.
    nth: u64,
    operator: u8,
    message_id: u32,
    crc: u16,
}

/// How a frame has arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    New,
    /// It has arrived before, over other links only.
    OverAnotherLink,
    /// It has arrived before over this link.
    Again,
}

/// Distinguishes copies from new frames.
///
/// A component numbers its frames once for all links, so a copy has the sequence number and the
/// checksum of a frame that arrived shortly before. Over the same link it is a copy only if the
/// numbers have gone back: otherwise its sender sent it twice, has used all its numbers since, or
/// does not number its frames.
#[derive(Debug, Default)]
pub struct Duplicates {
    sources: BTreeMap<Address, Source>,
}

#[derive(Debug)]
struct Source {
    /// The frames that may still have copies, by sequence number, oldest first.
    by_number: Vec<Vec<FirstArrival>>,
    /// Number of new frames.
    frames: u64,
    /// Sequence number of the newest frame.
    newest: u8,
}

impl Duplicates {
    /// Notes a frame that this operator has signed (0: the shared key, or none) and returns how it
    /// has arrived. No sender can turn the frame of another one into a copy. Over a link from the
    /// 65th on nothing is a copy.
    pub fn arrival(&mut self, frame: &Frame, operator: u8, link: usize, now: Duration) -> Arrival {
        let source = frame.source();
        if !self.sources.contains_key(&source) && self.sources.len() >= MAX_SOURCES {
            return Arrival::New;
        }
        let new = || Source { by_number: vec![Vec::new(); 256], frames: 0, newest: 0 };
        let Source { by_number, frames, newest } = self.sources.entry(source).or_insert_with(new);
        let arrivals = &mut by_number[usize::from(frame.sequence())];
        arrivals.retain(|earlier| now.saturating_sub(earlier.at) <= MAX_DELAY);
        let over = u32::try_from(link).ok().and_then(|link| 1_u64.checked_shl(link)).unwrap_or(0);
        let content = (operator, frame.message_id(), frame.crc());
        let went_back = *newest != frame.sequence();
        let first = arrivals.iter_mut().find(|earlier| {
            let may_repeat = went_back && *frames - earlier.nth < HALF_OF_THE_NUMBERS;
            (earlier.operator, earlier.message_id, earlier.crc) == content
                && (earlier.links & over == 0 || may_repeat)
        });
        match first {
            Some(first) if over != 0 && first.links & over == 0 => {
                first.links |= over;
                Arrival::OverAnotherLink
            }
            Some(_) if over != 0 => Arrival::Again,
            _ => {
                if arrivals.len() >= MAX_OF_A_NUMBER {
                    arrivals.remove(0);
                }
                let (operator, message_id, crc) = content;
                (*frames, *newest) = (*frames + 1, frame.sequence());
                arrivals.push(FirstArrival { at: now, links: over, nth: *frames, operator, message_id, crc });
                Arrival::New
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

    fn is_copy(of: &mut Duplicates, frame: &Frame, operator: u8, link: usize, now: Duration) -> bool {
        of.arrival(frame, operator, link, now) != Arrival::New
    }

    #[test]
    fn a_copy_arrives_soon_and_over_another_link() {
        let mut encoder = Encoder::new(VEHICLE);
        let mut beat = || encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let (first, second) = (beat(), beat());
        let mut duplicates = Duplicates::default();
        let at = |ms| Duration::from_millis(ms);
        assert!(!is_copy(&mut duplicates, &first, 0, 0, at(0)));
        assert!(!is_copy(&mut duplicates, &second, 0, 1, at(10)), "it is another frame");
        assert!(is_copy(&mut duplicates, &first, 0, 1, at(300)));
        assert!(is_copy(&mut duplicates, &first, 0, 2, at(400)), "it arrives over a third link");
        assert!(is_copy(&mut duplicates, &first, 0, 0, at(500)), "it arrives late, again over its own link");
        assert!(!is_copy(&mut duplicates, &second, 0, 1, at(600)), "its sender does not number its frames");
        assert!(
            is_copy(&mut duplicates, &first, 0, 1, at(9_000)),
            "it arrives over a link that lags far behind"
        );
        assert!(
            !is_copy(&mut duplicates, &first, 0, 1, at(11_000)),
            "the sequence number may have been used again"
        );
    }

    #[test]
    fn a_repeated_sequence_number_is_no_copy() {
        let mut encoder = Encoder::new(VEHICLE);
        let mut duplicates = Duplicates::default();
        for frame in 0..1_000 {
            let beat = encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            assert!(
                !is_copy(&mut duplicates, &beat, 0, frame % 2, Duration::from_millis(frame as u64)),
                "{frame}"
            );
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
        let mut duplicates = Duplicates::default();
        for link in 0..3 {
            for (nth, frame) in frames.iter().enumerate() {
                let now = Duration::from_secs(link as u64);
                assert_eq!(
                    is_copy(&mut duplicates, frame, 0, link, now),
                    link > 0,
                    "frame {nth} over link {link}"
                );
            }
        }
    }

    #[test]
    fn a_flood_of_forged_ids_does_not_fill_the_memory() {
        let mut duplicates = Duplicates::default();
        for system_id in 1..=255 {
            let source = Address { system_id, component_id: 1 };
            let frame = Encoder::new(source).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            is_copy(&mut duplicates, &frame, 0, 0, Duration::ZERO);
        }
        assert_eq!(duplicates.sources.len(), MAX_SOURCES);
    }
}
