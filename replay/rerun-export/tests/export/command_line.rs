//! Tests the program: its output file, messages and exit codes.

use std::path::Path;
use std::process::Command;

use crate::logs::{folder, in_the_third_chunk, write_log};

/// Exit code and output.
fn run(arguments: &[&Path]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_replay-rerun")).args(arguments).output().unwrap();
    assert!(output.stdout.is_empty());
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn the_recording_is_written_beside_the_log_and_errors_are_reported() {
    let (folder, log, rrd) = folder();
    write_log(&log);
    let bytes = std::fs::read(&log).unwrap();
    assert_eq!(run(&[&log]), (Some(0), format!("replay-rerun: {}: 4 poses, 1 events\n", rrd.display())));
    let (code, output) = run(&[&log]);
    assert!(code == Some(0) && rrd.with_file_name("flight-2.rrd").is_file(), "{output}");
    std::fs::write(&log, &bytes[..in_the_third_chunk(&bytes)]).unwrap();
    std::fs::remove_file(&rrd).unwrap();
    let (code, output) = run(&[&log, Path::new("-o"), &rrd]);
    assert!(code == Some(0) && output.contains("flight.mcap is damaged: ends after"), "{output}");
    assert!(std::fs::read(&rrd).unwrap().starts_with(b"RRF2"));
    assert_eq!(run(&[&folder.path().join("missing.mcap")]).0, Some(1));
    assert_eq!(run(&[]).0, Some(2), "wrong usage");
}
