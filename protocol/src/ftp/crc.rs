//! The checksum of a file as MAVLink FTP has it: CRC-32 from 0 on, without a final inversion
//! (<https://mavlink.io/en/guide/crc.html>).

const POLYNOMIAL: u32 = 0xEDB8_8320;

const TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut place = 0;
    while place < 256 {
        let mut value = place as u32;
        let mut bit = 0;
        while bit < 8 {
            value = if value & 1 == 1 { (value >> 1) ^ POLYNOMIAL } else { value >> 1 };
            bit += 1;
        }
        table[place] = value;
        place += 1;
    }
    table
};

/// Continues a checksum with more bytes; the checksum of no bytes is 0.
#[must_use]
pub fn continued(crc: u32, bytes: &[u8]) -> u32 {
    bytes.iter().fold(crc, |crc, byte| (crc >> 8) ^ TABLE[((crc ^ u32::from(*byte)) & 0xFF) as usize])
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
