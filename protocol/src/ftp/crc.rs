//! The checksum of a file as MAVLink FTP has it: CRC-32 from 0 on, without a final inversion
//! (<https://mavlink.io/en/guide/crc.html>).

use crc32fast::Hasher;

/// Continues a checksum with more bytes; the checksum of no bytes is 0.
#[must_use]
pub fn continued(crc: u32, bytes: &[u8]) -> u32 {
    // The library inverts the checksum before and after, as zip files do.
    let mut hasher = Hasher::new_with_initial(!crc);
    hasher.update(bytes);
    !hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `crcmod.mkCrcFun(0x104C11DB7, initCrc=0, rev=True, xorOut=0)(b"123456789")`.
    #[test]
    fn val_mavlink_crc32_of_the_nine_digits() {
        assert_eq!(continued(0, b"123456789"), 0x2DFD_2D88);
        assert_eq!(continued(continued(0, b"1234"), b"56789"), 0x2DFD_2D88);
        assert_eq!(continued(0, b""), 0);
    }
}
