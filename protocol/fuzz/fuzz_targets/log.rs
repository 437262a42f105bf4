//! Reads any bytes as a flight log, and a good log with changed bytes.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| protocol_fuzz::log(data));
