//! Passes frames with a correct checksum and any content through every decoder.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| protocol_fuzz::frames(data));
