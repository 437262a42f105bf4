//! TF-Luna over a UART (Benewake, SJ-PM-TF-Luna A05, appendix I, "9-byte/cm (Default)"): head,
//! distance, strength, temperature, sum of all; low bytes first, 100 a second (section 5.5).

pub(crate) const FRAME_BYTES: usize = 9;
pub(crate) const HEAD: &[u8] = &[0x59, 0x59];
/// Strength of an echo that its maker vouches for: the distance is unreliable below 100, and at
/// 65,535, which is overexposed (the same).
const STRONG: core::ops::Range<u16> = 100..0xFFFF;

/// The range of a frame, m, if its checksum is right and its echo was strong enough.
pub(crate) fn range_m(frame: &[u8; FRAME_BYTES]) -> Option<f64> {
    let [bytes @ .., sum] = frame;
    let found = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    let [_, _, low, high, weak, strong, ..] = *bytes;
    let echo = STRONG.contains(&u16::from_le_bytes([weak, strong]));
    (found == *sum && echo).then(|| f64::from(u16::from_le_bytes([low, high])) * 0.01)
}
