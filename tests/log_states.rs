//! `ground --replay` on every state of a log. Every command of `replay` has the same table
//! (`replay/tests/replay/log_states.rs`).

use e2e::{Ended, Program, Running, log_states, program};

#[test]
fn the_station_shows_every_state_of_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--mission", "vlr", "--seed", "3", "--speed", "max", "--auto", "--log", "flown.mcap"]);
    fly.args(["--mavlink", "udpout:127.0.0.1:9"]).current_dir(folder.path());
    assert_eq!(Running::to_end(&mut fly).code, Some(0));
    let flown = std::fs::read(folder.path().join("flown.mcap")).unwrap();
    let log = folder.path().join("state.mcap");
    let mut wrong = Vec::new();
    // The bits of a head are one kind here: the same reader has each in the other table.
    for state in log_states(&flown).iter().filter(|state| !state.name.starts_with("bit")) {
        std::fs::write(&log, &state.bytes).unwrap();
        let Ended { code, output } = Running::to_end(program(Program::Ground).arg("--replay").arg(&log));
        let has_verdict = output.contains("STANDS UNDAMAGED");
        // Nothing of a vehicle, a flight without its end, or one with it.
        let expected = if state.before == 0 { 1 } else { 5 * i32::from(!has_verdict) };
        let damage = output.matches("damaged: ").count();
        let is_named = damage == usize::from(!state.is_intact) || output.contains(" is empty");
        if code != Some(expected) || !is_named || output.contains("os error") {
            wrong.push(format!("{}: {code:?}, not {expected}: {output}", state.name));
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}
