//! Decides which pieces to ask for: a burst where much is missing, and meanwhile single pieces for the gaps that it
//! has left. So the line always has something to carry, also while a lost request is noticed.

use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::ops::Range;
use core::time::Duration;

use crate::ftp::packet::{DATA_LEN, Opcode, Packet};
use crate::ftp::ranges::Ranges;

/// Most single pieces that are asked for at once: about what a line of 57,600 baud carries in 0.7 s.
const MOST_READS: usize = 16;
/// A shorter gap is fetched in single pieces.
const LONG: u32 = 8 * DATA_LEN as u32;
/// A piece is lost when this many that were asked for later have arrived.
const OVERTAKEN: u32 = 3;
/// A burst has ended when this many single pieces have arrived without one of it.
const WITHOUT_BURST: u32 = 8;
/// A burst has ended after this many times the usual interval without any piece, within these bounds.
const SILENT_INTERVALS: u32 = 12;
const SILENT_LEAST: Duration = Duration::from_millis(500);
const SILENT_MOST: Duration = Duration::from_secs(4);
/// A burst that has brought this many known pieces in a row is stopped.
const KNOWN_IN_A_ROW: u32 = 4;
/// A request for a burst is sent again after this long without a piece of it.
const BURST_AGAIN: Duration = Duration::from_millis(700);
/// A burst is prolonged each time that this many of its pieces were sent. Half of the requests may be lost: a vehicle
/// ends a burst after some hundred pieces.
const PROLONGED_EVERY: u16 = 32;
/// How far ahead a burst is prolonged, bytes: behind what is on its way.
const PROLONGED_AHEAD: u32 = 96 * DATA_LEN as u32;
/// The last pieces are asked for again after this long, because nothing else is under way.
const LAST_PIECES: usize = 4;
const LAST_PIECES_AGAIN: Duration = Duration::from_millis(900);
/// A longer interval is no pace of the vehicle, but a stop.
const STOP: Duration = Duration::from_secs(1);
/// Assumed before the first measurement.
const FIRST_INTERVAL: Duration = Duration::from_millis(150);
const FIRST_ROUND_TRIP: Duration = Duration::from_secs(1);

#[derive(Debug, Clone)]
struct Burst {
    request: Packet,
    sent_at: Duration,
    begun: bool,
    /// The number of its piece after which it was prolonged last.
    prolonged: u16,
    /// The number of its farthest piece.
    number: u16,
    /// When it was asked for, or when its last piece arrived.
    heard_at: Duration,
    /// The end of its farthest piece.
    front: u32,
    others_since: u32,
    known_in_a_row: u32,
    over: bool,
}

#[derive(Debug, Clone)]
struct Read {
    sequence: u16,
    range: Range<u32>,
    sent_at: Duration,
    overtaken: u32,
}

/// What is under way.
#[derive(Debug, Clone)]
pub(super) struct Pieces {
    burst: Option<Burst>,
    /// In the order in which they were asked for.
    reads: VecDeque<Read>,
    last_at: Option<Duration>,
    interval: Duration,
    round_trip: Duration,
    /// A burst of pieces that are known is to be stopped.
    stop: bool,
}

impl Default for Pieces {
    fn default() -> Self {
        Self {
            burst: None,
            reads: VecDeque::new(),
            last_at: None,
            interval: FIRST_INTERVAL,
            round_trip: FIRST_ROUND_TRIP,
            stop: false,
        }
    }
}

/// A mean that forgets: an eighth is new.
fn smoothed(mean: Duration, new: Duration) -> Duration {
    (mean * 7 + new) / 8
}

impl Pieces {
    /// A piece has arrived; `known`: all of it was there already.
    pub(super) fn on_piece(&mut self, packet: &Packet, range: &Range<u32>, known: bool, now: Duration) {
        if let Some(last_at) = self.last_at.replace(now) {
            let interval = now.saturating_sub(last_at);
            if interval < STOP {
                self.interval = smoothed(self.interval, interval);
            }
        }
        if packet.asked == Opcode::BurstReadFile {
            let Some(burst) = &mut self.burst else { return };
            // The pieces of an earlier burst are welcome, but say nothing about this one.
            let number = packet.sequence.wrapping_sub(burst.request.sequence);
            if number > i16::MAX as u16 && range.start < burst.front {
                return;
            }
            burst.begun = true;
            burst.number = number;
            burst.heard_at = now;
            burst.front = burst.front.max(range.end);
            burst.others_since = 0;
            burst.known_in_a_row = if known { burst.known_in_a_row + 1 } else { 0 };
            burst.over |= packet.burst_complete;
            if burst.known_in_a_row >= KNOWN_IN_A_ROW {
                (burst.over, self.stop) = (true, true);
            }
            return;
        }
        if let Some(burst) = &mut self.burst {
            burst.others_since += 1;
        }
        let Some(place) = self.reads.iter().position(|read| read.sequence.wrapping_add(1) == packet.sequence)
        else {
            return;
        };
        if let Some(read) = self.reads.remove(place) {
            self.round_trip = smoothed(self.round_trip, now.saturating_sub(read.sent_at));
        }
        for earlier in self.reads.iter_mut().take(place) {
            earlier.overtaken += 1;
        }
    }

    /// The vehicle says that it has nothing behind an offset.
    pub(super) fn on_end(&mut self, packet: &Packet) {
        if packet.asked == Opcode::BurstReadFile
            && let Some(burst) = &mut self.burst
        {
            burst.over = true;
        }
    }

    /// What to ask for now.
    pub(super) fn poll(
        &mut self,
        have: &Ranges,
        len: u32,
        session: u8,
        sequence: &mut u16,
        now: Duration,
    ) -> Vec<Packet> {
        let mut ask = |opcode, range: &Range<u32>| {
            let size = (range.end - range.start).min(DATA_LEN as u32) as u8;
            let packet = Packet { size, ..Packet::request(*sequence, session, opcode, range.start, "") };
            *sequence = sequence.wrapping_add(1);
            packet
        };
        let mut asked = Vec::new();
        // The same request again does not begin again what is under way.
        if let Some(burst) = self.burst.as_mut().filter(|burst| !burst.begun)
            && now.saturating_sub(burst.sent_at) >= BURST_AGAIN
        {
            burst.sent_at = now;
            asked.push(burst.request.clone());
        }
        if let Some(burst) = self.burst.as_mut().filter(|burst| burst.begun && !burst.over)
            && burst.number.wrapping_sub(burst.prolonged) >= PROLONGED_EVERY
            && burst.front < len.saturating_sub(PROLONGED_AHEAD)
        {
            burst.prolonged = burst.number;
            let ahead = burst.front + PROLONGED_AHEAD;
            asked.push(ask(Opcode::BurstReadFile, &(ahead..ahead.saturating_add(DATA_LEN as u32))));
        }
        let silent =
            (self.interval * SILENT_INTERVALS).max(self.round_trip * 2).clamp(SILENT_LEAST, SILENT_MOST);
        self.burst = self.burst.take().filter(|burst| {
            let silent = burst.begun && now.saturating_sub(burst.heard_at) >= silent;
            !(burst.over || silent || (burst.begun && burst.others_since >= WITHOUT_BURST))
        });
        if self.burst.is_none() {
            let long = have.missing(len).find(|gap| gap.end - gap.start >= LONG);
            if let Some(gap) = long {
                let packet = ask(Opcode::BurstReadFile, &gap);
                self.burst = Some(Burst {
                    request: packet.clone(),
                    sent_at: now,
                    begun: false,
                    prolonged: 0,
                    number: 0,
                    heard_at: now,
                    front: gap.start,
                    others_since: 0,
                    known_in_a_row: 0,
                    over: false,
                });
                asked.push(packet);
            } else if self.stop {
                // A burst at the end of the file replaces the one under way.
                asked.push(Packet { size: DATA_LEN as u8, ..ask(Opcode::BurstReadFile, &(len..len)) });
            }
            self.stop = false;
        }
        let patience = (self.round_trip * 3).clamp(SILENT_LEAST * 2, SILENT_MOST * 2);
        let last = self.burst.is_none() && self.reads.len() <= LAST_PIECES;
        let patience = if last { patience.min(LAST_PIECES_AGAIN) } else { patience };
        self.reads.retain(|read| {
            read.overtaken < OVERTAKEN
                && now.saturating_sub(read.sent_at) < patience
                && !have.contains(&read.range)
        });
        let front = self.burst.as_ref().map_or(len, |burst| burst.front);
        for gap in have.missing(front) {
            let mut from = gap.start;
            while from < gap.end {
                if self.reads.len() >= MOST_READS {
                    return asked;
                }
                let piece = from..gap.end.min(from.saturating_add(DATA_LEN as u32));
                from = piece.end;
                let waits = |read: &Read| read.range.start < piece.end && piece.start < read.range.end;
                if self.reads.iter().any(waits) {
                    continue;
                }
                let packet = ask(Opcode::ReadFile, &piece);
                self.reads.push_back(Read {
                    sequence: packet.sequence,
                    range: piece,
                    sent_at: now,
                    overtaken: 0,
                });
                asked.push(packet);
            }
        }
        asked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_bytes_of_the_longest_possible_file_are_asked_for() {
        let mut have = Ranges::default();
        have.add(0..u32::MAX - 5);
        let asked = Pieces::default().poll(&have, u32::MAX, 0, &mut 0, Duration::ZERO);
        assert_eq!(asked.len(), 1, "{asked:?}");
        assert_eq!((asked[0].offset, asked[0].size), (u32::MAX - 5, 5));
    }
}
