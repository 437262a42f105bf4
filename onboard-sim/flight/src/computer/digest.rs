//! Hash of the flight computer's complete memory.
//!
//! The hash covers the `serde` serialisation of [`Computer`]. A field that cannot affect the future
//! (a mission constant, workspace written before it is read, the last input) has `#[serde(skip)]`
//! and its reason at its declaration. A new field therefore counts unless it is explicitly skipped.
//! What is written once and then only read may count in the frame that writes it.

use core::hash::Hasher as _;

use postcard::ser_flavors::Flavor;
use serde::Serialize;
use twox_hash::XxHash64;

use super::Computer;

/// Bytes passed to the hash at once. Word by word, hashing took a third of the time of `replay
/// verify`.
const BLOCK: usize = 1024;
/// Bytes of a number, the longest write into a block.
const WORD: usize = size_of::<f64>();

/// The running hash, XXH64, as an output of postcard.
struct Digest {
    hash: XxHash64,
    /// Bytes not yet hashed: the first `waiting`, always fewer than a block.
    block: [u8; BLOCK + WORD],
    waiting: usize,
}

impl Digest {
    fn of(remembered: &impl Serialize) -> u64 {
        let empty = Self { hash: XxHash64::with_seed(0), block: [0; BLOCK + WORD], waiting: 0 };
        // It cannot fail: this flavour accepts every byte, and every list of the computer has a
        // length.
        postcard::serialize_with_flavor(remembered, empty).unwrap_or_default()
    }

    /// Appends at most a word.
    #[inline]
    fn append<const N: usize>(&mut self, bytes: [u8; N]) {
        // The remainder changes nothing; it spares a check of the bounds for every number.
        let at = self.waiting % BLOCK;
        self.block[at..at + N].copy_from_slice(&bytes);
        self.waiting = at + N;
        if self.waiting >= BLOCK {
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.hash.write(&self.block[..self.waiting]);
        self.waiting = 0;
    }
}

impl Flavor for Digest {
    type Output = u64;

    #[inline]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.append([byte]);
        Ok(())
    }

    #[inline]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        let (words, rest) = bytes.as_chunks::<WORD>();
        for word in words {
            self.append(*word);
        }
        for byte in rest {
            self.append([*byte]);
        }
        Ok(())
    }

    fn finalize(mut self) -> postcard::Result<u64> {
        self.flush();
        Ok(self.hash.finish())
    }
}

/// Checksum of the state saved through a reset: XXH64.
pub(super) fn checksum(bytes: &[u8]) -> u64 {
    XxHash64::oneshot(0, bytes)
}

impl Computer {
    /// A hash that changes with any part of the computer's memory, to compare a replay with a log.
    pub fn digest(&self) -> u64 {
        Digest::of(self)
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::String;
    use alloc::vec::Vec;

    use super::*;

    #[derive(Serialize)]
    struct Sample {
        numbers: Vec<f64>,
        more: Vec<f64>,
        maybe: Option<u32>,
        #[serde(skip)]
        constant: f64,
    }

    fn sample() -> Sample {
        Sample { numbers: vec![1.0, 0.0], more: vec![2.0], maybe: None, constant: 1.0 }
    }

    #[test]
    fn every_bit_of_the_memory_changes_the_digest() {
        let digest = Digest::of(&sample());
        let other_constant = Sample { constant: sample().constant + 6.0, ..sample() };
        assert_eq!(Digest::of(&other_constant), digest);
        let others = [
            Sample { numbers: vec![1.0, -0.0], ..sample() },
            Sample { numbers: vec![f64::from_bits(1.0_f64.to_bits() + 1), 0.0], ..sample() },
            Sample { numbers: vec![1.0], more: vec![0.0, 2.0], ..sample() },
            Sample { maybe: Some(0), ..sample() },
        ];
        for other in others {
            assert_ne!(Digest::of(&other), digest);
        }
    }

    /// The digest does not depend on the division into blocks, and is never the value of a failure.
    #[test]
    fn the_digest_is_the_hash_of_all_that_postcard_writes() {
        let long = "x".repeat(3 * BLOCK);
        let many: (Vec<f64>, String, Vec<u64>) =
            ((0..1000).map(f64::from).collect(), long, (0..1000).collect());
        let mut room = vec![0; 32 * BLOCK];
        let written = postcard::to_slice(&many, &mut room).unwrap();
        assert_eq!(Digest::of(&many), checksum(written));
        assert_eq!(Digest::of(&()), 0xef46_db37_51d8_e999, "the published XXH64 of nothing with seed 0");
    }
}
