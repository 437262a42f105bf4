//! A number for everything a pilot remembers.

use core::fmt::{self, Write as _};

use super::Pilot;

/// FNV-1a, 64 bits (Fowler, Noll and Vo), over the text of what is written to it.
struct Fnv(u64);

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Ok(())
    }
}

impl Pilot {
    /// A number that differs whenever what is remembered differs, to compare a replay with a log.
    ///
    /// It is taken of the derived text of every field, in which each number has as many digits as tell it from its
    /// neighbours: nothing that is added to a pilot can be forgotten here. It takes some ten microseconds to a
    /// millisecond, so it is for logs, not for the flight.
    pub fn digest(&self) -> u64 {
        let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
        // Writing to it cannot fail.
        let _ = write!(hash, "{self:?}");
        hash.0
    }
}
