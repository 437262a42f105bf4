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

    /// The last frame with content among received bytes.
    pub(crate) fn newest<T>(&mut self, bytes: &[u8], read: impl Fn(&[u8; N]) -> Option<T>) -> Option<T> {
        bytes.iter().fold(None, |newest, byte| self.take(*byte).and_then(&read).or(newest))
    }
}

/// Gives received bytes to `take`, without waiting for more.
pub(crate) fn each(uart: &mut (impl Read + ReadReady), mut take: impl FnMut(&[u8])) {
    let mut bytes = [0; 64];
    while matches!(uart.read_ready(), Ok(true)) {
        let Ok(count @ 1..) = uart.read(&mut bytes) else { break };
        take(&bytes[..count]);
    }
}
