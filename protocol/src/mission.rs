//! Which mission is meant: a short name for its text, for vehicle and ground to compare.

use core::fmt;

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

/// What an arm says about the mission that the station is prepared for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Nothing, as from other ground stations: any mission is armed.
    Any,
    Hash(MissionHash),
    /// Something that is no hash.
    Unreadable,
}

impl MissionHash {
    /// The hash as parameters 4 to 7 of MAV_CMD_COMPONENT_ARM_DISARM: two bytes each, little-endian, plus one, so that 0
    /// means that none is given. A float holds each of them exactly.
    pub fn to_params(self) -> [f32; 4] {
        let mut params = [0.0; 4];
        for (param, pair) in params.iter_mut().zip(self.0.chunks_exact(2)) {
            *param = f32::from(u16::from_le_bytes([pair[0], pair[1]])) + 1.0;
        }
        params
    }
}

impl Expected {
    /// Reads parameters 4 to 7 of an arm. Other ground stations leave them at 0 or NaN.
    pub fn of_params(params: [f32; 4]) -> Self {
        let is_unset = |param: &f32| param.is_nan() || param.abs() < 0.5;
        if params.iter().all(is_unset) {
            return Self::Any;
        }
        let mut hash = [0; 8];
        for (pair, param) in hash.chunks_exact_mut(2).zip(params) {
            if !((1.0..=65_536.0).contains(&param) && libm::truncf(param).to_bits() == param.to_bits()) {
                return Self::Unreadable;
            }
            pair.copy_from_slice(&((param - 1.0) as u16).to_le_bytes());
        }
        Self::Hash(MissionHash(hash))
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

    #[test]
    fn every_hash_survives_the_parameters_of_an_arm() {
        for byte in 0..=255_u8 {
            let hash = MissionHash([byte, 0, 255, byte, 0, 0, 255, 255 - byte]);
            assert_eq!(Expected::of_params(hash.to_params()), Expected::Hash(hash));
        }
    }

    #[test]
    fn what_other_stations_send_is_no_hash_and_nonsense_is_no_permission() {
        for unset in [[0.0; 4], [f32::NAN; 4], [0.0, f32::NAN, -0.0, 0.0]] {
            assert_eq!(Expected::of_params(unset), Expected::Any);
        }
        for wrong in
            [[1.0, 2.0, 3.0, 0.0], [1.5, 1.0, 1.0, 1.0], [65_537.0; 4], [f32::INFINITY; 4], [-1.0; 4]]
        {
            assert_eq!(Expected::of_params(wrong), Expected::Unreadable, "{wrong:?}");
        }
    }

    /// FIPS 180-2, appendix B.1.
    #[test]
    fn val_fips_the_hash_is_the_beginning_of_sha_256() {
        assert_eq!(MissionHash::of("abc").to_string(), "ba78-16bf-8f01-cfea");
    }
}
