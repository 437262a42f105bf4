//! u-blox M10 over a UART (interface description UBX-21035062): the message UBX-NAV-PVT, and the
//! setting for more than 1 g, which is read back.
//!
//! Compared with u-blox' public library `ubxlib`: messages with
//! `gnss/api/u_gnss_dec_ubx_nav_pvt.h`, keys and layers with `gnss/src/u_gnss_cfg.c`
//! (`valSetByte`, `valGetByte`) and `gnss/api/u_gnss_cfg_val_key.h`, the model with
//! `gnss/api/u_gnss_type.h`.

use embedded_io::Write;
use flight::estimation::estimator::FixQuality;

/// UBX-CFG-VALSET of one key, in RAM alone: a reset of the receiver forgets it, so it is sent until
/// it is read back. CFG-NAVSPG-DYNMODEL (0x20110021) = 8 (U_GNSS_DYNAMIC_AIRBORNE_4G). The default
/// model rejects the motion of a rocket.
const SET_AIRBORNE: [u8; 9] = [0, 0x01, 0, 0, 0x21, 0x00, 0x11, 0x20, 8];
/// UBX-CFG-VALGET of that key from RAM.
const GET_MODEL: [u8; 8] = [0, 0, 0, 0, 0x21, 0x00, 0x11, 0x20];

/// Sync, class, identifier and length of the answer to [`GET_MODEL`], and its whole length.
pub(crate) const MODEL_HEAD: &[u8] = &[0xB5, 0x62, 0x06, 0x8B, 9, 0];
pub(crate) const MODEL_BYTES: usize = 17;

/// Sets the receiver to airborne below 4 g, and asks which it is. Nothing waits: bytes without room
/// are sent again with the next request.
pub(crate) fn request_airborne(uart: &mut impl Write) {
    for (identifier, payload) in [(0x8A, &SET_AIRBORNE[..]), (0x8B, &GET_MODEL)] {
        let mut frame =
            [0xB5, 0x62, 0x06, identifier, payload.len() as u8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let end = 6 + payload.len();
        frame[6..end].copy_from_slice(payload);
        let sum = checksum(&frame[2..end]);
        frame[end..end + 2].copy_from_slice(&sum);
        let _ = uart.write(&frame[..end + 2]);
    }
}

/// Whether an answer confirms the model; `None` if it is broken, or about another key.
pub(crate) fn is_airborne(frame: &[u8; MODEL_BYTES]) -> Option<bool> {
    let intact = checksum(&frame[2..15]) == frame[15..] && frame[10..14] == GET_MODEL[4..];
    intact.then_some(frame[14] == SET_AIRBORNE[8])
}

/// Sync, class, identifier, and the length of the payload.
pub(crate) const HEAD: &[u8] = &[0xB5, 0x62, 0x01, 0x07, 92, 0];
pub(crate) const FRAME_BYTES: usize = 100;
/// `fixType` of a fix in space, and of one with dead reckoning.
const IN_SPACE: [u8; 2] = [3, 4];

/// A fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fix {
    pub(crate) latitude_deg: f64,
    pub(crate) longitude_deg: f64,
    /// Above mean sea level, m.
    pub(crate) height_m: f64,
    /// North, east, down, m/s.
    pub(crate) velocity_ned_m_s: [f64; 3],
    /// `numSV`, `hAcc`, `vAcc` and `sAcc`.
    pub(crate) quality: FixQuality,
}

/// The fix of a frame, if its checksum is right and the receiver vouches for it: `gnssFixOK` in
/// `flags`, and not `invalidLlh` in `flags3`.
pub(crate) fn fix(frame: &[u8; FRAME_BYTES]) -> Option<Fix> {
    let payload = &frame[6..98];
    let vouched = IN_SPACE.contains(&payload[20]) && payload[21] & 1 == 1 && payload[78] & 1 == 0;
    if checksum(&frame[2..98]) != frame[98..] || !vouched {
        return None;
    }
    let bytes = |at: usize| [payload[at], payload[at + 1], payload[at + 2], payload[at + 3]];
    let number = |at: usize| f64::from(i32::from_le_bytes(bytes(at)));
    // The largest number if unknown.
    let accuracy = |at: usize| f64::from(u32::from_le_bytes(bytes(at))) * 1e-3;
    Some(Fix {
        longitude_deg: number(24) * 1e-7,
        latitude_deg: number(28) * 1e-7,
        height_m: number(36) * 1e-3,
        velocity_ned_m_s: [48, 52, 56].map(|at| number(at) * 1e-3),
        quality: FixQuality {
            satellites: u32::from(payload[23]),
            horizontal_m: accuracy(40),
            vertical_m: accuracy(44),
            speed_m_s: accuracy(68),
        },
    })
}

/// The checksum of class, identifier, length and payload.
pub(crate) fn checksum(bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold([0, 0], |[a, b]: [u8; 2], byte| {
        let a = a.wrapping_add(*byte);
        [a, b.wrapping_add(a)]
    })
}
