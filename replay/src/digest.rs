//! FNV-1a, 64 bits: tells files apart, but does not protect against forgery.

use std::fs::File;
use std::io::{self, Read as _};

/// The digest of nothing.
pub(crate) const START: u64 = 0xcbf2_9ce4_8422_2325;

/// The digest with more bytes.
pub(crate) fn digest(so_far: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(so_far, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The digest with the bytes of a file.
pub(crate) fn digest_of_file(mut so_far: u64, input: &mut File) -> io::Result<u64> {
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = input.read(&mut buffer)?;
        if count == 0 {
            return Ok(so_far);
        }
        so_far = digest(so_far, &buffer[..count]);
    }
}
