//! u-blox over a UART: the message UBX-NAV-PVT (u-blox M10, interface description UBX-21035062),
//! and nothing else.

use flight::estimation::estimator::FixQuality;

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

/// The fix of a frame, if its checksum is right and the receiver vouches for it.
pub(crate) fn fix(frame: &[u8; FRAME_BYTES]) -> Option<Fix> {
    let payload = &frame[6..98];
    if checksum(&frame[2..98]) != frame[98..] || !IN_SPACE.contains(&payload[20]) || payload[21] & 1 == 0 {
        return None;
    }
    let number = |at: usize| {
        f64::from(i32::from_le_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]]))
    };
    Some(Fix {
        longitude_deg: number(24) * 1e-7,
        latitude_deg: number(28) * 1e-7,
        height_m: number(36) * 1e-3,
        velocity_ned_m_s: [48, 52, 56].map(|at| number(at) * 1e-3),
        quality: FixQuality {
            satellites: u32::from(payload[23]),
            horizontal_m: number(40) * 1e-3,
            vertical_m: number(44) * 1e-3,
            speed_m_s: number(68) * 1e-3,
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
