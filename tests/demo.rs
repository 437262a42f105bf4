//! The demonstration: `ground` without arguments and without a terminal.

use std::path::Path;

use e2e::{Program, Running, expect_identical_replay, program};

/// The name of the log that a program printed.
fn log_in(output: &str) -> String {
    let is_log = |word: &&str| Path::new(word).extension().is_some_and(|extension| extension == "mcap");
    let name = output.split_whitespace().rev().find(is_log);
    name.unwrap_or_else(|| panic!("no log is named in:\n{output}")).to_owned()
}

#[test]
fn the_demonstration_lands_and_its_log_replays_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let flight = Running::to_end(program(Program::Ground).current_dir(folder.path()));
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    // The mission goes from apogee through both phases to the ground.
    for words in ["PAD_ARMED", "AERO_DESCENT", "LAND_ARMED", "POWERED", "TOUCHDOWN", "STANDS UNDAMAGED"] {
        assert!(flight.output.contains(words), "no {words} in:\n{}", flight.output);
    }
    let log = log_in(&flight.output);

    expect_identical_replay(folder.path(), &log);

    let info =
        Running::to_end(program(Program::Replay).args(["info", "--json"]).arg(folder.path().join(log)));
    assert_eq!(info.code, Some(0), "{}", info.output);
    for words in ["mission mk3", "/computer/frame", "/mavlink/rx/raw", "/mavlink/tx/raw", "bit-exact"] {
        assert!(info.output.contains(words), "no {words} in:\n{}", info.output);
    }
}

#[test]
fn an_impossible_landing_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let listed = Running::to_end(program(Program::OnboardSim).args(["missions", "--show", "mk2"]));
    let height = listed.output.lines().find(|line| line.starts_with("height_m = ")).unwrap();
    // Far below the band of heights from which the motor stops it.
    std::fs::write(folder.path().join("low.toml"), listed.output.replace(height, "height_m = 10.0")).unwrap();
    let arguments = ["--mission", "low.toml", "--start", "apogee"];
    let refused = Running::to_end(program(Program::Ground).args(arguments).current_dir(folder.path()));
    assert_eq!(refused.code, Some(4), "{}", refused.output);
    assert!(refused.output.contains("controller warm: found"), "{}", refused.output);
}

#[test]
fn a_wrong_argument_is_refused_with_the_valid_forms() {
    let folder = tempfile::tempdir().unwrap();
    for (program_of, arguments, words) in [
        (Program::Ground, &["--connect", "tcp:x:1"][..], "udpin:ADDRESS:PORT"),
        (Program::OnboardSim, &["fly", "--mission", "nonsense"][..], "mk2, "),
        (Program::OnboardSim, &["fly", "--speed", "0"][..], "must be `max` or a factor"),
    ] {
        let ended = Running::to_end(program(program_of).args(arguments).current_dir(folder.path()));
        assert!(matches!(ended.code, Some(1 | 2)), "{:?}: {}", ended.code, ended.output);
        assert!(ended.output.contains(words), "{}", ended.output);
    }
}
