//! Tests that no command overwrites an existing file, and that none leaves an incomplete file under
//! its final name.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command_line::{Files, refusal, replay, run};
use crate::flown::COMPLETE;
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

/// A file that is there is kept, also the log that is read, under any of its names.
#[test]
fn an_existing_file_is_preserved_and_the_next_free_name_is_reported() {
    for (arguments, name) in writers() {
        let (directory, log) = copied(&WITH_FRAMES.log);
        let at = |name: &str| directory.path().join(name);
        std::fs::write(at(name), OTHERS).unwrap();
        let before = std::fs::read(&log).unwrap();
        std::os::unix::fs::symlink(&log, at("linked.mcap")).unwrap();
        let (stem, ending) = name.split_once('.').unwrap();
        let written = [
            (name, format!("{stem}-2.{ending}")),
            (name, format!("{stem}-3.{ending}")),
            ("flight.mcap", "flight-2.mcap".to_owned()),
            ("linked.mcap", "linked-2.mcap".to_owned()),
        ];
        for (asked, free) in &written {
            let mut command = replay(arguments[0], &log);
            let (code, stdout, stderr) = run(command.args(&arguments[1..]).arg(at(asked)));
            assert_eq!(code, 0, "{arguments:?}: {stdout}{stderr}");
            let said =
                format!("{} exists and is kept; {} is written", at(asked).display(), at(free).display());
            assert!(stderr.contains(&said), "{arguments:?}: {stderr}");
        }
        assert_eq!(std::fs::read(at(name)).unwrap(), OTHERS, "{arguments:?}");
        assert_eq!(std::fs::read(&log).unwrap(), before, "{arguments:?}");
        let kept = ["flight.mcap", "linked.mcap", name].map(str::to_owned);
        let mut expected: Vec<_> = kept.into_iter().chain(written.map(|(_, free)| free)).collect();
        expected.sort();
        assert_eq!(listed(directory.path()), expected, "{arguments:?}: nothing else is left");
    }
}

#[test]
fn tables_get_a_new_folder() {
    let (directory, log) = copied(&WITH_FRAMES.log);
    let at = |name: &str| directory.path().join(name);
    std::fs::create_dir_all(at("tables")).unwrap();
    std::fs::write(at("tables").join("notes.txt"), OTHERS).unwrap();
    let (code, _, stderr) = run(replay("export", &log).args(["--out"]).arg(at("tables")));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(listed(&at("tables")), ["notes.txt"]);
    assert!(at("tables-2").join("vehicle_truth3d.csv").is_file());
    // A folder that has no other name.
    let before = std::fs::read(at("tables-2").join("events.csv")).unwrap();
    let mut here = replay("export", &log);
    let refused = refusal(here.args(["--out", "."]).current_dir(at("tables-2")));
    assert!(refused.contains(".: cannot be written"), "{refused}");
    assert_eq!(std::fs::read(at("tables-2").join("events.csv")).unwrap(), before);
    std::fs::create_dir(at("empty")).unwrap();
    let mut here = replay("export", &log);
    let (code, _, stderr) = run(here.args(["--out", "."]).current_dir(at("empty")));
    assert!(code == 0 && at("empty").join("events.csv").is_file(), "{stderr}");
}

/// Nothing is made of a name that asks for another format.
#[test]
fn tables_are_not_written_into_a_folder_that_is_named_as_a_file() {
    let (directory, log) = copied(&WITH_FRAMES.log);
    for name in ["flight.pdf", "flight.CSV", "flight.rrd"] {
        let path = directory.path().join(name);
        let (code, stdout, stderr) = run(replay("export", &log).arg("--out").arg(&path));
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert!(stderr.contains("cannot be written: a directory, .kml or .gpx is accepted"), "{stderr}");
        assert!(!path.exists(), "{name}");
    }
}

/// A page with the default name does not replace a page that was edited.
#[test]
fn a_report_twice_is_two_pages() {
    let (directory, log) = copied(&MK2.log);
    for name in ["flight.html", "flight-2.html"] {
        let (code, stdout, _) = run(&mut replay("report", &log));
        assert_eq!((code, stdout), (0, format!("{}\n", directory.path().join(name).display())));
    }
    // A device has no content that could be lost.
    let (code, stdout, stderr) = run(replay("report", &log).args(["--out", "/dev/stdout"]));
    assert!(code == 0 && stdout.len() > 10_000, "{stderr}");
    // Also if it is a file, in which the page's name follows.
    let file = std::fs::File::create(directory.path().join("all.html")).unwrap();
    let mut report = replay("report", &log);
    assert!(report.args(["--out", "/dev/stdout"]).stdout(file).status().unwrap().success());
    let all = std::fs::read_to_string(directory.path().join("all.html")).unwrap();
    assert_eq!(all, stdout);
}

/// A command that fails keeps the old file and leaves no incomplete one.
#[test]
fn a_command_that_fails_replaces_nothing() {
    let files = Files::new();
    // Cut before its first record.
    let broken = files.file(&COMPLETE.bytes[..8]);
    let output = files.directory.path().join("output");
    std::fs::write(&output, OTHERS).unwrap();
    for (arguments, _) in writers() {
        if arguments[0] == "recover" {
            continue;
        }
        refusal(replay(arguments[0], &broken).args(&arguments[1..]).arg(&output));
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
        command.arg(arguments[0]).arg(&log).args(&arguments[1..]).arg(&output);
        refusal(&mut command);
        assert_eq!(std::fs::read(&output).unwrap(), OTHERS, "{arguments:?}");
        let mut expected = vec!["flight.mcap".to_owned(), name.to_owned()];
        expected.sort();
        assert_eq!(listed(directory.path()), expected, "{arguments:?}: nothing else is left");
    }
    let (_directory, log) = copied(&MK2.log);
    refusal(replay("report", &log).args(["--out", "/dev/full"]));
}
