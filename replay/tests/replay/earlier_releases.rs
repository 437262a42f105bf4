//! Logs of earlier releases still open and verify, and what cannot be run again of them is said.
//!
//! The files were recorded by this project before its logs named a schema, and keep of their topics what a replay reads.

use std::path::{Path, PathBuf};

use replay::info::info;
use replay::print::print_verify;
use replay::verify::{Verification, verify};

fn log(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/logs_of_earlier_releases").join(name)
}

#[test]
fn what_they_decided_is_decided_again_bit_for_bit() {
    for (name, ticks, digests) in [("planar-schema-1.mcap", 68, true), ("mk2-schema-1.mcap", 3_132, false)] {
        let report = verify(&log(name)).unwrap().remove(0);
        assert_eq!(report.outcome, Verification::Identical, "{report:?}");
        assert_eq!((report.ticks_compared, report.ticks_identical), (ticks, ticks));
        assert_eq!((report.frames.as_ref(), report.digests_compared), (None, digests));
        let mut said = Vec::new();
        print_verify(&report, &mut said).unwrap();
        let said = String::from_utf8(said).unwrap();
        assert!(said.contains("no frames of the flight computer from power-up"), "{said}");
        assert_eq!(said.contains("what it remembered was not compared"), !digests, "{said}");
        assert_eq!(info(&log(name)).unwrap().schema.version, 1);
    }
}
