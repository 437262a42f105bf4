//! Finds frames with a correct checksum in bytes, however the bytes are split into pieces.

use alloc::vec::Vec;
use core::ops::Range;

use super::{CRC_LEN, Frame, FrameView, HEADER_LEN, INCOMPAT_SIGNED, MAGIC, SIGNATURE_LEN, crc_extra};

/// What a [`Framer`] has accepted and rejected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct FramerCounters {
    /// Frames with a correct CRC.
    pub frames: u64,
    /// Candidates whose CRC was wrong.
    pub crc_errors: u64,
    /// Candidates with a message id outside the dialect; their CRC cannot be checked.
    pub unknown_ids: u64,
    /// Candidates that ended before their stated length.
    pub cut_short: u64,
    /// Candidates with incompatibility flags that this implementation does not know.
    pub unknown_flags: u64,
    /// Bytes that belonged to no frame.
    pub garbage_bytes: u64,
}

impl core::ops::AddAssign for FramerCounters {
    fn add_assign(&mut self, other: Self) {
        self.frames += other.frames;
        self.crc_errors += other.crc_errors;
        self.unknown_ids += other.unknown_ids;
        self.cut_short += other.cut_short;
        self.unknown_flags += other.unknown_flags;
        self.garbage_bytes += other.garbage_bytes;
    }
}

/// Finds frames in a stream of bytes.
///
/// After a rejected candidate the search continues at its second byte, so that a start marker inside garbage never
/// hides the frame behind it. A candidate that waits for bytes is rejected once no more bytes will come: at the end
/// of a datagram, and when a serial line falls silent. The framer keeps at most one partial frame between calls.
#[derive(Debug, Default)]
pub struct Framer {
    buffer: Vec<u8>,
    start: usize,
    /// No more bytes will follow those in the buffer.
    ended: bool,
    counters: FramerCounters,
}

impl Framer {
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends bytes of a stream. Call [`Framer::next_frame`] until it returns `None` afterwards.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.start);
        self.start = 0;
        self.buffer.extend_from_slice(bytes);
        self.ended = false;
    }

    /// Appends a whole datagram; no frame continues in the next one. Call [`Framer::next_frame`] until it returns
    /// `None` afterwards.
    pub fn push_datagram(&mut self, bytes: &[u8]) {
        self.push(bytes);
        self.ended = true;
    }

    /// Notes that the stream has paused for longer than a frame may, so that an incomplete frame will stay
    /// incomplete. Call [`Framer::next_frame`] until it returns `None` afterwards: a whole frame may follow the
    /// incomplete one.
    pub fn on_silence(&mut self) {
        self.ended = true;
    }

    pub fn counters(&self) -> FramerCounters {
        self.counters
    }

    /// Returns the next whole frame, or `None` until more bytes arrive.
    pub fn next_frame(&mut self) -> Option<Frame> {
        self.next_view().map(|view| view.to_frame())
    }

    /// As [`Framer::next_frame`], without a copy.
    #[inline]
    pub fn next_view(&mut self) -> Option<FrameView<'_>> {
        let found = self.find()?;
        Some(FrameView { bytes: &self.buffer[found] })
    }

    /// Returns where the next whole frame lies in the buffer, and counts it as taken.
    #[inline]
    fn find(&mut self) -> Option<Range<usize>> {
        loop {
            let candidate = &self.buffer[self.start..];
            // Usually a frame follows directly after a frame.
            if candidate.first() != Some(&MAGIC) {
                let Some(skipped) = candidate.iter().position(|byte| *byte == MAGIC) else {
                    self.counters.garbage_bytes += candidate.len() as u64;
                    self.start = self.buffer.len();
                    return None;
                };
                self.counters.garbage_bytes += skipped as u64;
                self.start += skipped;
            }
            match examine(&self.buffer[self.start..]) {
                Candidate::Incomplete if !self.ended => return None,
                Candidate::Incomplete => self.counters.cut_short += 1,
                Candidate::Whole(len) => {
                    let from = self.start;
                    self.start += len;
                    self.counters.frames += 1;
                    return Some(from..self.start);
                }
                Candidate::BadCrc => self.counters.crc_errors += 1,
                Candidate::UnknownId => self.counters.unknown_ids += 1,
                Candidate::UnknownFlags => self.counters.unknown_flags += 1,
            }
            self.counters.garbage_bytes += 1;
            self.start += 1;
        }
    }
}

enum Candidate {
    Incomplete,
    Whole(usize),
    BadCrc,
    UnknownId,
    UnknownFlags,
}

/// Classifies bytes that begin with a start marker.
#[inline]
fn examine(candidate: &[u8]) -> Candidate {
    let signature_len = match candidate {
        [_, _, flags, ..] if flags & !INCOMPAT_SIGNED != 0 => return Candidate::UnknownFlags,
        [_, _, flags, ..] if flags & INCOMPAT_SIGNED != 0 => SIGNATURE_LEN,
        _ => 0,
    };
    if candidate.len() < HEADER_LEN {
        return Candidate::Incomplete;
    }
    let message_id = u32::from_le_bytes([candidate[7], candidate[8], candidate[9], 0]);
    let Some(crc_extra) = crc_extra(message_id) else {
        return Candidate::UnknownId;
    };
    let crc_at = HEADER_LEN + usize::from(candidate[1]);
    let len = crc_at + CRC_LEN + signature_len;
    if candidate.len() < len {
        return Candidate::Incomplete;
    }
    let found = u16::from_le_bytes([candidate[crc_at], candidate[crc_at + 1]]);
    if mavlink_core::calculate_crc(&candidate[1..crc_at], crc_extra) == found {
        Candidate::Whole(len)
    } else {
        Candidate::BadCrc
    }
}
