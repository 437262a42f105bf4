//! Passes any input to several links, with and without a key.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| protocol_fuzz::hub(data));
