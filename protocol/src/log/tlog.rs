//! Writes and reads `.tlog` files, the telemetry logs of other ground stations.
//!
//! Each entry is the time in microseconds since the Unix epoch (eight bytes, big-endian), followed
//! by the raw frame. MAVProxy's `mavtee` and `MAVExplorer`, Mission Planner and pymavlink's
//! `mavlogfile` read it.

use std::io;
use std::io::{BufReader, Read, Write};

use super::record::Record;

// Reads frames from a `.tlog` file, also from a damaged one.

const TIME_BYTES: usize = 8;
/// The start markers of MAVLink 2 and MAVLink 1.
const MAGIC_2: u8 = 0xfd;
const MAGIC_1: u8 = 0xfe;
const SIGNED: u8 = 0x01;
/// Length of the longest frame: 10 + 255 + 2 + 13.
const FRAME_MAX_BYTES: usize = 280;
/// Times after the year 2100 are treated as garbage. An unset clock begins in 1970.
const PLAUSIBLE_US: std::ops::Range<u64> = 0..4_102_444_800_000_000;

/// Two frames without a byte between them are in the first bytes of any `.tlog`, also of one whose
/// beginning is damaged.
const RECOGNISED_WITHIN_BYTES: u64 = 1 << 16;

/// Whether a file has the content of a `.tlog`, whatever its name is; reads its first bytes.
///
/// # Errors
/// The input cannot be read.
pub fn is_tlog(input: impl Read) -> io::Result<bool> {
    let mut start = Vec::new();
    input.take(RECOGNISED_WITHIN_BYTES).read_to_end(&mut start)?;
    if start.starts_with(mcap::MAGIC) {
        return Ok(false);
    }
    let is_all = (start.len() as u64) < RECOGNISED_WITHIN_BYTES;
    let mut reader = TlogReader::new(start.as_slice());
    let mut garbage_before = None;
    while reader.next_frame()?.is_some() {
        let garbage = Some(reader.garbage_bytes());
        if garbage_before == garbage {
            return Ok(true);
        }
        garbage_before = garbage;
    }
    if reader.mavlink1() > 1 && reader.garbage_bytes() < FRAME_MAX_BYTES as u64 {
        return Ok(true);
    }
    // One frame alone may be all that was received.
    Ok(is_all && garbage_before == Some(0) && reader.garbage_bytes() == 0)
}

/// A frame and the time at which it was logged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlogFrame {
    /// Microseconds since the Unix epoch.
    pub time_us: u64,
    /// One complete MAVLink 2 frame with the length of its header; its checksum has not been
    /// checked.
    pub bytes: Vec<u8>,
}

/// Reads frames and their times, and counts the bytes between them. It holds one frame in memory at
/// a time.
pub struct TlogReader<R> {
    input: BufReader<R>,
    buffer: Vec<u8>,
    mavlink1: u64,
    garbage_bytes: u64,
    bytes_read: u64,
}

impl<R: Read> TlogReader<R> {
    /// Starts reading at the beginning of `input`.
    pub fn new(input: R) -> Self {
        Self {
            input: BufReader::new(input),
            buffer: Vec::new(),
            mavlink1: 0,
            garbage_bytes: 0,
            bytes_read: 0,
        }
    }

    /// Returns how many MAVLink 1 frames were skipped so far.
    pub fn mavlink1(&self) -> u64 {
        self.mavlink1
    }

    /// Returns how many bytes so far belong to no frame.
    pub fn garbage_bytes(&self) -> u64 {
        self.garbage_bytes
    }

    /// Returns how many bytes have been read so far.
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Returns the next MAVLink 2 frame.
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
                    let bytes = frame.get(..length).unwrap_or_default().to_vec();
                    self.buffer.drain(..TIME_BYTES + length);
                    if bytes.first() == Some(&MAGIC_2) {
                        return Ok(Some(TlogFrame { time_us, bytes }));
                    }
                    self.mavlink1 += 1;
                }
                _ => {
                    // To the next byte that may begin a frame: a file may end in gigabytes of
                    // zeros.
                    let ahead = self.buffer[TIME_BYTES + 1..].iter();
                    let skipped = ahead.take_while(|byte| ![MAGIC_1, MAGIC_2].contains(byte)).count() + 1;
                    self.buffer.drain(..skipped);
                    self.garbage_bytes += skipped as u64;
                }
            }
        }
    }

    /// Fills the buffer up to the length of the longest entry, or to the end of the input.
    fn fill(&mut self) -> std::io::Result<()> {
        let missing = (TIME_BYTES + FRAME_MAX_BYTES).saturating_sub(self.buffer.len());
        self.bytes_read += self.input.by_ref().take(missing as u64).read_to_end(&mut self.buffer)? as u64;
        Ok(())
    }
}

/// Returns the length of the MAVLink 1 or 2 frame that these bytes begin with, according to its
/// header.
fn frame_length(frame: &[u8]) -> Option<usize> {
    let payload = usize::from(*frame.get(1)?);
    match *frame.first()? {
        MAGIC_2 if frame.get(2)? & SIGNED != 0 => Some(payload + 25),
        MAGIC_2 => Some(payload + 12),
        MAGIC_1 => Some(payload + 8),
        _ => None,
    }
}

// Writes frames into a `.tlog` file.

pub struct TlogWriter<W: Write> {
    out: W,
    start_unix_ns: u64,
}

impl<W: Write> TlogWriter<W> {
    /// Starts an empty log; the times of records count from `start_unix_ns`.
    pub fn new(out: W, start_unix_ns: u64) -> Self {
        Self { out, start_unix_ns }
    }

    /// Writes a raw frame that the ground received or sent; skips every other record.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn write(&mut self, record: &Record, time_ns: u64) -> io::Result<()> {
        let Record::RawFrame(frame) = record else { return Ok(()) };
        if frame.endpoint != "ground" {
            return Ok(());
        }
        let unix_us = self.start_unix_ns.saturating_add(time_ns) / 1_000;
        self.out.write_all(&unix_us.to_be_bytes())?;
        self.out.write_all(&frame.bytes)
    }

    /// Writes everything to the operating system.
    ///
    /// # Errors
    /// The underlying writer failed.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::record::{Direction, RawFrame};

    /// The expected bytes are written by hand: 1.000 002 s is 1,000,002 us, 0x0F4242.
    #[test]
    fn val_tlog_is_a_big_endian_time_and_the_frame() -> io::Result<()> {
        let mut bytes = Vec::new();
        let mut tlog = TlogWriter::new(&mut bytes, 1_000_000_000);
        let frame = |endpoint| {
            let link = "udpin:0.0.0.0:14550".to_owned();
            Record::RawFrame(RawFrame { direction: Direction::Rx, endpoint, link, bytes: vec![0xFD, 1, 2] })
        };
        tlog.write(&frame("vehicle"), 0)?;
        tlog.write(&frame("ground"), 2_000)?;
        tlog.flush()?;
        assert_eq!(bytes, [0, 0, 0, 0, 0, 0x0F, 0x42, 0x42, 0xFD, 1, 2]);
        Ok(())
    }

    /// A file that was allocated in advance ends in zeros.
    #[test]
    fn zeros_behind_the_frames_are_counted_and_hide_no_frame() -> io::Result<()> {
        let entry = |time: u8| {
            let mut entry = vec![0, 0, 0, 0, 0, 0, 0, time, MAGIC_2, 2];
            entry.resize(8 + 14, 0);
            entry
        };
        let mut bytes = [entry(1), vec![0; 5_000_000], entry(2), vec![0; 100_000]].concat();
        bytes.push(MAGIC_2);
        let mut reader = TlogReader::new(bytes.as_slice());
        let mut times = Vec::new();
        while let Some(frame) = reader.next_frame()? {
            times.push(frame.time_us);
        }
        assert_eq!((times, reader.garbage_bytes()), (vec![1, 2], 5_100_001));
        Ok(())
    }
}
