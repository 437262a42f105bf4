//! Frames with a right checksum and anything in them, through every decoder.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| protocol::hostile::frames(data));
