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
fn the_recording_stands_beside_the_log_and_is_kept_unless_forced() {
    let (_folder, log, rrd) = folder();
    write_log(&log);
    let (code, said) = run(&[&log]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("flight.rrd: 4 poses, 1 events"), "{said}");
    assert!(!said.contains("warning"), "{said}");
    std::fs::write(&rrd, "precious").unwrap();
    let (code, said) = run(&[&log]);
    assert_eq!(code, Some(2));
    assert!(said.contains("flight.rrd: cannot be written: it exists already; --force replaces it"), "{said}");
    assert_eq!(std::fs::read(&rrd).unwrap(), b"precious");
    assert_eq!(run(&[&log, Path::new("--force")]).0, Some(0));
    assert!(std::fs::read(&rrd).unwrap().starts_with(b"RRF2"));
}

#[test]
fn damage_is_a_warning_and_no_log_is_an_error() {
    let (folder, log, rrd) = folder();
    write_log(&log);
    let bytes = std::fs::read(&log).unwrap();
    std::fs::write(&log, &bytes[..in_the_third_chunk(&bytes)]).unwrap();
    let (code, said) = run(&[&log, Path::new("-o"), &rrd]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("flight.mcap is damaged: ends after"), "{said}");
    let missing = folder.path().join("missing.mcap");
    let (code, said) = run(&[&missing]);
    assert_eq!(code, Some(2));
    assert!(said.contains("missing.mcap: cannot be read"), "{said}");
    assert_eq!(run(&[]).0, Some(2), "wrong usage");
}
