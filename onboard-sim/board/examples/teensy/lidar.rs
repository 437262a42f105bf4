//! TF-Luna over a UART (Benewake, SJ-PM-TF-Luna): frames of nine bytes, 100 a second.

const FRAME_BYTES: usize = 9;
const HEAD: u8 = 0x59;
/// Strength of an echo that its maker vouches for.
const STRONG: core::ops::Range<u16> = 100..0xFFFF;

/// Puts frames together from bytes.
pub(crate) struct Parser {
    frame: [u8; FRAME_BYTES],
    have: usize,
}

impl Parser {
    pub(crate) const NEW: Self = Self { frame: [0; FRAME_BYTES], have: 0 };

    /// Takes a byte; returns the range that it completes, m, if its echo was strong enough.
    pub(crate) fn take(&mut self, byte: u8) -> Option<f64> {
        if self.have < 2 && byte != HEAD {
            self.have = 0;
            return None;
        }
        self.frame[self.have] = byte;
        self.have += 1;
        if self.have < FRAME_BYTES {
            return None;
        }
        self.have = 0;
        let [_, _, low, high, weak, strong, .., sum] = self.frame;
        let found = self.frame[..8].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        let echo = STRONG.contains(&u16::from_le_bytes([weak, strong]));
        (found == sum && echo).then(|| f64::from(u16::from_le_bytes([low, high])) * 0.01)
    }
}
