//! TF-Luna over a UART (Benewake, SJ-PM-TF-Luna): frames of nine bytes, 100 a second.

pub(crate) const FRAME_BYTES: usize = 9;
pub(crate) const HEAD: &[u8] = &[0x59, 0x59];
/// Strength of an echo that its maker vouches for.
const STRONG: core::ops::Range<u16> = 100..0xFFFF;

/// The range of a frame, m, if its checksum is right and its echo was strong enough.
pub(crate) fn range_m(frame: &[u8; FRAME_BYTES]) -> Option<f64> {
    let [bytes @ .., sum] = frame;
    let found = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    let [_, _, low, high, weak, strong, ..] = *bytes;
    let echo = STRONG.contains(&u16::from_le_bytes([weak, strong]));
    (found == *sum && echo).then(|| f64::from(u16::from_le_bytes([low, high])) * 0.01)
}
