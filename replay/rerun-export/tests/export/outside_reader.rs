//! Tests that Rerun's own command accepts the recordings.

use std::process::Command;

use clients::RERUN;

use crate::flown::{MK2, NOMINAL, Simulated};

fn said(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8(said).unwrap();
    assert!(output.status.success(), "{said}");
    said
}

#[test]
fn recordings_pass_rerun_rrd_verify() {
    let verified = |flight: &Simulated, name: &str| {
        let recording = flight.beside(name);
        let mut export = Command::new(env!("CARGO_BIN_EXE_replay-rerun"));
        let exported = said(export.arg(&flight.log).arg("--output").arg(&recording));
        assert!(exported.contains("controller ticks") && !exported.contains("warning"), "{exported}");
        let verified = said(RERUN.program("rerun").args(["rrd", "verify"]).arg(&recording));
        assert!(verified.contains("verified without error"), "{verified}");
        said(RERUN.program("rerun").args(["rrd", "stats"]).arg(&recording))
    };
    for (flight, name) in [(&NOMINAL, "planar.rrd"), (&MK2, "mk2.rrd")] {
        let stats = verified(flight, name);
        assert!(stats.contains("num_chunks"), "{stats}");
    }
}
