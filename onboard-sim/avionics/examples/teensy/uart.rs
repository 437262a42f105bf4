//! Frames of a fixed length out of the bytes of a UART.

use embedded_io::{Read, ReadReady};

/// Puts frames together that begin with the same bytes.
pub(crate) struct Framer<const N: usize> {
    head: &'static [u8],
    frame: [u8; N],
    have: usize,
}

impl<const N: usize> Framer<N> {
    pub(crate) fn new(head: &'static [u8]) -> Self {
        Self { head, frame: [0; N], have: 0 }
    }

    /// Takes a byte; returns the frame that it completes.
    pub(crate) fn take(&mut self, byte: u8) -> Option<&[u8; N]> {
        if self.head.get(self.have).is_some_and(|expected| *expected != byte) {
            self.have = 0;
            if byte != self.head[0] {
                return None;
            }
        }
        self.frame[self.have] = byte;
        self.have = (self.have + 1) % N;
        (self.have == 0).then_some(&self.frame)
    }

    /// Reads received bytes, without waiting; returns the last frame with content.
    pub(crate) fn newest<T>(
        &mut self,
        uart: &mut (impl Read + ReadReady),
        read: impl Fn(&[u8; N]) -> Option<T>,
    ) -> Option<T> {
        let (mut bytes, mut newest) = ([0; 64], None);
        while matches!(uart.read_ready(), Ok(true)) {
            let Ok(count @ 1..) = uart.read(&mut bytes) else { break };
            for byte in &bytes[..count] {
                newest = self.take(*byte).and_then(&read).or(newest);
            }
        }
        newest
    }
}
