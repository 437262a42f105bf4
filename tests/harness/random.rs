//! Makes pseudo-random numbers, the same ones in every run.

/// Knuth's MMIX generator.
pub struct Random(pub u64);

impl Random {
    /// The next number, of 31 bits.
    #[expect(clippy::should_implement_trait, reason = "an endless sequence needs no iterator's Option")]
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    /// Random bytes, at most this many.
    pub fn bytes(&mut self, length_max: u64) -> Vec<u8> {
        (0..self.next() % (length_max + 1)).map(|_| self.next() as u8).collect()
    }
}
