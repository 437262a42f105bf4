//! Frames out of a `.tlog`, also of a damaged one.

use std::io::{BufReader, Read};

const TIME_BYTES: usize = 8;
/// Start markers of MAVLink 2 and of its predecessor.
const MAGIC_2: u8 = 0xfd;
const MAGIC_1: u8 = 0xfe;
const SIGNED: u8 = 0x01;
/// Longest frame there is: 10 + 255 + 2 + 13.
const FRAME_MAX_BYTES: usize = 280;
/// Times outside the years 2000 to 2100 are no times.
const PLAUSIBLE_US: std::ops::Range<u64> = 946_684_800_000_000..4_102_444_800_000_000;

/// A frame and when it was written down.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlogFrame {
    /// Microseconds since the Unix epoch.
    pub time_us: u64,
    /// One whole MAVLink 2 frame, as long as its head says; its checksum has not been looked at.
    pub bytes: Vec<u8>,
}

/// Frames and their times, with what lies between them counted; holds one frame at a time.
pub struct TlogReader<R> {
    input: BufReader<R>,
    buffer: Vec<u8>,
    mavlink1: u64,
    garbage_bytes: u64,
    bytes_read: u64,
}

impl<R: Read> TlogReader<R> {
    /// Reads from the beginning.
    pub fn new(input: R) -> Self {
        Self {
            input: BufReader::new(input),
            buffer: Vec::new(),
            mavlink1: 0,
            garbage_bytes: 0,
            bytes_read: 0,
        }
    }

    /// Frames of MAVLink 1 so far; they are left out.
    pub fn mavlink1(&self) -> u64 {
        self.mavlink1
    }

    /// Bytes so far that belong to no frame.
    pub fn garbage_bytes(&self) -> u64 {
        self.garbage_bytes
    }

    /// Bytes read from the input so far: how far the reading is.
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// The next frame of MAVLink 2.
    ///
    /// # Errors
    /// The input cannot be read.
    pub fn next_frame(&mut self) -> std::io::Result<Option<TlogFrame>> {
        loop {
            self.fill()?;
            if self.buffer.len() <= TIME_BYTES {
                self.garbage_bytes += self.buffer.len() as u64;
                self.buffer.clear();
                return Ok(None);
            }
            let time_us = self.buffer.first_chunk().map_or(0, |bytes| u64::from_be_bytes(*bytes));
            let frame = self.buffer.get(TIME_BYTES..).unwrap_or_default();
            let length = frame_length(frame).filter(|_| PLAUSIBLE_US.contains(&time_us));
            match length {
                Some(length) if frame.len() >= length => {
                    let is_2 = frame.first() == Some(&MAGIC_2);
                    let bytes = frame.get(..length).unwrap_or_default().to_vec();
                    self.buffer.drain(..TIME_BYTES + length);
                    if is_2 {
                        return Ok(Some(TlogFrame { time_us, bytes }));
                    }
                    self.mavlink1 += 1;
                }
                _ => {
                    self.buffer.drain(..1);
                    self.garbage_bytes += 1;
                }
            }
        }
    }

    /// Reads until the buffer has room for the longest frame, or to the end.
    fn fill(&mut self) -> std::io::Result<()> {
        let missing = (TIME_BYTES + FRAME_MAX_BYTES).saturating_sub(self.buffer.len());
        let read = self.input.by_ref().take(missing as u64).read_to_end(&mut self.buffer)?;
        self.bytes_read += read as u64;
        Ok(())
    }
}

/// The length of the frame that bytes begin with, of MAVLink 1 or 2, as its own head says.
pub fn frame_length(frame: &[u8]) -> Option<usize> {
    let payload = usize::from(*frame.get(1)?);
    match *frame.first()? {
        MAGIC_2 if frame.get(2)? & SIGNED != 0 => Some(payload + 25),
        MAGIC_2 => Some(payload + 12),
        MAGIC_1 => Some(payload + 8),
        _ => None,
    }
}
