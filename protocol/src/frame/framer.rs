//! Bytes in any chunking to checked frames.

use super::{CRC_LEN, Frame, HEADER_LEN, INCOMPAT_SIGNED, MAGIC, SIGNATURE_LEN, crc_extra};

/// What a [`Framer`] has seen, kept and thrown away.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FramerCounters {
    /// Frames with a right CRC.
    pub frames: u64,
    /// Candidates whose CRC was wrong.
    pub crc_errors: u64,
    /// Candidates with a message id outside the dialect (their CRC cannot be checked).
    pub unknown_ids: u64,
    /// Candidates that ended before their length.
    pub cut_short: u64,
    /// Candidates with incompatibility flags that this implementation does not know.
    pub unknown_flags: u64,
    /// Bytes that belonged to no frame.
    pub garbage_bytes: u64,
}

impl std::ops::AddAssign for FramerCounters {
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
/// A rejected candidate is retried from its second byte, so that a start marker inside garbage never hides the
/// frame behind it. A candidate that waits for bytes is rejected too as soon as it is known that none will come:
/// at the end of a datagram, and when a serial line falls silent. Holds at most one partial frame between calls.
#[derive(Debug, Default)]
pub struct Framer {
    buffer: Vec<u8>,
    start: usize,
    /// No byte will follow what is in the buffer.
    ended: bool,
    counters: FramerCounters,
}

impl Framer {
    /// An empty framer.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends bytes of a stream; call [`Framer::next_frame`] until it returns `None` afterwards.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.start);
        self.start = 0;
        self.buffer.extend_from_slice(bytes);
        self.ended = false;
    }

    /// Appends a whole datagram, whose end is the end of its frames; call [`Framer::next_frame`] until it returns
    /// `None` afterwards.
    pub fn push_datagram(&mut self, bytes: &[u8]) {
        self.push(bytes);
        self.ended = true;
    }

    /// The stream has fallen silent for longer than a frame may pause: what is incomplete will stay so. Call
    /// [`Framer::next_frame`] until it returns `None` afterwards: a whole frame may stand behind it.
    pub fn on_silence(&mut self) {
        self.ended = true;
    }

    /// Counters since the start.
    pub fn counters(&self) -> FramerCounters {
        self.counters
    }

    /// The next whole frame, or `None` until more bytes arrive.
    pub fn next_frame(&mut self) -> Option<Frame> {
        loop {
            let candidate = &self.buffer[self.start..];
            let Some(skipped) = candidate.iter().position(|byte| *byte == MAGIC) else {
                self.counters.garbage_bytes += candidate.len() as u64;
                self.start = self.buffer.len();
                return None;
            };
            self.counters.garbage_bytes += skipped as u64;
            self.start += skipped;
            match examine(&self.buffer[self.start..]) {
                Candidate::Incomplete if !self.ended => return None,
                Candidate::Incomplete => self.counters.cut_short += 1,
                Candidate::Whole(len) => {
                    let bytes = self.buffer[self.start..self.start + len].to_vec();
                    self.start += len;
                    self.counters.frames += 1;
                    return Some(Frame { bytes });
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

/// Looks at bytes that begin with a start marker.
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
    if mavlink::calculate_crc(&candidate[1..crc_at], crc_extra) == found {
        Candidate::Whole(len)
    } else {
        Candidate::BadCrc
    }
}
