//! MAVLink FTP, for reading only: a vehicle offers the files of its log, and a ground station
//! fetches them.
//!
//! * [`packet`]: the packets, and the frames that carry them;
//! * [`server`]: the vehicle's side; everything that writes is refused;
//! * [`download`]: the ground's side: it requests several pieces at once, and repeats lost
//!   requests; it continues an interrupted download;
//! * [`crc`]: the checksum of a complete file.
//!
//! A log is fetched after the flight, while recording continues. The recorder sets a mark; the
//! content up to it does not change any more, and the file is offered up to there, with the end of
//! a log behind it. Packets are frames like any other: signed, counted, in the log (without the
//! piece of the file that they carry). A reading link gets a separate lane, which takes one piece
//! at a time when it has room. When the ground has all pieces, the checksums are compared, and the
//! file gets its name.
//!
//! Nothing here reads a file, a clock or a link. Protocol:
//! <https://mavlink.io/en/services/ftp.html>.

pub mod download;
pub mod packet;
pub mod server;

pub use packet::{DATA_LEN, FileRequest, Opcode, Packet};

/// The directory of the log's files.
pub const LOG_DIRECTORY: &str = "/log";

/// The checksum of a file as MAVLink FTP has it: CRC-32 from 0 on, without a final inversion
/// (<https://mavlink.io/en/guide/crc.html>).
pub mod crc {
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
}
