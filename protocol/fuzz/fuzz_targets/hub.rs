//! Several links that bring anything, with and without a key.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| protocol::hostile::hub(data));
