//! Tests a log with a flipped byte: every command says what was not read.

use std::path::{Path, PathBuf};

use replay::verify::verify;

use crate::command_line::{replay, run};
use crate::flown::only;
use crate::from_apogee::LANDED;
use crate::simulated::MK2;
use crate::tampered::Held;

/// The log with one byte changed in the middle of a chunk, a quarter of the way in.
fn flipped(log: &Path, directory: &tempfile::TempDir) -> PathBuf {
    let mut bytes = std::fs::read(log).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let chunk = &chunks[chunks.len() / 4];
    bytes[usize::try_from(chunk.chunk_start_offset + chunk.chunk_length / 2).unwrap()] ^= 0xff;
    let path = directory.path().join("flipped.mcap");
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_log_with_a_flipped_byte_does_not_pass() {
    let directory = tempfile::tempdir().unwrap();
    for log in [&LANDED.log, &MK2.log] {
        let all = Held::read(log).frames() as u64;
        let path = flipped(log, &directory);
        let report = only(verify(&path).unwrap());
        assert!(0 < report.frames_recorded && report.frames_recorded < all, "{report:?}");
        assert!(report.damage.is_some());
        let (code, _, _) = run(replay("verify", &path).arg("--strict"));
        assert_eq!(code, 3);
    }
}
