//! u-blox over a UART: the message UBX-NAV-PVT (u-blox M10, interface description UBX-21035062), and nothing else.

/// Sync, class, identifier, and the length of the payload.
const HEAD: [u8; 6] = [0xB5, 0x62, 0x01, 0x07, 92, 0];
const FRAME_BYTES: usize = 100;
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
}

/// Puts messages together from bytes.
pub(crate) struct Parser {
    frame: [u8; FRAME_BYTES],
    have: usize,
}

impl Parser {
    pub(crate) const NEW: Self = Self { frame: [0; FRAME_BYTES], have: 0 };

    /// Takes a byte; returns the fix that it completes, if the receiver vouches for it.
    pub(crate) fn take(&mut self, byte: u8) -> Option<Fix> {
        if HEAD.get(self.have).is_some_and(|expected| *expected != byte) {
            self.have = 0;
            if byte != HEAD[0] {
                return None;
            }
        }
        self.frame[self.have] = byte;
        self.have += 1;
        if self.have < FRAME_BYTES {
            return None;
        }
        self.have = 0;
        if checksum(&self.frame[2..98]) == self.frame[98..] { self.fix() } else { None }
    }

    fn fix(&self) -> Option<Fix> {
        let payload = &self.frame[6..98];
        if !IN_SPACE.contains(&payload[20]) || payload[21] & 1 == 0 {
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
        })
    }
}

/// The checksum of class, identifier, length and payload.
pub(crate) fn checksum(bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold([0, 0], |[a, b]: [u8; 2], byte| {
        let a = a.wrapping_add(*byte);
        [a, b.wrapping_add(a)]
    })
}
