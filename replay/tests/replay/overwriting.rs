//! Tests that no command overwrites an existing file, and that none leaves an incomplete file under its final name.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command_line::{Files, refusal, replay, run};
use crate::flown::WHOLE;
use crate::simulated::{MK2, WITH_FRAMES};

const OTHERS: &[u8] = b"somebody else's bytes";

/// The commands that write a file, with the name of that file.
fn writers() -> Vec<(&'static [&'static str], &'static str)> {
    vec![
        (&["report", "--out"], "page.html"),
        (&["refly", "--out"], "again.mcap"),
        (&["recover"], "whole.mcap"),
    ]
}

/// Every file of a directory and below, by name.
fn listed(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A copy of a log in a new directory.
fn copied(log: &Path) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("flight.mcap");
    std::fs::copy(log, &path).unwrap();
    (directory, path)
}

#[test]
fn no_existing_file_is_overwritten_without_force() {
    for (arguments, name) in writers() {
        let (directory, log) = copied(&WITH_FRAMES.log);
        let output = directory.path().join(name);
        std::fs::write(&output, OTHERS).unwrap();
        let mut command = replay(arguments[0], &log);
        let refused = refusal(command.args(&arguments[1..]).arg(&output));
        assert!(refused.contains("it exists already; --force replaces it"), "{arguments:?}: {refused}");
        assert_eq!(std::fs::read(&output).unwrap(), OTHERS, "{arguments:?}");
        let (code, stdout, stderr) = run(command.arg("--force"));
        assert_eq!(code, 0, "{arguments:?}: {stdout}{stderr}");
        assert_ne!(std::fs::read(&output).unwrap(), OTHERS, "{arguments:?}");
        let mut expected = vec!["flight.mcap".to_owned(), name.to_owned()];
        expected.sort();
        assert_eq!(listed(directory.path()), expected, "{arguments:?}: nothing else is left");
    }
}

/// Not even with --force or under another name of the same file.
#[test]
fn the_log_that_is_read_is_never_written() {
    for (arguments, _) in writers() {
        let (directory, log) = copied(&WITH_FRAMES.log);
        let before = std::fs::read(&log).unwrap();
        let linked = directory.path().join("linked.mcap");
        std::os::unix::fs::symlink(&log, &linked).unwrap();
        for output in [
            log.clone(),
            linked,
            directory.path().join("../").join(directory.path().file_name().unwrap()).join("flight.mcap"),
        ] {
            for force in [None, Some("--force")] {
                refusal(replay(arguments[0], &log).args(&arguments[1..]).arg(&output).args(force));
                assert_eq!(std::fs::read(&log).unwrap(), before, "{arguments:?}");
            }
        }
    }
}

#[test]
fn tables_and_imports_overwrite_nothing_either() {
    let (directory, log) = copied(&WITH_FRAMES.log);
    let at = |name: &str| directory.path().join(name);
    let table = at("tables").join("vehicle_truth3d.csv");
    std::fs::create_dir_all(at("tables")).unwrap();
    std::fs::write(&table, OTHERS).unwrap();
    let before = listed(&at("tables"));
    let mut command = replay("export", &log);
    command.args(["--to", "csv", "--out"]).arg(at("tables"));
    refusal(&mut command);
    assert_eq!(std::fs::read(&table).unwrap(), OTHERS);
    assert_eq!(listed(&at("tables")), before, "no other table is written if one was refused");
    let (code, _, stderr) = run(command.arg("--force"));
    assert_eq!(code, 0, "{stderr}");
    assert_ne!(std::fs::read(&table).unwrap(), OTHERS);
    let tlog = at("flight.tlog");
    std::fs::copy(crate::simulated::tlog(&WITH_FRAMES, "overwriting.tlog"), &tlog).unwrap();
    let before = std::fs::read(&log).unwrap();
    // Without an output name, the default name is that of the flight's own log.
    refusal(&mut replay("export", &tlog));
    assert_eq!(std::fs::read(&log).unwrap(), before);
    refusal(replay("export", &tlog).arg("--out").arg(&tlog).arg("--force"));
    let (code, _, stderr) = run(replay("export", &tlog).arg("--out").arg(at("imported.mcap")));
    assert_eq!(code, 0, "{stderr}");
}

/// A page with the default name does not replace a page that was edited.
#[test]
fn a_report_twice_needs_force() {
    let (_directory, log) = copied(&MK2.log);
    let (code, ..) = run(&mut replay("report", &log));
    assert_eq!(code, 0);
    refusal(&mut replay("report", &log));
    let (code, ..) = run(replay("report", &log).arg("--force"));
    assert_eq!(code, 0);
    // A device has no content that could be lost.
    let (code, stdout, stderr) = run(replay("report", &log).args(["--out", "/dev/stdout"]));
    assert!(code == 0 && stdout.len() > 10_000, "{stderr}");
}

/// A command that fails keeps the old file and leaves no incomplete one.
#[test]
fn a_command_that_fails_replaces_nothing() {
    let files = Files::new();
    // Cut before its first record.
    let broken = files.file(&WHOLE.bytes[..8]);
    let output = files.directory.path().join("output");
    std::fs::write(&output, OTHERS).unwrap();
    for (arguments, _) in writers() {
        if arguments[0] == "recover" {
            continue;
        }
        refusal(replay(arguments[0], &broken).args(&arguments[1..]).arg(&output).arg("--force"));
        assert_eq!(std::fs::read(&output).unwrap(), OTHERS, "{arguments:?}");
        assert_eq!(listed(files.directory.path()), ["flight.mcap", "output"], "{arguments:?}");
    }
}

/// The disk is full before the output is complete.
#[test]
fn half_an_output_replaces_nothing() {
    for (arguments, name) in writers() {
        let (directory, log) = copied(&WITH_FRAMES.log);
        let output = directory.path().join(name);
        std::fs::write(&output, OTHERS).unwrap();
        // File size is limited to a few kilobytes; writing more fails.
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_replay")]);
        command.arg(arguments[0]).arg(&log).args(&arguments[1..]).arg(&output).arg("--force");
        let refused = refusal(&mut command);
        assert!(refused.contains(&format!("{name}: cannot be written")), "{arguments:?}: {refused}");
        assert_eq!(std::fs::read(&output).unwrap(), OTHERS, "{arguments:?}");
        let mut expected = vec!["flight.mcap".to_owned(), name.to_owned()];
        expected.sort();
        assert_eq!(listed(directory.path()), expected, "{arguments:?}: nothing else is left");
    }
    let (_directory, log) = copied(&MK2.log);
    refusal(replay("report", &log).args(["--out", "/dev/full"]));
}
