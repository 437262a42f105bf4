//! Logs of earlier releases still open and verify, and the report says which parts cannot be run again.
//!
//! This project recorded the files before its logs named a schema. They contain only the topics that a replay reads.

use std::path::{Path, PathBuf};

use replay::info::info;
use replay::verify::print_verify;
use replay::verify::{Verification, verify};

fn log(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/logs_of_earlier_releases").join(name)
}

#[test]
fn the_recorded_decisions_are_made_again_bit_for_bit() {
    let name = "mk2-schema-1.mcap";
    let report = verify(&log(name)).unwrap().remove(0);
    assert_eq!(report.outcome, Verification::Identical, "{report:?}");
    assert_eq!((report.ticks_compared, report.ticks_identical), (3_132, 3_132));
    assert_eq!((report.frames.as_ref(), report.digests_compared), (None, false));
    let mut said = Vec::new();
    print_verify(&report, &mut said).unwrap();
    let said = String::from_utf8(said).unwrap();
    assert!(said.contains("no frames of the flight computer from power-up"), "{said}");
    assert!(said.contains("what it remembered was not compared"), "{said}");
    assert_eq!(info(&log(name)).unwrap().schema.version, 1);
}
