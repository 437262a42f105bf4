//! A flight log of any bytes, and a good one with bytes changed.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| protocol::hostile::log(data));
