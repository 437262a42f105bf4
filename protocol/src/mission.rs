//! Which mission is meant: a short name for its text, for vehicle and ground to compare.

use std::fmt;

use sha2::{Digest as _, Sha256};

/// The first eight bytes of the SHA-256 of a mission's text, as in TD_MISSION. Any edit changes it, also of a comment.
/// 64 bits tell missions apart; they are no protection against somebody who searches for a text with the same hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionHash(pub [u8; 8]);

impl MissionHash {
    pub fn of(text: &str) -> Self {
        let digest = Sha256::digest(text);
        let mut hash = [0; 8];
        hash.copy_from_slice(&digest[..8]);
        Self(hash)
    }
}

/// Sixteen hexadecimal digits in groups of four, to be read aloud.
impl fmt::Display for MissionHash {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, pair) in self.0.chunks_exact(2).enumerate() {
            let gap = if place == 0 { "" } else { "-" };
            write!(out, "{gap}{:02x}{:02x}", pair[0], pair[1])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FIPS 180-2, appendix B.1.
    #[test]
    fn val_fips_the_hash_is_the_beginning_of_sha_256() {
        assert_eq!(MissionHash::of("abc").to_string(), "ba78-16bf-8f01-cfea");
    }
}
