//! Writes frames into a `.tlog` file.

use std::io::{self, Write};

use crate::log::record::Record;

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
}
