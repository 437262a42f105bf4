//! The main job: `ground` without arguments and without a terminal.

use std::path::PathBuf;

use e2e::{Program, Running, program};

/// The path a program printed as its log.
fn log_in(output: &str, folder: &std::path::Path) -> PathBuf {
    let name = output
        .split_whitespace()
        .rev()
        .find(|word| std::path::Path::new(word).extension().is_some_and(|extension| extension == "mcap"))
        .unwrap_or_else(|| panic!("no log's path in:\n{output}"));
    folder.join(name)
}

#[test]
fn a_newcomer_sees_a_landing_and_its_log_replays_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let flight = Running::to_end(program(Program::Ground).current_dir(folder.path()));
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    // The mission itself: from apogee, through both phases, to the ground.
    for words in ["PAD_ARMED", "AERO_DESCENT", "LAND_ARMED", "POWERED", "TOUCHDOWN", "LANDED"] {
        assert!(flight.output.contains(words), "no {words} in:\n{}", flight.output);
    }
    let log = log_in(&flight.output, folder.path());

    let verified = Running::to_end(program(Program::Replay).arg("verify").arg(&log));
    assert_eq!(verified.code, Some(0), "{}", verified.output);
    assert!(verified.output.contains("ticks identical"), "{}", verified.output);

    let info = Running::to_end(program(Program::Replay).arg("info").arg(&log));
    assert_eq!(info.code, Some(0), "{}", info.output);
    for words in ["mission mk2", "/pilot/tick", "/mavlink/rx/raw", "/mavlink/tx/raw", "bit-exact"] {
        assert!(info.output.contains(words), "no {words} in:\n{}", info.output);
    }
}

#[test]
fn the_papers_landing_alone_is_asked_for_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--profile", "paper-calibrated", "--speed", "4"];
    let flight = Running::to_end(program(Program::Ground).args(arguments).current_dir(folder.path()));
    assert_eq!(flight.code, Some(0), "{}", flight.output);
    assert!(
        flight.output.contains("POWERED") && !flight.output.contains("AERO_DESCENT"),
        "{}",
        flight.output
    );
}

#[test]
fn a_landing_that_cannot_be_is_refused_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let refused = Running::to_end(
        program(Program::Ground).args(["--profile", "paper-as-printed"]).current_dir(folder.path()),
    );
    assert_eq!(refused.code, Some(4), "{}", refused.output);
    assert!(refused.output.contains("not landable: best touchdown speed 4.3 m/s"), "{}", refused.output);
}

#[test]
fn a_wrong_word_is_answered_with_what_would_do() {
    let folder = tempfile::tempdir().unwrap();
    for (program_of, arguments, words) in [
        (Program::Ground, &["--connect", "tcp:x:1"][..], "udpin:ADDRESS:PORT"),
        (Program::OnboardSim, &["fly", "--profile", "nonsense"][..], "paper-calibrated"),
        (Program::OnboardSim, &["fly", "--speed", "0"][..], "must be `max` or a factor"),
    ] {
        let ended = Running::to_end(program(program_of).args(arguments).current_dir(folder.path()));
        assert!(matches!(ended.code, Some(1 | 2)), "{:?}: {}", ended.code, ended.output);
        assert!(ended.output.contains(words), "{}", ended.output);
    }
}
