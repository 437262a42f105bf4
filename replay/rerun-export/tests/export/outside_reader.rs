//! Tests that Rerun's own command accepts the recordings.

use std::process::Command;

use clients::RERUN;

use crate::flown::MK2;

fn output_of(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).unwrap();
    assert!(output.status.success(), "{text}");
    text
}

#[test]
fn recordings_pass_rerun_rrd_verify() {
    let recording = MK2.beside("mk2.rrd");
    let mut export = Command::new(env!("CARGO_BIN_EXE_replay-rerun"));
    let exported = output_of(export.arg(&MK2.log).arg("--out").arg(&recording));
    assert!(exported.contains(" poses,") && !exported.contains("warning"), "{exported}");
    let verified = output_of(RERUN.program("rerun").args(["rrd", "verify"]).arg(&recording));
    assert!(verified.contains("verified without error"), "{verified}");
    let stats = output_of(RERUN.program("rerun").args(["rrd", "stats"]).arg(&recording));
    assert!(stats.contains("num_chunks"), "{stats}");
}
