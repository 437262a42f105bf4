//! Identification of a mission: a short hash of its text, compared by vehicle and ground.

use core::fmt;

use sha2::{Digest as _, Sha256};

use crate::command::integer_in;
use crate::text::shown;

/// The first eight bytes of the SHA-256 of a mission's text, as in TD_MISSION. Any edit changes it,
/// including comments, except the line with the start of the flight (`at` in `[start]`): that is
/// chosen for each flight (`--start`). 64 bits distinguish missions; they do not protect against a
/// deliberate search for a text with the same hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "transport", derive(serde::Serialize, serde::Deserialize))]
pub struct MissionHash(pub [u8; 8]);

impl MissionHash {
    pub fn of(text: &str) -> Self {
        let (mut digest, mut in_start) = (Sha256::new(), false);
        for line in text.split_inclusive('\n') {
            if line.starts_with('[') {
                in_start = line.trim_end() == "[start]";
            }
            let key = line.split_once('=').map_or("", |(key, _)| key.trim());
            if !(in_start && key == "at") {
                digest.update(line);
            }
        }
        let mut hash = [0; 8];
        hash.copy_from_slice(&digest.finalize()[..8]);
        Self(hash)
    }
}

/// A float represents every integer up to 2^24, so 22 bits plus one in any case.
const BITS_A_PARAM: u32 = 22;
const MASK: u64 = (1 << BITS_A_PARAM) - 1;

/// The mission in an arming command: the one that the station is prepared for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Nothing, as from other ground stations: any mission is armed.
    Any,
    Hash(MissionHash),
    /// Something that is no hash.
    Unreadable,
}

impl MissionHash {
    /// The hash as parameters 4 to 6 of MAV_CMD_COMPONENT_ARM_DISARM: 22 bits each, the lowest
    /// first, plus one, so that 0 means that none is given. A float holds each of them exactly.
    pub fn to_params(self) -> [f32; 3] {
        let bits = u64::from_le_bytes(self.0);
        [0, 1, 2].map(|place| ((bits >> (BITS_A_PARAM * place)) & MASK) as f32 + 1.0)
    }
}

impl Expected {
    /// Reads parameters 4 to 6 of an arm. Other ground stations leave them at 0 or NaN.
    pub fn of_params(params: [f32; 3]) -> Self {
        let is_unset = |param: &f32| param.is_nan() || param.abs() < 0.5;
        if params.iter().all(is_unset) {
            return Self::Any;
        }
        let mut bits = 0;
        for (place, param) in (0..).zip(params) {
            // The last parameter has the 20 bits that are left.
            let most = (u64::MAX >> (BITS_A_PARAM * place)) & MASK;
            let Some(part) = integer_in(param, 1..=most as u32 + 1) else { return Self::Unreadable };
            bits |= u64::from(part - 1) << (BITS_A_PARAM * place);
        }
        Self::Hash(MissionHash(bits.to_le_bytes()))
    }
}

/// Sixteen hexadecimal digits in groups of four, to be read aloud.
impl fmt::Display for MissionHash {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&shown(&self.0))
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
        for unset in [[0.0; 3], [f32::NAN; 3], [0.0, f32::NAN, -0.0]] {
            assert_eq!(Expected::of_params(unset), Expected::Any);
        }
        for wrong in [
            [1.0, 2.0, 0.0],
            [1.5, 1.0, 1.0],
            [4_194_305.0; 3],
            [1.0, 1.0, 1_048_577.0],
            [f32::INFINITY; 3],
            [-1.0; 3],
        ] {
            assert_eq!(Expected::of_params(wrong), Expected::Unreadable, "{wrong:?}");
        }
    }

    #[test]
    fn the_start_is_no_part_of_the_mission_and_everything_else_is() {
        let text = "name = \"a\"\n[start]\nheight_m = 300.0\n\n[other]\nat = 1\n";
        let hash = MissionHash::of(text);
        for same in [
            text.replace("300.0\n", "300.0\nat = \"pad\"\n"),
            text.replace("[start]\n", "[start]\nat=\"drone\"   # from below\n"),
        ] {
            assert_eq!(MissionHash::of(&same), hash, "{same}");
        }
        for other in
            [text.replace("300.0", "301.0"), text.replace("at = 1", "at = 2"), text.replace("\n\n", "\n")]
        {
            assert_ne!(MissionHash::of(&other), hash, "{other}");
        }
    }

    /// FIPS 180-2, appendix B.1.
    #[test]
    fn val_fips_the_hash_is_the_beginning_of_sha_256() {
        assert_eq!(MissionHash::of("abc").to_string(), "ba78-16bf-8f01-cfea");
    }
}
